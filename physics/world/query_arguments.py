"""Checks of the arguments of queries, with the results that a user hands in."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from physics import validation
from physics.kernels.queries.ray_cast import first_bad_row
from physics.summary import shown


def vectors(
    value: ArrayLike, worlds: int, field: str, each: str = "rays", may_vanish: bool = True
) -> NDArray[np.float64]:
    """Convert the vectors of rays or poses in `worlds` worlds to an array (worlds or 1, rays or 1, 3).

    `each` is the word for the rays or poses in an error. The error names the first vector that is not finite, or that
    is zero if `may_vanish` is False.
    """
    shapes = f"shape ({worlds}, {each}, 3), ({each}, 3) or (3,)"
    array = validation.floats(value, field, f"are numbers in {shapes}")
    if not 1 <= array.ndim <= 3 or array.shape[-1] != 3 or (array.ndim == 3 and array.shape[0] != worlds):
        raise ValueError(f"{field} has shape {array.shape}; allowed is {shapes}")
    table = np.ascontiguousarray(array.reshape((1,) * (3 - array.ndim) + array.shape))
    bad = first_bad_row(table.reshape(-1, 3), may_vanish)
    if bad >= 0:
        place = np.unravel_index(bad, array.shape[:-1])
        index = f"[{', '.join(map(str, map(int, place)))}]" if place else ""
        allowed = "finite numbers" if may_vanish else "finite numbers that are not all 0"
        raise ValueError(f"{field}{index} is {shown(array[place])}; allowed are {allowed}")
    return table


def row_steps(table: np.ndarray) -> tuple[int, int]:
    """Numbers of rows from one world to the next, and from one ray to the next; 0 if all share the same vector."""
    worlds, rays, _ = table.shape
    return (rays if worlds > 1 else 0), (1 if rays > 1 else 0)


def common_count(tables: Mapping[str, np.ndarray], each: str) -> int:
    """Number of rays or poses that arrays (worlds or 1, rays or 1, ...) share; ValueError if their numbers differ."""
    count = max(table.shape[1] for table in tables.values())
    if any(table.shape[1] == 0 for table in tables.values()):
        count = 0
    for field, table in tables.items():
        if table.shape[1] not in (1, count):
            raise ValueError(
                f"{field} has {table.shape[1]} {each}; allowed are {count}, as in the other argument, and 1"
            )
    return count


def largest_distance(value: float) -> float:
    """Check a largest distance [m], which may be inf."""
    if type(value) is float and value >= 0.0:
        return value
    array = validation.shaped(value, (), "max_distance")
    if not array >= 0.0:
        raise ValueError(f"max_distance is {shown(array)}; allowed are numbers of at least 0, and inf")
    return float(array)


def result(out: Any, kind: type, shapes: Mapping[str, tuple[int, ...]]) -> Any:
    """Check arrays of `out`, a named tuple of the class `kind`, against `shapes` by name, and return it; None makes it.

    `kind.INTEGERS` names the arrays of int64; all others are of float64.
    """
    types = {name: np.int64 if name in kind.INTEGERS else np.float64 for name in shapes}
    if out is None:
        return kind(*(np.empty(shape, types[name]) for name, shape in shapes.items()))
    validation.instance(out, kind, "out", f"None or {kind.__name__} of an earlier call")
    for (name, shape), array in zip(shapes.items(), out):
        is_array = isinstance(array, np.ndarray) and array.shape == shape and array.dtype == types[name]
        if not is_array or not (array.flags.c_contiguous and array.flags.writeable):
            wanted = f"a contiguous array of {types[name].__name__} in shape {shape}"
            raise ValueError(f"out.{name} is {shown(array)}; allowed is {wanted}")
    return out
