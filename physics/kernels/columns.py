"""Numbers of up to four contacts as lanes; where there are fewer, those of the last one stand in what is left."""

from __future__ import annotations

from physics.kernels.compiler import inlined
from physics.kernels.lanes import Lanes


@inlined
def numbers(values, n):
    """A number of each contact."""
    return Lanes(values[0], values[min(1, n - 1)], values[min(2, n - 1)], values[n - 1])


@inlined
def column(table, k, n):
    """Number k of each contact, a row of numbers each."""
    return Lanes(table[0, k], table[min(1, n - 1), k], table[min(2, n - 1), k], table[n - 1, k])


@inlined
def part(values, k, n):
    """Number k of each contact, three numbers each one after another."""
    return Lanes(values[k], values[3 * min(1, n - 1) + k], values[3 * min(2, n - 1) + k], values[3 * (n - 1) + k])


@inlined
def present(n):
    """1 for each contact that there is, 0 for what is left."""
    return Lanes(1.0, 1.0 if n > 1 else 0.0, 1.0 if n > 2 else 0.0, 1.0 if n > 3 else 0.0)


@inlined
def lane(k):
    """Where lane k is."""
    return Lanes(0.0, 1.0, 2.0, 3.0) == k
