"""Gather numbers of up to four contacts into the four lanes of a SIMD register, one lane for each contact.

Where there are fewer than four contacts, the surplus lanes repeat the last one.
"""

from __future__ import annotations

from physics.compiler.decorators import inlined
from physics.compiler.simd import Lanes


@inlined
def broadcast(x):
    """Lanes with the number x in each of the four."""
    return Lanes(x, x, x, x)


@inlined
def gather_numbers_from(values, first, last):
    """Lanes with values[first] to values[last], at most four; surplus lanes repeat the last."""
    return Lanes(values[first], values[min(first + 1, last)], values[min(first + 2, last)], values[last])


@inlined
def gather_column_from(table, k, first, last):
    """Lanes with column k of the rows `first` to `last` of a table, at most four; surplus lanes repeat the last."""
    second, third = min(first + 1, last), min(first + 2, last)
    return Lanes(table[first, k], table[second, k], table[third, k], table[last, k])


@inlined
def scatter_columns(table, first, last, x, y, z):
    """Write the lanes x, y, z into columns 0, 1, 2 of the rows `first` to `last` of a table, at most four rows."""
    _put_row(table, first, x[0], y[0], z[0])
    if last > first:
        _put_row(table, first + 1, x[1], y[1], z[1])
    if last > first + 1:
        _put_row(table, first + 2, x[2], y[2], z[2])
    if last > first + 2:
        _put_row(table, first + 3, x[3], y[3], z[3])


@inlined
def _put_row(table, i, x, y, z):
    table[i, 0], table[i, 1], table[i, 2] = x, y, z


@inlined
def gather_numbers(values, n):
    """Lanes with the first n of `values`, 1 <= n <= 4; surplus lanes repeat the last."""
    return gather_numbers_from(values, 0, n - 1)


@inlined
def gather_column(table, k, n):
    """Lanes with column k of the first n rows of a table, 1 <= n <= 4; surplus lanes repeat the last."""
    return gather_column_from(table, k, 0, n - 1)


@inlined
def gather_component(values, k, n):
    """Lanes with component k of the first n contacts; `values` is flat, with three numbers for each contact."""
    return Lanes(values[k], values[3 * min(1, n - 1) + k], values[3 * min(2, n - 1) + k], values[3 * (n - 1) + k])


@inlined
def valid_lanes_mask(n):
    """Lanes with 1 in the first n, which have a contact, and 0 in the surplus lanes; 1 <= n <= 4."""
    return Lanes(1.0, 1.0 if n > 1 else 0.0, 1.0 if n > 2 else 0.0, 1.0 if n > 3 else 0.0)


@inlined
def select_lane(k):
    """Mask of lanes that is true in lane k only."""
    return Lanes(0.0, 1.0, 2.0, 3.0) == k
