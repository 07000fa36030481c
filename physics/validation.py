"""Checks of users' arguments.

A check returns the value that it was given, converted where the function says so. A bad value raises a ValueError that
names the argument, called `field` here, the value and the allowed values.
"""

from __future__ import annotations

import numbers
import os
from collections.abc import Callable, Iterable
from decimal import Decimal
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from physics.kernels.state.copy_if_finite import copy_if_finite
from physics.keywords import nearest_first
from physics.parallel.bound_call import compiled
from physics.summary import shown

# A quaternion is accepted as a unit quaternion if its norm is 1 within this; it is then normalised to rounding. People
# type, and tables print, four decimals of each component. Each component is then off by up to 5e-5, all four together
# by a vector of length 1e-4, and by the triangle inequality the norm by as much.
UNIT_TOLERANCE = 1e-4

# A vector of up to four components, divided by its length, has length 1 within this. The rounding errors are half an
# ulp of each quotient and of the length, and that of the length when it is measured again.
UNIT_ROUNDING = 4 * np.finfo(float).eps

# Largest count: it fits into every type of integer in which a count is stored.
MOST = 2**31 - 1

# A message shows all numbers of an array that has at most so many of them.
MOST_SHOWN = 9

FLOAT64 = np.dtype(np.float64)


def floats(value: ArrayLike, field: str, allowed: str) -> np.ndarray:
    """Convert `value` to a float64 array; bools, strings, complex numbers, masked values and None are refused.

    The message calls the argument `field` and ends with "allowed" and the words `allowed`.
    """
    array = _real(value)
    if array is None:
        raise ValueError(f"{field} is {shown(value)}; allowed {allowed}")
    return array


def _real(value: ArrayLike) -> np.ndarray | None:
    """Convert `value` to a float64 array; return None if it is no array of real numbers."""
    if type(value) is np.ndarray:
        array = value
    else:
        try:
            array = np.asarray(value)
        except (TypeError, ValueError, OverflowError):  # ragged
            return None
        if isinstance(value, (list, tuple)) and bool in map(type, value):  # NumPy makes them numbers
            return None
        if isinstance(value, np.ma.MaskedArray) and np.ma.is_masked(value):
            return None
    if array.dtype is FLOAT64:
        return array
    if array.dtype.kind in "fiu":
        return array.astype(np.float64)
    return _of_objects(array) if array.dtype.kind == "O" else None


def _of_objects(array: np.ndarray) -> np.ndarray | None:
    """Convert an array of Python numbers (fractions, decimals, large integers) to float64; None if that fails."""
    try:
        return array.astype(np.float64) if all(map(_is_real, array.flat)) else None
    except OverflowError:  # too large for a float
        return None


def _is_real(item) -> bool:
    return isinstance(item, (numbers.Real, Decimal)) and not isinstance(item, (bool, np.bool_))


def shaped(value: ArrayLike, shape: tuple[int, ...], field: str) -> np.ndarray:
    """Convert `value` to a float64 array, which must have exactly this `shape`; errors name it `field`."""
    array = floats(value, field, f"are numbers in shape {shape}" if shape else "is one number")
    if array.shape != shape:
        allowed = f"shape {shape}" if shape else "one number"
        raise ValueError(f"{field} {_given(array)}; allowed is {allowed}{_if_short(array)}")
    return array


def finite(value: ArrayLike, shape: tuple[int, ...], field: str) -> np.ndarray:
    """Convert `value` to a float64 array of exactly this `shape` with finite numbers; errors name it `field`."""
    array = shaped(value, shape, field)
    if not np.isfinite(array).all():
        raise _not_finite(array, field)
    return array


def batch(value: ArrayLike, shape: tuple[int, int, int], field: str) -> np.ndarray:
    """Expand `value` to n numbers for every world and body: a float64 array of `shape` (worlds, bodies, n).

    An error calls the argument `field`.

    Allowed are (worlds, bodies, n), and (bodies, n) for all worlds alike. With one body the axis of bodies may be left
    out: (n,) for all worlds alike, (worlds, n) a row for each world. With several bodies two axes are always (bodies,
    n), whatever the number of worlds. A value for all worlds alike becomes a read-only view.
    """
    worlds, bodies, size = shape
    array = _real(value)
    if array is not None:
        if array.shape == shape:
            return array
        if bodies == 1 and array.shape == (worlds, size):
            return array[:, None]
        if array.shape == shape[1:] or (bodies == 1 and array.shape == (size,)):
            return np.broadcast_to(array, shape)
    alone = [(size,), (worlds, size)] if bodies == 1 else []
    allowed = " or ".join(map(str, dict.fromkeys((*alone, (bodies, size), shape))))
    if array is None:
        raise ValueError(f"{field} is {shown(value)}; allowed are numbers in shape {allowed}")
    raise ValueError(f"{field} {_given(array)}; allowed is shape {allowed}{_if_short(array)}")


def _given(array: np.ndarray) -> str:
    """Describe an array of a wrong shape for a message: ``has shape ...``, or ``is ...`` for a single number."""
    return f"has shape {array.shape}" if array.ndim else f"is {shown(array)}"


def _if_short(array: np.ndarray) -> str:
    """Words that end a message about the shape of an array: its numbers, if they are few; "" for a single number."""
    return f"; given: {shown(array.tolist())}" if array.ndim and array.size <= MOST_SHOWN else ""


def take_finite(value: ArrayLike, target: np.ndarray, field: str) -> None:
    """Copy `value` into `target`, a contiguous float64 array (worlds, bodies, n), and check that it is finite.

    `value` may have all shapes that `batch` allows; errors name it `field`, and leaves `target` overwritten. Copy
    and check take one pass, since every step makes this call.
    """
    if type(value) is np.ndarray and value.shape == target.shape and value.dtype.kind in "fiu":
        array = value
    else:
        array = batch(value, target.shape, field)
    if not _taking()(np.ascontiguousarray(array, np.float64).reshape(1, -1), target.reshape(1, -1)):
        raise _not_finite(array, field)


@cache
def _taking() -> Callable[[np.ndarray, np.ndarray], bool]:
    return compiled(copy_if_finite, (np.zeros((1, 1)), np.zeros((1, 1))))


def _not_finite(array: np.ndarray, field: str) -> ValueError:
    return _bad(array, np.isfinite(array), field, "are finite numbers")


def _bad(array: np.ndarray, good: np.ndarray, field: str, allowed: str) -> ValueError:
    """Make the error about an array in which `good` is False somewhere; of a long array it shows the first such number.

    `good` is a bool array of the same shape. The message calls the array `field` and ends with "allowed" and the words
    `allowed`.
    """
    if array.size <= MOST_SHOWN:
        return ValueError(f"{field} is {shown(array)}; allowed {allowed}")
    place = np.unravel_index(int(np.argmin(good)), array.shape)
    return ValueError(f"{field}[{', '.join(map(str, map(int, place)))}] is {shown(array[place])}; allowed {allowed}")


def rows(value: ArrayLike, width: int, field: str) -> np.ndarray:
    """Convert `value` to a finite float64 array (n, `width`) with any number n of rows; errors name it `field`."""
    array = floats(value, field, f"are rows of {width} numbers")
    if array.ndim != 2 or array.shape[1] != width:
        raise ValueError(f"{field} {_given(array)}; allowed are rows of {width} numbers")
    return finite(array, array.shape, field)


def number(value: ArrayLike, field: str) -> float:
    """Convert `value` to a float, which must be finite; errors name it `field`."""
    return float(finite(value, (), field))


def positive(value: ArrayLike, shape: tuple[int, ...], field: str) -> np.ndarray:
    """Convert `value` to a float64 array of this `shape` with finite numbers above 0; errors name it `field`."""
    array = finite(value, shape, field)
    if not (array > 0).all():
        raise _bad(array, array > 0, field, "are numbers greater than 0")
    return array


def non_negative(value: ArrayLike, shape: tuple[int, ...], field: str) -> np.ndarray:
    """Convert `value` to a float64 array of this `shape` with finite numbers from 0 on; errors name it `field`."""
    array = finite(value, shape, field)
    if not (array >= 0).all():
        raise _bad(array, array >= 0, field, "are numbers of at least 0")
    return array


def share(value: ArrayLike, shape: tuple[int, ...], field: str) -> np.ndarray:
    """Convert `value` to a float64 array of this `shape` with numbers from 0 to 1; errors name it `field`."""
    array = finite(value, shape, field)
    good = (array >= 0) & (array <= 1)
    if not good.all():
        raise _bad(array, good, field, "are numbers from 0 to 1")
    return array


def count(value: int, field: str, least: int = 1, most: int | None = MOST) -> int:
    """Convert `value` to an int, which must be an integer from `least` to `most`; errors name it `field`.

    `most` None sets no upper limit.
    """
    if type(value) is int and least <= value and (most is None or value <= most):
        return value
    if isinstance(value, bool) or not isinstance(value, (int, np.integer)) or value < least:
        raise ValueError(f"{field} is {shown(value)}; allowed are integers of at least {least}")
    if most is not None and value > most:
        raise ValueError(f"{field} is {shown(value)}; allowed are integers from {least} to {most}")
    return int(value)


def index(value: int, count: int, field: str) -> int:
    """Convert `value` to an int, which must be an index from 0 to `count` - 1; errors name it `field`."""
    is_integer = isinstance(value, (int, np.integer)) and not isinstance(value, bool)
    if not is_integer or not 0 <= value < count:
        raise ValueError(f"{field} is {shown(value)}; allowed are indices from 0 to {count - 1}")
    return int(value)


def one_of(value: str, names: Iterable[str], field: str, besides: str = "") -> str:
    """Return `value`, which must be one of `names`.

    The message of an error calls the argument `field` and lists the names, the nearest first. It ends with `besides`,
    words about further allowed values.
    """
    names = list(names)
    if not isinstance(value, str) or value not in names:
        order = nearest_first(value, names) if isinstance(value, str) else names
        raise ValueError(f"{field} is {shown(value)}; allowed are {', '.join(order)}{besides}")
    return value


def instance(value: object, kind: type, field: str, name: str):
    """Return `value`, which must be an instance of the class `kind`.

    The message of an error calls the argument `field`, and the class `name`.
    """
    if not isinstance(value, kind):
        raise ValueError(f"{field} is {shown(value)}; allowed is {name}")
    return value


def path(value: str | os.PathLike, field: str = "path"):
    """Return `value`, which must be the path of a file: a str or a `Path`, not empty; errors name it `field`."""
    if not isinstance(value, (str, os.PathLike)) or not os.fspath(value):
        raise ValueError(f"{field} is {shown(value)}; allowed is the path of a file, a str or a Path")
    return value


def unit_quaternion(value: ArrayLike, shape: tuple[int, ...], field: str) -> np.ndarray:
    """Convert `value` to quaternions (w, x, y, z) of this `shape` (..., 4), normalised to rounding.

    Their norms must be 1 within `UNIT_TOLERANCE`; an error calls the argument `field`.
    """
    array = finite(value, shape, field)
    length = np.linalg.norm(array, axis=-1, keepdims=True)
    off = np.abs(length - 1)
    if not (off <= UNIT_TOLERANCE).all():
        k = int(np.argmax(~(off <= UNIT_TOLERANCE)))
        worst = array.reshape(-1, 4)[k]
        raise ValueError(
            f"{field} is {shown(worst)} of norm {float(length.reshape(-1)[k]):.6g}; allowed are unit quaternions "
            f"(w, x, y, z), of norm 1 within {UNIT_TOLERANCE:g}: divide it by its norm"
        )
    return unit(array, length)


def unit(array: np.ndarray, length: Any) -> np.ndarray:
    """Divide `array` by its `length`, unless that is 1 to rounding: then the array is returned unchanged.

    So a second normalisation changes no bit.
    """
    return np.where(np.abs(length - 1) <= UNIT_ROUNDING, array, array / length)
