"""Four numbers at once: an operation acts on each, in one instruction if the processor has one for it.

A block rests on a wall with three or four vertices, which all need the same quantities: slip speed, direction, push. In
kernels `Lanes` is a vector of LLVM (`fused.simd_types`) or four numbers (`public.simd_types`). This module defines it,
and implements it without a compiler. A number beside lanes counts as four equal ones. No result depends on the
processor: each lane has the result of a plain number, and sums are taken in one order (`lane_sum`).
"""

from __future__ import annotations

import math
import operator
from collections.abc import Callable

import numpy as np

LANE_COUNT = 4


class Lanes:
    """Four numbers, or four truth values."""

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
    """Function applied to each lane of some values; a number counts as four equal lanes."""
    spread = [one.each if isinstance(one, Lanes) else (one,) * LANE_COUNT for one in values]
    return Lanes(*(of(*lane) for lane in zip(*spread, strict=True)))


def _of_each_or_one(of: Callable, *values):
    """`_each`, or the function of numbers if no argument is lanes."""
    return _each(of, *values) if any(isinstance(one, Lanes) for one in values) else of(*values)


def _divided(x, y) -> float:
    """Quotient as in kernels: infinity or NaN where Python raises an exception."""
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
    """The four numbers `array[i, j]` to `array[i, j + 3]`, in one read."""
    return Lanes(*(float(array[i, j + k]) for k in range(LANE_COUNT)))


def store_lanes(array, i, j, x):
    """Write four numbers, or one of them four times, to `array[i, j]` to `array[i, j + 3]`."""
    for k, one in enumerate(_each(float, x).each):
        array[i, j + k] = one


def _root(x) -> float:
    return math.sqrt(x) if x >= 0.0 else math.nan


def lane_sqrt(x):
    """Square roots; NaN of a negative number. A plain number gives a plain number."""
    return _each(_root, x) if isinstance(x, Lanes) else _root(x)


def larger(x, y):
    """The larger of each two numbers: y where it is larger, as in `max(x, y)`. Two plain numbers give a number."""
    return _of_each_or_one(max, x, y)


def smaller(x, y):
    """The smaller of each two numbers, as in `min(x, y)`."""
    return _of_each_or_one(min, x, y)


def select_lanes(where, x, y):
    """x where a lane is true, else y; for a plain truth value, one of two numbers."""
    return _of_each_or_one(lambda true, one, other: one if true else other, where, x, y)


def lane_sum(x):
    """Sum of all four lanes: first those two apart, which is also the first half and the second half."""
    return (x[0] + x[2]) + (x[1] + x[3])


def lane_sums(a, b, c, d):
    """Sums (`lane_sum`) of four lanes."""
    return Lanes(*(lane_sum(_each(float, one)) for one in (a, b, c, d)))


def max_of_lanes(x):
    """The largest of all four lanes."""
    return max(max(x[0], x[2]), max(x[1], x[3]))


def min_of_lanes(x):
    """The least of all four lanes."""
    return min(min(x[0], x[2]), min(x[1], x[3]))


def first_true_lane(where):
    """Index of the first true lane, or -1."""
    return next((k for k in range(LANE_COUNT) if where[k]), -1)
