"""Four numbers at once: compiled they are, to the last bit, what they are in Python."""

from __future__ import annotations

import math
import types

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from physics.compiler.decorators import inlined, kernel
from physics.compiler.simd import (
    Lanes,
    first_true_lane,
    lane_sqrt,
    lane_sum,
    larger,
    max_of_lanes,
    min_of_lanes,
    select_lanes,
    smaller,
)
from physics.kernels.math import simd_gather

FOUR = st.tuples(*[st.floats(width=64, allow_subnormal=False)] * 4)
NAN, INF = math.nan, math.inf
CORNERS = [(NAN, 0.0, -0.0, 1.0), (INF, -INF, NAN, 2.0), (0.0, -0.0, 0.0, -0.0), (1.0, 1.0, 1.0, 1.0)]


@inlined
def _sums(x, y, s):
    return x + y, x - s, s * y, x / y, s / x, -x, abs(x), 2 * x


@inlined
def _choices(x, y, s):
    return (
        lane_sqrt(x),
        larger(x, y),
        smaller(x, s),
        select_lanes(x > y, x, s),
        select_lanes((x <= s) & ~(y == x), 1.0, y),
    )


@inlined
def _orders(x, y, s):
    return (
        first_true_lane(x < y),
        first_true_lane(x >= s),
        first_true_lane((x > s) | (y > s)),
        first_true_lane(~(x <= y)),
    )


@inlined
def _of_all(x):
    return lane_sum(x), max_of_lanes(x), min_of_lanes(x)


@kernel
def compute(a, b, s, out):
    """All operations on lanes a and b and a number s: four numbers in each row of `out`."""
    x, y = Lanes(a[0], a[1], a[2], a[3]), Lanes(b[0], b[1], b[2], b[3])
    row = 0
    for z in _sums(x, y, s):
        for k in range(4):
            out[row, k] = z[k]
        row += 1
    for z in _choices(x, y, s):
        for k in range(4):
            out[row, k] = z[k]
        row += 1
    places, sums = _orders(x, y, s), _of_all(x)
    for k in range(4):
        out[row, k] = places[k]
    for k in range(3):
        out[row + 1, k] = sums[k]


def interpreted(function, **others):
    """A kernel's Python function, with others for the kernels that it calls."""
    function = function.py_func
    return types.FunctionType(function.__code__, {**function.__globals__, **others})


PARTS = {name: interpreted(part) for name, part in [("_sums", _sums), ("_choices", _choices), ("_orders", _orders)]}
in_python = interpreted(compute, _of_all=interpreted(_of_all), **PARTS)


@given(FOUR, FOUR, st.floats(allow_subnormal=False))
@example(CORNERS[0], CORNERS[1], 0.0)
@example(CORNERS[1], CORNERS[3], NAN)
@example(CORNERS[2], CORNERS[2], -0.0)
def test_each_operation_means_what_python_says(a, b, s):
    """The same bits; of what is no number only that it is none."""
    found, meant = np.zeros((2, 15, 4))
    compute(np.array(a), np.array(b), s, found)
    with np.errstate(all="ignore"):
        in_python(np.array(a), np.array(b), s, meant)
    nothing = np.isnan(meant)
    assert np.array_equal(np.isnan(found), nothing)
    assert np.array_equal(np.signbit(found[~nothing]), np.signbit(meant[~nothing]))
    assert np.array_equal(found[~nothing], meant[~nothing])


def test_a_sum_is_taken_in_one_order():
    """(a + c) + (b + d): another order gives another last bit."""
    a = np.array([1.0, 1e-16, 1e-16, 0.0])
    out = np.zeros((15, 4))
    compute(a, a, 1.0, out)
    assert out[14, 0] == (a[0] + a[2]) + (a[1] + a[3]) != a[0] + (a[1] + (a[2] + a[3]))


@kernel
def compute_one(a, b, s, out):
    """Compute an expression that is valid for numbers as well."""
    out[0], out[1], out[2] = larger(a, b), smaller(a, b), select_lanes(a <= b, s, a)


@given(st.floats(), st.floats(), st.floats())
@example(NAN, 1.0, 2.0)
@example(1.0, NAN, 2.0)
@example(0.0, -0.0, 1.0)
def test_of_numbers_they_are_what_they_are_of_lanes(a, b, s):
    found, meant = np.zeros(3), np.zeros(3)
    compute_one(a, b, s, found)
    compute_one.py_func(a, b, s, meant)
    assert np.array_equal(found, meant, equal_nan=True)
    assert np.array_equal(np.signbit(found), np.signbit(meant)) or np.isnan(found).any()


@kernel
def copy_columns(table, first, last, out):
    """Columns of some contacts, doubled, to another table."""
    x = simd_gather.gather_column_from(table, 0, first, last)
    y = simd_gather.gather_column_from(table, 1, first, last)
    z = simd_gather.gather_column_from(table, 2, first, last)
    simd_gather.scatter_columns(out, first, last, 2.0 * x, 2.0 * y, 2.0 * z)


@pytest.mark.parametrize(("first", "last"), [(0, 0), (2, 2), (1, 2), (0, 2), (3, 5), (1, 4), (4, 7)])
def test_columns_of_some_contacts_are_read_and_written(first, last):
    """And of no others."""
    table, out, expected = np.arange(24.0).reshape(8, 3), np.full((8, 3), -1.0), np.full((8, 3), -1.0)
    copy_columns(table, first, last, out)
    expected[first : last + 1] = 2.0 * table[first : last + 1]
    assert np.array_equal(out, expected)


@kernel
def put(values, table, thirds, n, out):
    """Put n contacts into rows with `columns`: six rows of four."""
    for row, z in enumerate(
        (
            simd_gather.gather_numbers(values, n),
            simd_gather.gather_column(table, 1, n),
            simd_gather.gather_component(thirds, 2, n),
            simd_gather.valid_lanes_mask(n),
            select_lanes(simd_gather.select_lane(n - 1), 1.0, 0.0),
        )
    ):
        for k in range(4):
            out[row, k] = z[k]


@pytest.mark.parametrize("n", [1, 2, 3, 4])
def test_numbers_of_contacts_become_lanes(n):
    """The last contact stands where there is none, and is told apart by `present`."""
    values, table, thirds = np.arange(10.0, 10 + n), np.arange(2.0 * n).reshape(n, 2), np.arange(3.0 * n)
    out = np.zeros((5, 4))
    put(values, table, thirds, n, out)
    rows = np.minimum(range(4), n - 1)
    expected = [values[rows], table[rows, 1], thirds[3 * rows + 2], np.arange(4) < n, np.arange(4) == n - 1]
    assert np.array_equal(out, np.array(expected, float))
