"""Checks of what users hand in. Every failure is a ValueError that names field, value and what is allowed."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import numpy as np
from numpy.typing import ArrayLike

from physics.kernels.intake import take_in
from physics.machine_code import compiled

# A quaternion counts as a unit quaternion within this; it is then normalised to rounding. Six digits are what
# a state printed or stored in single precision keeps.
UNIT_TOLERANCE = 1e-6

# A vector of up to four components divided by its length has length 1 within this: half an ulp of each quotient and of
# the length, and rounding of the length when it is measured again.
UNIT_ROUNDING = 4 * np.finfo(float).eps


def shaped(value: ArrayLike, shape: tuple[int, ...], field: str) -> np.ndarray:
    """`value` as a float64 array of exactly `shape`."""
    try:
        array = np.asarray(value, dtype=np.float64)
    except (TypeError, ValueError):
        raise ValueError(f"{field} is {value!r}; allowed are numbers in shape {shape}") from None
    if array.shape != shape:
        raise ValueError(f"{field} has shape {array.shape}; allowed is shape {shape}")
    return array


def finite(value: ArrayLike, shape: tuple[int, ...], field: str) -> np.ndarray:
    """`value` as a float64 array of exactly `shape`, all finite."""
    array = shaped(value, shape, field)
    if not np.isfinite(array).all():
        raise _not_finite(array, field)
    return array


def take_finite(value: ArrayLike, target: np.ndarray, field: str) -> None:
    """Copy `value` to `target`, a contiguous float64 array of the shape that it must have, all finite.

    Copied and looked at in one pass: after an error `target` is changed, too. For what is handed in with every step.
    """
    array = shaped(value, target.shape, field)
    if not _taking()(np.ascontiguousarray(array).reshape(1, -1), target.reshape(1, -1)):
        raise _not_finite(array, field)


@cache
def _taking() -> Callable[[np.ndarray, np.ndarray], bool]:
    return compiled(take_in, (np.zeros((1, 1)), np.zeros((1, 1))))


def _not_finite(array: np.ndarray, field: str) -> ValueError:
    return ValueError(f"{field} is {_show(array)}; allowed are finite numbers")


def rows(value: ArrayLike, width: int, field: str) -> np.ndarray:
    """`value` as a finite float64 array of any number of rows of `width`."""
    try:
        count = len(np.asarray(value, dtype=np.float64))
    except (TypeError, ValueError):
        raise ValueError(f"{field} is {value!r}; allowed are rows of {width} numbers") from None
    return finite(value, (count, width), field)


def number(value: float, field: str) -> float:
    """A finite float."""
    return float(finite(value, (), field))


def positive(value: ArrayLike, shape: tuple[int, ...], field: str) -> np.ndarray:
    """Finite and greater than zero."""
    array = finite(value, shape, field)
    if not (array > 0).all():
        raise ValueError(f"{field} is {_show(array)}; allowed are numbers greater than 0")
    return array


def non_negative(value: ArrayLike, shape: tuple[int, ...], field: str) -> np.ndarray:
    """Finite and at least zero."""
    array = finite(value, shape, field)
    if not (array >= 0).all():
        raise ValueError(f"{field} is {_show(array)}; allowed are numbers of at least 0")
    return array


def share(value: ArrayLike, shape: tuple[int, ...], field: str) -> np.ndarray:
    """Finite and between zero and one."""
    array = finite(value, shape, field)
    if not ((array >= 0) & (array <= 1)).all():
        raise ValueError(f"{field} is {_show(array)}; allowed are numbers from 0 to 1")
    return array


def count(value: int, field: str, least: int = 1) -> int:
    """An integer of at least `least`."""
    if isinstance(value, bool) or not isinstance(value, (int, np.integer)) or value < least:
        raise ValueError(f"{field} is {value!r}; allowed are integers of at least {least}")
    return int(value)


def unit_quaternion(value: ArrayLike, shape: tuple[int, ...], field: str) -> np.ndarray:
    """Quaternions (w, x, y, z) of length 1 within `UNIT_TOLERANCE`, normalised to rounding."""
    array = finite(value, shape, field)
    length = np.linalg.norm(array, axis=-1, keepdims=True)
    if not (np.abs(length - 1) <= UNIT_TOLERANCE).all():
        raise ValueError(f"{field} is {_show(array)}; allowed are unit quaternions (w, x, y, z)")
    return unit(array, length)


def unit(array: np.ndarray, length: np.ndarray) -> np.ndarray:
    """`array` divided by its `length`; where that is 1 to rounding as it is, so that doing it twice changes nothing."""
    return np.where(np.abs(length - 1) <= UNIT_ROUNDING, array, array / length)


def _show(array: np.ndarray) -> str:
    """The array, or its first bad-looking part when it is long."""
    return np.array2string(array, threshold=8, precision=6, separator=", ")
