"""Validation by experiment: measured tosses of a cube, replayed by the engine (``rigid-env tosses``)."""
