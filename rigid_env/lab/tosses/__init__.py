"""Validation on reality: measured tosses of a cube, replayed by the engine (``rigid-env tosses``)."""
