"""Lanes, four numbers at once, as a type of Numba; `physics.compiler.simd` defines the meaning of each operation.

Each operation is written as four operations on numbers, in the same order as in `simd`, so that the bits are the same.
LLVM may make vector instructions of them.
"""

from __future__ import annotations

import math
import operator
from collections.abc import Callable

from numba import njit, types
from numba.extending import intrinsic, make_attribute_wrapper, models, overload, register_model

from physics.compiler import simd
from physics.compiler.public.reference_counts import WITHOUT_COUNTS

# Options of all kernels.
OPTIONS = {"error_model": "numpy", "nogil": True, **WITHOUT_COUNTS}


class LanesType(types.Type):
    """Numba type of `Lanes`: four numbers, or four truth values.

    Parameters
    ----------
    dtype : numba.types.Type
        Type of each of the four.
    """

    def __init__(self, dtype):
        self.dtype = dtype
        super().__init__(f"lanes({dtype})")


@register_model(LanesType)
class _LanesModel(models.StructModel):
    def __init__(self, manager, type_):
        super().__init__(manager, type_, [(name, type_.dtype) for name in "abcd"])


for _name in "abcd":
    make_attribute_wrapper(LanesType, _name, _name)


@intrinsic
def _make(typing_context, a, b, c, d):
    """Make lanes of four values of one type, in a kernel."""
    made = LanesType(a)

    def lower(context, builder, sig, args):
        lanes = context.make_helper(builder, sig.return_type)
        for name, value in zip("abcd", args):
            setattr(lanes, name, value)
        return lanes._getvalue()

    return made(a, a, a, a), lower


def _is_lanes(type_) -> bool:
    return isinstance(type_, LanesType)


def _are_lanes(*args) -> bool:
    """True if these types are lanes and numbers, with lanes at least once."""
    return any(map(_is_lanes, args)) and all(_is_lanes(each) or isinstance(each, types.Number) for each in args)


def _overloaded(function: Callable):
    return overload(function, jit_options=OPTIONS, strict=False)


@_overloaded(simd.Lanes)
def _lanes(a, b, c, d):
    if isinstance(a, types.Boolean):
        return lambda a, b, c, d: _make(a, b, c, d)
    return lambda a, b, c, d: _make(float(a), float(b), float(c), float(d))


# --- one of four -------------------------------------------------------------------------------------------------


def _one_of_four(read: Callable) -> Callable:
    """Make the kernel (x) that reads one number of lanes by `read`; if x is a plain number, it returns x."""

    def one(x):
        return read(x)

    @_overloaded(one)
    def choose(x):
        return read if _is_lanes(x) else lambda x: x

    return one


_first, _second = _one_of_four(lambda x: x.a), _one_of_four(lambda x: x.b)
_third, _fourth = _one_of_four(lambda x: x.c), _one_of_four(lambda x: x.d)


@_overloaded(operator.getitem)
def _get(x, k):
    if _is_lanes(x):
        return lambda x, k: x.a if k == 0 else (x.b if k == 1 else (x.c if k == 2 else x.d))
    return None


# --- of each -----------------------------------------------------------------------------------------------------


def _of_each(function: Callable, of: Callable) -> None:
    """Register with Numba that `function` of lanes is `of` applied to each lane."""

    @_overloaded(function)
    def choose(x):
        if _is_lanes(x):
            return lambda x: simd.Lanes(of(x.a), of(x.b), of(x.c), of(x.d))
        return None


def _of_two(function: Callable, of: Callable) -> None:
    """Register `function` of two lanes, or of lanes and a number, with Numba: it applies `of` to each pair."""

    @_overloaded(function)
    def choose(x, y):
        if not _are_lanes(x, y):
            return None

        def each(x, y):
            return simd.Lanes(
                of(_first(x), _first(y)),
                of(_second(x), _second(y)),
                of(_third(x), _third(y)),
                of(_fourth(x), _fourth(y)),
            )

        return each


@njit(**OPTIONS)
def _not(x):
    return not x


_of_each(operator.neg, operator.neg)
_of_each(operator.invert, _not)
_of_each(abs, abs)
for _operator in (operator.add, operator.sub, operator.mul, operator.truediv, operator.lt, operator.le, operator.gt,
                  operator.ge, operator.eq, operator.and_, operator.or_):  # fmt: skip
    _of_two(_operator, _operator)


@njit(**OPTIONS)
def _larger(x, y):
    return max(x, y)


@njit(**OPTIONS)
def _smaller(x, y):
    return min(x, y)


@njit(**OPTIONS)
def _root(x):
    return math.sqrt(x)


for _name, _of in ((simd.larger, _larger), (simd.smaller, _smaller)):
    _of_two(_name, _of)
_of_each(simd.lane_sqrt, _root)


@_overloaded(simd.lane_sqrt)
def _root_of_number(x):
    return None if _is_lanes(x) else lambda x: _root(x)


@_overloaded(simd.larger)
def _larger_number(x, y):
    return None if _are_lanes(x, y) else lambda x, y: _larger(x, y)


@_overloaded(simd.smaller)
def _smaller_number(x, y):
    return None if _are_lanes(x, y) else lambda x, y: _smaller(x, y)


@njit(**OPTIONS)
def _choose_number(where, x, y):
    return x if where else y


@_overloaded(simd.select_lanes)
def _select(where, x, y):
    if not _is_lanes(where):
        return lambda where, x, y: _choose_number(where, float(x), float(y))

    def each(where, x, y):
        return simd.Lanes(
            _choose_number(where.a, _first(x), _first(y)),
            _choose_number(where.b, _second(x), _second(y)),
            _choose_number(where.c, _third(x), _third(y)),
            _choose_number(where.d, _fourth(x), _fourth(y)),
        )

    return each


# --- of all ------------------------------------------------------------------------------------------------------


@_overloaded(simd.lane_sum)
def _sum(x):
    return lambda x: (_first(x) + _third(x)) + (_second(x) + _fourth(x))


@_overloaded(simd.lane_sums)
def _sums(a, b, c, d):
    return lambda a, b, c, d: simd.Lanes(simd.lane_sum(a), simd.lane_sum(b), simd.lane_sum(c), simd.lane_sum(d))


@_overloaded(simd.max_of_lanes)
def _max(x):
    return lambda x: max(max(x.a, x.c), max(x.b, x.d))


@_overloaded(simd.min_of_lanes)
def _min(x):
    return lambda x: min(min(x.a, x.c), min(x.b, x.d))


@_overloaded(simd.first_true_lane)
def _first_true(where):
    return lambda where: 0 if where.a else (1 if where.b else (2 if where.c else (3 if where.d else -1)))


# --- rows of a table ---------------------------------------------------------------------------------------------


@_overloaded(simd.load_lanes)
def _load(array, i, j):
    return lambda array, i, j: simd.Lanes(array[i, j], array[i, j + 1], array[i, j + 2], array[i, j + 3])


@_overloaded(simd.store_lanes)
def _store(array, i, j, x):
    def store(array, i, j, x):
        array[i, j], array[i, j + 1] = _first(x), _second(x)
        array[i, j + 2], array[i, j + 3] = _third(x), _fourth(x)

    return store
