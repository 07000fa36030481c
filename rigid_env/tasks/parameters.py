"""Physical parameters of a task: fixed numbers, or ranges from which each episode of each world draws."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from physics import validation

Number = float | tuple[float, float]
"""A value, or a range (low, high) to draw from."""

Edges = tuple[float, float, float] | tuple[tuple[float, float, float], tuple[float, float, float]]
"""Edges of the block [m], or a range of them."""

CHECKS = {
    "mass": validation.positive,
    "size": validation.positive,
    "friction": validation.non_negative,
    "restitution": validation.share,
    "gravity": validation.positive,
}
"""What each parameter may be."""

LENGTHS = {"mass": 1, "size": 3, "friction": 1, "restitution": 1, "gravity": 1}
"""Numbers in each parameter, in the order in which they are drawn."""

OFF_MIDDLE = (0.25, 0.4, 0.75)
"""Shares of a range of sizes at which the block of a scene is no cube, where the middle is one."""

DRAW_COUNT = sum(LENGTHS.values())
"""Uniform numbers drawn per episode, whether or not anything is randomised: fixing a parameter leaves the
starts and goals of a seed what they are."""


@dataclass(frozen=True)
class Range:
    """Uniform distribution over a box; a fixed value where both ends are the same.

    Parameters
    ----------
    low, high : (k,) float64
    """

    low: np.ndarray
    high: np.ndarray

    @property
    def is_fixed(self) -> bool:
        """True if there is nothing to draw."""
        return bool((self.low == self.high).all())

    @property
    def middle(self) -> np.ndarray:
        """(k,) float64."""
        return 0.5 * (self.low + self.high)

    def at(self, share: np.ndarray) -> np.ndarray:
        """Values at `share` (n, k) in [0, 1) of the way from low to high."""
        return self.low + (self.high - self.low) * share


def parse_range(field: str, value) -> Range:
    """`Range` from what a user gives.

    Parameters
    ----------
    field : str
        Key of `CHECKS`.
    value : number, (3,) numbers for the size, or a pair (low, high) of either
        A pair is a range.

    Raises
    ------
    ValueError
        Naming the field, the value and what is allowed.
    """
    shape = () if LENGTHS[field] == 1 else (LENGTHS[field],)
    try:
        array = np.asarray(value, dtype=np.float64)
    except (TypeError, ValueError):
        array = np.empty((0, 0, 0))
    if array.shape not in (shape, (2, *shape)):
        one = "a number" if shape == () else f"{shape[0]} numbers"
        raise ValueError(f"{field} is {value!r}; allowed is {one}, or a pair (low, high) of such for a range")
    array = CHECKS[field](array, array.shape, field)
    low, high = (array, array) if array.shape == shape else (array[0], array[1])
    if not (low <= high).all():
        raise ValueError(f"{field} is {value!r}; allowed is a pair (low, high) with low at most high")
    return Range(np.atleast_1d(low), np.atleast_1d(high))


class Parameters:
    """The five parameters of the block and its world.

    Parameters
    ----------
    mass, size, friction, restitution, gravity
        See `parse_range`; [kg], [m], 1, 1, [m/s²].

    Attributes
    ----------
    ranges : dict of str to Range
    """

    def __init__(self, **values):
        self.ranges = {field: parse_range(field, values[field]) for field in LENGTHS}

    def __getitem__(self, field: str) -> Range:
        return self.ranges[field]

    @property
    def randomised(self) -> list[str]:
        """Fields that differ from episode to episode."""
        return [field for field, span in self.ranges.items() if not span.is_fixed]

    @property
    def scene_size(self) -> np.ndarray:
        """Edges (3,) of the block that kernels are compiled for: the middle, of a range no cube [m].

        The kernel of a cube has no gyroscopic torque, which all other blocks of the range need.
        """
        span = self["size"]
        if span.is_fixed or np.ptp(span.middle) > 0.0:
            return span.middle
        return span.at(np.array(OFF_MIDDLE))

    def draw(self, shares: np.ndarray) -> dict[str, np.ndarray]:
        """Values from uniform numbers.

        Parameters
        ----------
        shares : (n, DRAW_COUNT) float64
            In [0, 1).

        Returns
        -------
        dict of str to array
            (n,), the size (n, 3).
        """
        values, first = {}, 0
        for field, length in LENGTHS.items():
            drawn = self.ranges[field].at(shares[:, first : first + length])
            values[field] = drawn if length > 1 else drawn[:, 0]
            first += length
        return values
