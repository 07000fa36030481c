"""Solve small dense linear systems that may be singular: Gauss's elimination with full pivoting, and least norms."""

from __future__ import annotations

import math

from physics.compiler.decorators import kernel

# A pivot below this share of the largest one counts as zero: the rows left then depend linearly on those before.
PIVOT_SHARE = 1.0e-10


@kernel
def solve_full_pivot(m, A, order, x):
    """Solve m equations A x = b for x, by Gauss's elimination with full pivoting; A may be singular.

    An unknown whose column has no pivot is 0. Elimination stops at the first pivot below `PIVOT_SHARE` of the largest.

    Parameters
    ----------
    m : int
        Number of equations and of unknowns.
    A : (>= m, >= m + 1) float64, overwritten
        Matrix in columns 0 to m - 1, right-hand side b in column m.
    order : (>= m,) int64, out
        Column of each pivot, in the order of elimination.
    x : (>= m,) float64, out

    Returns
    -------
    rank : int
        Number of pivots.
    least : float
        Size of the last candidate for a pivot, relative to the largest one; below `PIVOT_SHARE` if A is singular.
    """
    for k in range(m):
        order[k] = k
        x[k] = 0.0
    largest, least, rank = 0.0, 1.0, 0
    for k in range(m):
        best, p, c = 0.0, k, k
        for i in range(k, m):
            for j in range(k, m):
                size = abs(A[i, j])
                if size > best:
                    best, p, c = size, i, j
        largest = max(largest, best)
        least = best / largest if largest > 0.0 else 0.0
        if not best > PIVOT_SHARE * largest:
            break
        rank += 1
        for j in range(m + 1):
            A[k, j], A[p, j] = A[p, j], A[k, j]
        for i in range(m):
            A[i, k], A[i, c] = A[i, c], A[i, k]
        order[k], order[c] = order[c], order[k]
        s = 1.0 / A[k, k]
        for i in range(k + 1, m):
            factor = A[i, k] * s
            if factor != 0.0:
                for j in range(k + 1, m + 1):
                    A[i, j] -= factor * A[k, j]
    for k in range(rank - 1, -1, -1):
        total = A[k, m]
        for j in range(k + 1, rank):
            total -= A[k, j] * x[order[j]]
        x[order[k]] = total / A[k, k]
    return rank, least


@kernel
def solve_least_norm(rows, m, A, x):
    """Solve `rows` equations A x = b in m unknowns for the solution x of least norm; dependent rows are left out.

    Rows are made orthonormal one after the other (modified Gram-Schmidt). So x, a weighted sum of these rows, is smooth
    in A while the rank stays the same. Elimination is not: where pivots are equal, rounding chooses the unknowns that
    become zero.

    Parameters
    ----------
    rows, m : int
    A : (>= rows, >= m + 1) float64, overwritten
        Matrix in columns 0 to m - 1, right-hand side b in column m.
    x : (>= m,) float64, out
    """
    largest = 0.0
    for k in range(m):
        x[k] = 0.0
    for i in range(rows):
        for j in range(i):
            share = 0.0
            for k in range(m):
                share += A[i, k] * A[j, k]
            for k in range(m + 1):
                A[i, k] -= share * A[j, k]
        size = 0.0
        for k in range(m):
            size += A[i, k] * A[i, k]
        size = math.sqrt(size)
        largest = max(largest, size)
        s = 1.0 / size if size > PIVOT_SHARE * largest else 0.0
        for k in range(m + 1):
            A[i, k] *= s
        for k in range(m):
            x[k] += A[i, m] * A[i, k]
