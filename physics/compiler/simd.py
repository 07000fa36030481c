"""Lanes: four numbers on which an operation acts at once, in one instruction if the processor has one for it.

A block rests on a wall with three or four vertices, for all of which the same quantities are computed: slip speed,
direction, push. In kernels `Lanes` is an LLVM vector (`fused.simd_types`) or four numbers (`public.simd_types`). This
module defines the operations, and implements them for Python. In an operation of lanes and a number, the number counts
as four equal lanes. No result depends on the processor: each lane has the result of a plain number, and sums are taken
in a fixed order (`lane_sum`).
"""

from __future__ import annotations

import math
import operator
from collections.abc import Callable

import numpy as np

LANE_COUNT = 4


class Lanes:
    """Four numbers, or four truth values, with operators that act on each of them; `x[k]` reads one."""

    __slots__ = ("each",)

    def __init__(self, a, b, c, d):
        self.each = (a, b, c, d)

    def __getitem__(self, k):
        return self.each[k]

    def __neg__(self):
        return Lanes(*(-one for one in self.each))

    def __abs__(self):
        return Lanes(*(abs(one) for one in self.each))

    def __invert__(self):
        return Lanes(*(not one for one in self.each))


def _each(of: Callable, *values) -> Lanes:
    """Apply the function `of` to each lane of some values; a number counts as four equal lanes."""
    spread = [one.each if isinstance(one, Lanes) else (one,) * LANE_COUNT for one in values]
    return Lanes(*(of(*lane) for lane in zip(*spread, strict=True)))


def _of_each_or_one(of: Callable, *values):
    """Apply the function `of` to each lane if a value is lanes, else to the plain numbers."""
    return _each(of, *values) if any(isinstance(one, Lanes) for one in values) else of(*values)


def _divided(x, y) -> float:
    """Quotient of two numbers as in kernels: infinity or NaN where Python would raise an exception."""
    with np.errstate(all="ignore"):
        return float(np.float64(x) / np.float64(y))


def _define(name: str, of: Callable) -> None:
    setattr(Lanes, f"__{name}__", lambda self, other: _each(of, self, other))
    setattr(Lanes, f"__r{name}__", lambda self, other: _each(of, other, self))


for _name, _of in (("add", operator.add), ("sub", operator.sub), ("mul", operator.mul), ("truediv", _divided)):
    _define(_name, _of)
for _name in ("lt", "le", "gt", "ge", "eq", "and", "or"):
    _define(_name, getattr(operator, f"__{_name}__"))


def load_lanes(array, i, j):
    """Read the four numbers `array[i, j]` to `array[i, j + 3]` as lanes."""
    return Lanes(*(float(array[i, j + k]) for k in range(LANE_COUNT)))


def store_lanes(array, i, j, x):
    """Write lanes, or one number four times, to `array[i, j]` to `array[i, j + 3]`."""
    for k, one in enumerate(_each(float, x).each):
        array[i, j + k] = one


def _root(x) -> float:
    return math.sqrt(x) if x >= 0.0 else math.nan


def lane_sqrt(x):
    """Square root of each lane, or of a plain number; NaN for a negative one."""
    return _each(_root, x) if isinstance(x, Lanes) else _root(x)


def larger(x, y):
    """Larger of each pair of lanes, or of two plain numbers: y where y > x, else x, as in `max(x, y)`."""
    return _of_each_or_one(max, x, y)


def smaller(x, y):
    """Smaller of each pair of lanes, or of two plain numbers: y where y < x, else x, as in `min(x, y)`."""
    return _of_each_or_one(min, x, y)


def select_lanes(where, x, y):
    """Choose x in the lanes in which `where` is true, else y; with a plain truth value choose one of two numbers."""
    return _of_each_or_one(lambda true, one, other: one if true else other, where, x, y)


def lane_sum(x):
    """Sum of all four lanes, in the order (x0 + x2) + (x1 + x3): the first half of a vector plus the second half."""
    return (x[0] + x[2]) + (x[1] + x[3])


def lane_sums(a, b, c, d):
    """Sums (`lane_sum`) of each of `a`, `b`, `c` and `d`, as the four lanes of the result."""
    return Lanes(*(lane_sum(_each(float, one)) for one in (a, b, c, d)))


def max_of_lanes(x):
    """Largest number of all four lanes."""
    return max(max(x[0], x[2]), max(x[1], x[3]))


def min_of_lanes(x):
    """Smallest number of all four lanes."""
    return min(min(x[0], x[2]), min(x[1], x[3]))


def first_true_lane(where):
    """Index of the first lane that is true; -1 if none is."""
    return next((k for k in range(LANE_COUNT) if where[k]), -1)
