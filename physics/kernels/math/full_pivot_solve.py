"""A small dense system that may be singular: Gauss's elimination with full pivoting, and solutions of least norm."""

from __future__ import annotations

import math

from physics.compiler.decorators import kernel

# A pivot below this share of the largest one is none: the rows left then say the same twice.
PIVOT_SHARE = 1.0e-10


@kernel
def solve_full_pivot(m, A, order, x):
    """Solve the m equations A[:, :m] x = A[:, m], A is overwritten; unknowns without a pivot are 0.

    Parameters
    ----------
    m : int
    A : (>= m, >= m + 1) float64, overwritten
        Right-hand side in column m.
    order : (>= m,) int64, out
        Column of each pivot.
    x : (>= m,) float64, out

    Returns
    -------
    rank : int
    least : float
        The least pivot, one that was none included, as a share of the largest.
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
    """Solution x of least norm of A[:rows, :m] x = A[:rows, m]; A is overwritten, dependent rows are left out.

    Rows are made orthonormal one after the other (modified Gram-Schmidt). So x, a sum of rows, is smooth in A while the
    rank stays the same. In an elimination rounding would choose the zero unknowns where pivots are equal.

    Parameters
    ----------
    rows, m : int
    A : (>= rows, >= m + 1) float64, overwritten
        Right-hand side in column m.
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
