"""Lanes (`physics.compiler.simd`) as they are compiled against what they mean in plain Python: the same bits."""

from __future__ import annotations

import numpy as np
import pytest

from physics.compiler.decorators import kernel
from physics.compiler.simd import lane_sqrt, lane_sum, lane_sums, load_lanes, store_lanes


@kernel
def rows(table, i, j, out):
    """Reads of four numbers from any place, sums of them, and writes."""
    x, y = load_lanes(table, i, j), load_lanes(table, i, j + 1)
    store_lanes(out, 0, 0, x * y)
    store_lanes(out, 0, 5, lane_sums(x, y, x * y, 2.0))
    store_lanes(out, 1, 1, lane_sqrt(x))
    store_lanes(out, 1, 7, 3.0)
    out[0, 9], out[0, 10], out[1, 0] = lane_sqrt(table[i, j]), lane_sum(x), lane_sqrt(-1.0)


@pytest.mark.parametrize("place", [(0, 0), (1, 3), (2, 4)])
def test_rows_of_a_table_are_read_and_written_as_numbers(place):
    table = np.random.default_rng(0).uniform(0.1, 1.0, (3, 9))
    compiled, plain = np.zeros((2, 11)), np.zeros((2, 11))
    rows(table, *place, compiled)
    getattr(rows, "py_func", rows)(table, *place, plain)
    np.testing.assert_array_equal(compiled, plain)
    i, j = place
    np.testing.assert_array_equal(plain[0, :4], table[i, j : j + 4] * table[i, j + 1 : j + 5])
