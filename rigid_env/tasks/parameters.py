"""Physical parameters that may differ between episodes, and how arguments of the block's tasks give them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from physics import validation
from rigid_env.tasks.distribution import Distribution
from rigid_env.tasks.distributions import Uniform

Number = float | Sequence[float] | NDArray[Any] | Distribution
"""Type of an argument for one number: a fixed value, a pair (low, high) for a uniform range, or a distribution."""

Edges = Sequence[float] | Sequence[Sequence[float]] | NDArray[Any] | Distribution
"""Type of an argument for the block's three edges [m]: fixed values, a pair of them for a range, or a distribution."""

CHECKS = {
    "mass": validation.positive,
    "size": validation.positive,
    "friction": validation.non_negative,
    "restitution": validation.share,
    "gravity": validation.positive,
    "radius": validation.positive,
    "wall_friction": validation.non_negative,
    "wall_restitution": validation.share,
}
"""Function for each parameter that checks whether values are in the allowed range."""

LENGTHS = {"mass": 1, "size": 3, "friction": 1, "restitution": 1, "gravity": 1}
"""Length of a value of each parameter, in the order in which the block's tasks draw the parameters."""

WALL_PARAMETERS = ("wall_friction", "wall_restitution")
"""Parameters of walls; all others are of bodies, or of the world."""

DRAWN_LENGTHS = {**LENGTHS, "radius": 1, **dict.fromkeys(WALL_PARAMETERS, 1)}
"""Length of a value of each parameter that a task may draw: one for the radius of a sphere, three for a size."""

OFF_MIDDLE = (0.25, 0.4, 0.75)
"""Shares of a range of sizes, one for each edge, near the middle but unequal, so that the block is no cube."""


def parse_range(field: str, value: Any) -> Distribution:
    """Make a distribution from a user's value of a physical parameter.

    Parameters
    ----------
    field : str
        Name of the parameter, a key of `LENGTHS`.
    value : number, (3,) numbers for the size, a pair (low, high) of either, or Distribution
        A pair is a uniform range.

    Raises
    ------
    ValueError
        The message names the field, its value and what is allowed.
    """
    length = LENGTHS[field]
    if isinstance(value, Distribution):
        if value.length != length:
            raise ValueError(f"{field} is {value!r}, of {value.length} numbers; allowed are {length}")
        ends = value.ends()
        CHECKS[field](ends, ends.shape, field)
        return value
    shape = () if length == 1 else (length,)
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
    return Uniform(low, high)


def middle(distribution: Distribution) -> np.ndarray:
    """Value of a distribution, () or (k,), where all of its uniform numbers are 0.5."""
    return distribution.at(np.full((1, distribution.uniforms), 0.5), {})[0]


def scene_size(distribution: Distribution) -> np.ndarray:
    """Edges (3,) of the block that kernels are compiled for [m]: the middle of the distribution, but no cube.

    Kernels for a cube leave out the gyroscopic torque, which other blocks of the distribution need.
    """
    size = middle(distribution)
    if distribution.is_fixed or np.ptp(size) > 0.0:
        return size
    shares = np.array([OFF_MIDDLE])
    return distribution.at(shares if distribution.uniforms == 3 else shares[:, :1], {})[0]
