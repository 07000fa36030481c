"""Lemke's complementary pivoting for the linear complementarity problem.

Given M and q, find z with

    w = M z + q,    w >= 0,    z >= 0,    z·w = 0.

An artificial variable z0 with a positive covering column makes w = M z + q + z0
feasible; pivoting along the almost complementary path drives z0 out again. The
path ends either in a solution or in a ray. If M is copositive-plus (positive
semidefinite matrices are), a ray proves that no w, z >= 0 satisfy w = M z + q;
for other matrices it only says that this path found nothing.

Three things differ from the textbook:

* The tableau is condensed: n + 1 nonbasic columns and the right-hand side, and
  not 2n + 2 columns. The columns of the basis inverse, which the lexicographic
  rule and the final refinement need, are those of the w's: stored where w_k is
  nonbasic, a unit vector where it is basic.
* Rows and columns are first scaled by powers of two so that the largest entry
  of each lies in [1/2, 1]. In the caller's units the covering column is then
  one over the row scales.
* The answer is refined against M and q and its natural residual is checked, so
  that `LCP_SOLVED` is a statement about the data and not about the tableau.

References
----------
.. [1] C. E. Lemke, *Bimatrix equilibrium points and mathematical programming*,
   Management Science 11, 1965, doi:10.1287/mnsc.11.7.681.
.. [2] R. W. Cottle, J.-S. Pang, R. E. Stone, *The Linear Complementarity
   Problem*, SIAM, 2009, sections 4.4 (Lemke) and 4.9 (degeneracy).
.. [3] K. G. Murty, *Linear Complementarity, Linear and Nonlinear Programming*,
   1988, chapter 2.
"""

from __future__ import annotations

import math

from physics.compiler.decorators import kernel
from physics.kernels.lcp.scaling_and_certificate import (
    LCP_BAD_DATA,
    LCP_PIVOT_LIMIT,
    LCP_RAY,
    LCP_SOLVED,
    are_finite,
    certify_solution,
    inverse_power_of_two,
)

# Dimensionless: entries of the scaled data are at most 1. Rounding is 2^-53.
PIVOT_TOLERANCE = 2.0**-36  # share of its column's largest entry; a smaller pivot counts as zero
_TIE_TOLERANCE = 2.0**-36  # share of its column's largest entry; closer rows of the ratio test count as tied
REFINEMENTS = 2  # steps of iterative refinement of the solution


def lemke_sizes(n: int) -> tuple[tuple[int, int], int]:
    """Shape of the array `tableau` (float64) and length of `basis` (int64) of `lemke` for a problem of size n."""
    return (n + 3, n + 2), 5 * n + 2


@kernel
def equilibrate(M, q, row_scale, column_scale):
    """Compute powers of two that scale the rows, then the columns of M, to a largest entry in [1/2, 1].

    They are written to `row_scale` and `column_scale`. Returns the power of two that does the same for the row-scaled
    q.
    """
    n = q.shape[0]
    largest_q = 0.0
    for i in range(n):
        largest = 0.0
        for j in range(n):
            largest = max(largest, abs(M[i, j]))
        row_scale[i] = inverse_power_of_two(largest)
        largest_q = max(largest_q, abs(q[i]) * row_scale[i])
    for j in range(n):
        largest = 0.0
        for i in range(n):
            largest = max(largest, abs(M[i, j]) * row_scale[i])
        column_scale[j] = inverse_power_of_two(largest)
    return inverse_power_of_two(largest_q)


@kernel
def fill_tableau(M, q, tableau, basis):
    """Fill `tableau` and `basis` for the start: w basic, z and z0 nonbasic, rows w - M z - z0 = q, all scaled.

    Returns the factor by which q was scaled.
    """
    n = q.shape[0]
    row_scale, column_scale = tableau[n], tableau[n + 1]
    q_scale = equilibrate(M, q, row_scale, column_scale)
    for i in range(n):
        for j in range(n):
            tableau[i, j] = -(M[i, j] * row_scale[i] * column_scale[j])
        tableau[i, n] = -1.0
        tableau[i, n + 1] = q[i] * row_scale[i] * q_scale
        basis[i] = i
        basis[n + i] = n + i
        basis[2 * n + 1 + i] = i
        basis[3 * n + 1 + i] = -1 - i
    basis[2 * n] = 2 * n
    basis[4 * n + 1] = -1 - n
    return q_scale


@kernel
def pivot_tableau(tableau, basis, n, r, c):
    """Make a pivot in `tableau`: exchange the basic variable of row r and the nonbasic variable of column c."""
    pivot = tableau[r, c]
    for j in range(n + 2):
        tableau[r, j] /= pivot
    tableau[r, c] = 1.0 / pivot
    for i in range(n):
        factor = tableau[i, c]
        if i != r and factor != 0.0:
            tableau[i, c] = 0.0
            for j in range(n + 2):
                tableau[i, j] -= factor * tableau[r, j]
    leaving, entering = basis[r], basis[n + c]
    basis[r], basis[n + c] = entering, leaving
    basis[2 * n + 1 + entering] = r
    basis[2 * n + 1 + leaving] = -1 - c


@kernel
def inverse_entry(tableau, basis, n, i, k):
    """Entry (i, k) of the basis inverse, read from the column of w_k in `tableau`."""
    place = basis[2 * n + 1 + k]
    if place < 0:
        return tableau[i, -1 - place]
    if place == i:
        return 1.0
    return 0.0


@kernel
def filter_tied_rows(tableau, basis, n, c, k, count):
    """Filter the first `count` tied rows by the ratio test for column c: keep those with the least ratio.

    The numerator of the ratio is the entry in column k of the basis inverse, or in the right-hand side if k = -1.
    Returns the number of rows that are kept, which are first in the list of tied rows in `basis`.
    """
    tied = basis[4 * n + 2 :]
    largest = 0.0
    least = math.inf
    for i in range(n):
        value = tableau[i, n + 1] if k < 0 else inverse_entry(tableau, basis, n, i, k)
        largest = max(largest, abs(value))
    for t in range(count):
        i = tied[t]
        value = tableau[i, n + 1] if k < 0 else inverse_entry(tableau, basis, n, i, k)
        least = min(least, value / tableau[i, c])
    kept = 0
    for t in range(count):
        i = tied[t]
        value = tableau[i, n + 1] if k < 0 else inverse_entry(tableau, basis, n, i, k)
        if value <= least * tableau[i, c] + _TIE_TOLERANCE * largest:
            tied[kept] = i
            kept += 1
    return kept


@kernel
def find_leaving_row(tableau, basis, n, c):
    """Find the row whose variable leaves the basis, by the lexicographic ratio test in column c; -1 for a ray.

    If z0 is in one of the rows that are tied, it leaves, since this ends the path.
    """
    tied = basis[4 * n + 2 :]
    largest = 0.0
    for i in range(n):
        largest = max(largest, abs(tableau[i, c]))
    count = 0
    for i in range(n):
        if tableau[i, c] > PIVOT_TOLERANCE * largest:
            tied[count] = i
            count += 1
    if count == 0:
        return -1
    count = filter_tied_rows(tableau, basis, n, c, -1, count)
    for t in range(count):
        if basis[tied[t]] == 2 * n:
            return tied[t]
    for k in range(n):
        if count == 1:
            break
        count = filter_tied_rows(tableau, basis, n, c, k, count)
    return tied[0]


@kernel
def find_first_row(tableau, n):
    """Find the row in which z0 enters the basis: that with the least q; of tied rows the last.

    The last one is lexicographically least.
    """
    r = 0
    for i in range(1, n):
        if tableau[i, n + 1] <= tableau[r, n + 1]:
            r = i
    return r


@kernel
def refine_solution(M, q, z, tableau, basis, q_scale):
    """Improve the basic solution in `tableau` by two steps of iterative refinement; write it to z, in scaled units."""
    n = q.shape[0]
    row_scale, column_scale, defect = tableau[n], tableau[n + 1], tableau[n + 2]
    for sweep in range(REFINEMENTS + 1):
        for j in range(n):
            place = basis[3 * n + 1 + j]
            z[j] = tableau[place, n + 1] if place >= 0 else 0.0
        if sweep == REFINEMENTS:
            return
        for i in range(n):
            total = q[i] * row_scale[i] * q_scale
            for j in range(n):
                total += M[i, j] * row_scale[i] * column_scale[j] * z[j]
            place = basis[2 * n + 1 + i]
            defect[i] = total - (tableau[place, n + 1] if place >= 0 else 0.0)
        for i in range(n):
            for k in range(n):
                tableau[i, n + 1] += inverse_entry(tableau, basis, n, i, k) * defect[k]


@kernel
def follow_lemke_path(tableau, basis, n, max_pivots):
    """Pivot along Lemke's path until z0 has left the basis, at most `max_pivots` times: (status, pivots)."""
    r = find_first_row(tableau, n)
    if max_pivots < 1:
        return LCP_PIVOT_LIMIT, 0
    leaving = basis[r]
    pivot_tableau(tableau, basis, n, r, n)
    pivots = 1
    while leaving != 2 * n:
        entering = leaving + n if leaving < n else leaving - n
        c = -1 - basis[2 * n + 1 + entering]
        r = find_leaving_row(tableau, basis, n, c)
        if r < 0:
            return LCP_RAY, pivots
        if pivots >= max_pivots:
            return LCP_PIVOT_LIMIT, pivots
        leaving = basis[r]
        pivot_tableau(tableau, basis, n, r, c)
        pivots += 1
    return LCP_SOLVED, pivots


@kernel
def lemke(M, q, z, tableau, basis, max_pivots):
    """Solve w = M z + q, w >= 0, z >= 0, z·w = 0 by Lemke's method.

    Parameters
    ----------
    M : (n or more, n or more) float64
        Any square matrix; only the leading n x n block is read.
    q : (n,) float64
        Its length is the size of the problem.
    z : (n,) float64, out
        The solution if the status is `LCP_SOLVED`; the best found if it is
        `INACCURATE`; zeros otherwise.
    tableau : (n + 3, n + 2) float64, scratch
        Tableau, then one row each of row scales, column scales and defects.
    basis : (5 n + 2,) int64, scratch
        Variable of each row (n), variable of each column (n + 1), place of
        each variable (2 n + 1: row, or -1 - column), tied rows (n). Variables
        are numbered w_0 .. w_{n-1}, z_0 .. z_{n-1}, z0.
    max_pivots : int
        Largest number of pivots. A few n suffice in practice; the worst case is 2^n.

    Returns
    -------
    status : int
        0 solved, 1 ray, 2 pivot limit, 3 data not finite, 4 solved but inaccurate.
    pivots : int
        Pivots made; 0 if q >= 0, where z = 0 is the solution.

    Notes
    -----
    O(n²) per pivot. Nothing is allocated. Multiplying M, or q, by a power of two
    gives exactly the scaled z.

    Sources: see the module.
    """
    n = q.shape[0]
    z[:n] = 0.0
    if not are_finite(M, q):
        return LCP_BAD_DATA, 0
    least = 0.0
    for i in range(n):
        least = min(least, q[i])
    if least >= 0.0:
        return LCP_SOLVED, 0
    q_scale = fill_tableau(M, q, tableau, basis)
    status, pivots = follow_lemke_path(tableau, basis, n, max_pivots)
    if status != LCP_SOLVED:
        return status, pivots
    refine_solution(M, q, z, tableau, basis, q_scale)
    for j in range(n):
        z[j] = max(z[j], 0.0)
    status = certify_solution(M, q, z, tableau[n], tableau[n + 1], q_scale)
    for j in range(n):
        z[j] *= tableau[n + 1, j] / q_scale
    return status, pivots
