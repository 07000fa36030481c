"""Checks of what users hand in. Every failure is a ValueError that names field, value and what is allowed."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

# A quaternion counts as a unit quaternion within this; it is then normalised to rounding. Six digits are what
# a state printed or stored in single precision keeps.
UNIT_TOLERANCE = 1e-6

# A vector of up to four components divided by its length has length 1 within this: half an ulp of each quotient and of
# the length, and rounding of the length when it is measured again.
UNIT_ROUNDING = 4 * np.finfo(float).eps


def finite(value: ArrayLike, shape: tuple[int, ...], field: str) -> np.ndarray:
    """`value` as a float64 array of exactly `shape`, all finite."""
    try:
        array = np.asarray(value, dtype=np.float64)
    except (TypeError, ValueError):
        raise ValueError(f"{field} is {value!r}; allowed are numbers in shape {shape}") from None
    if array.shape != shape:
        raise ValueError(f"{field} has shape {array.shape}; allowed is shape {shape}")
    if not np.isfinite(array).all():
        raise ValueError(f"{field} is {_show(array)}; allowed are finite numbers")
    return array


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
