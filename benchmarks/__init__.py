"""Programs that measure: ``python -m benchmarks.NAME``; each keeps its result in ``results/``."""
