"""Gather numbers of up to four contacts into lanes; surplus lanes repeat the last contact."""

from __future__ import annotations

from physics.compiler.decorators import inlined
from physics.compiler.simd import Lanes


@inlined
def broadcast(x):
    """One number four times."""
    return Lanes(x, x, x, x)


@inlined
def gather_numbers_from(values, first, last):
    """A number of each contact from `first` to `last`."""
    return Lanes(values[first], values[min(first + 1, last)], values[min(first + 2, last)], values[last])


@inlined
def gather_column_from(table, k, first, last):
    """Number k of each contact from `first` to `last`, a row of numbers each."""
    second, third = min(first + 1, last), min(first + 2, last)
    return Lanes(table[first, k], table[second, k], table[third, k], table[last, k])


@inlined
def scatter_columns(table, first, last, x, y, z):
    """Write three columns, as `gather_column_from` reads each of them."""
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
    """A number of each of the n contacts."""
    return gather_numbers_from(values, 0, n - 1)


@inlined
def gather_column(table, k, n):
    """Number k of each of the n contacts, a row of numbers each."""
    return gather_column_from(table, k, 0, n - 1)


@inlined
def gather_component(values, k, n):
    """Number k of each contact, three numbers each one after another."""
    return Lanes(values[k], values[3 * min(1, n - 1) + k], values[3 * min(2, n - 1) + k], values[3 * (n - 1) + k])


@inlined
def valid_lanes_mask(n):
    """1 for each lane with a contact of its own, 0 for surplus lanes."""
    return Lanes(1.0, 1.0 if n > 1 else 0.0, 1.0 if n > 2 else 0.0, 1.0 if n > 3 else 0.0)


@inlined
def select_lane(k):
    """Index of lane k."""
    return Lanes(0.0, 1.0, 2.0, 3.0) == k
