"""Programs that measure; each is run as ``python -m benchmarks.NAME`` and keeps its result in ``results/``."""
