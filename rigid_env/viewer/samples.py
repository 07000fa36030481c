"""Samples of a run for plots: one row for each step, in columns by name."""

from __future__ import annotations

import numpy as np

UNITS = {
    "time": "s",
    "kinetic_energy": "J",
    "potential_energy": "J",
    "energy": "J",
    "momentum": "kg m/s",
    "penetration": "m",
    "residual": "1",
    "error": "m",
    "angle": "rad",
    "error_of_reference": "m",
    "cost": "µs/s",
    "cost_of_reference": "µs/s",
}
"""Columns, in their order, and their units."""

FIRST_ROOM = 1024
"""Rows that there is room for at first; it is doubled as needed."""


class Samples:
    """Table of samples; each column of `UNITS` is an attribute, a read-only view of shape (n,) float64.

    Numbers that a subject does not know are NaN.

    Attributes
    ----------
    time : (n,) float64
        [s].
    kinetic_energy, potential_energy, energy : (n,) float64
        Of all bodies together; the last is their sum [J].
    momentum : (n,) float64
        Length of the sum of all momenta [kg m/s].
    penetration, residual : (n,) float64
        Largest of the step [m], [1]; see `physics.StepReport`.
    error, angle : (n,) float64
        Largest distance of a body's centre from the ghost's, and angle of the rotation between the two [m], [rad].
    error_of_reference : (n,) float64
        Of the ghost itself, where it is only an estimate [m].
    cost, cost_of_reference : (n,) float64
        Time of computing per simulated second, smoothed [µs/s].
    """

    def __init__(self):
        self._table, self._count = np.empty((FIRST_ROOM, len(UNITS))), 0

    def __len__(self) -> int:
        return self._count

    def __getattr__(self, name: str) -> np.ndarray:
        if name not in UNITS:
            raise AttributeError(f"Samples has no column {name!r}; allowed are {', '.join(UNITS)}")
        column = self._table[: self._count, list(UNITS).index(name)]
        column.flags.writeable = False
        return column

    def append(self, **values: float) -> None:
        """Add a sample; columns that are not given are NaN."""
        if self._count == len(self._table):
            self._table = np.concatenate((self._table, np.empty_like(self._table)))
        self._table[self._count] = [values.get(name, np.nan) for name in UNITS]
        self._count += 1

    def truncate(self, count: int) -> None:
        """Keep the first `count` samples."""
        self._count = min(self._count, count)
