"""Vectors as tuples of three numbers: sums, multiples, and reads from arrays."""

from __future__ import annotations

from physics.compiler.decorators import inlined


@inlined
def as_vector(a):
    """Tuple of the first three numbers of an array or a tuple."""
    return (a[0], a[1], a[2])


@inlined
def row_vector(rows, i, first):
    """Tuple of three numbers of row i of an array (n, m): columns `first` to `first` + 2."""
    return (rows[i, first], rows[i, first + 1], rows[i, first + 2])


@inlined
def plus(a, b):
    """Sum a + b of two vectors."""
    return (a[0] + b[0], a[1] + b[1], a[2] + b[2])


@inlined
def minus(a, b):
    """Difference a - b of two vectors."""
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])


@inlined
def times(s, a):
    """Product s a of a number s and a vector a."""
    return (s * a[0], s * a[1], s * a[2])
