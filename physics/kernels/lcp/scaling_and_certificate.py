"""Statuses, exact scaling and final check, shared by the solvers of linear complementarity problems.

Every solver scales its problem by powers of two first. This is exact in floating
point, makes tolerances dimensionless, and allows units of any size.
"""

from __future__ import annotations

import math

from physics.compiler.decorators import kernel

# Statuses, the same for every pivoting solver.
LCP_SOLVED = 0
LCP_RAY = 1  # the path ended without a solution
LCP_PIVOT_LIMIT = 2
LCP_BAD_DATA = 3  # data not finite, or not of the class that the solver needs
LCP_INACCURATE = 4  # the path ended in a solution, but rounding left too large a residual

RESIDUAL_TOLERANCE = 2.0**-30  # share of the largest sum of magnitudes in a row of M z + q


@kernel
def inverse_power_of_two(x):
    """Power of two that scales |x| to [1/2, 1): 2^-e for |x| = m 2^e; 1 for x = 0."""
    if x == 0.0:
        return 1.0
    return math.ldexp(1.0, -math.frexp(x)[1])


@kernel
def are_finite(M, q):
    """True if q (n,) and the leading n x n block of M hold neither NaN nor infinity."""
    n = q.shape[0]
    for i in range(n):
        if not math.isfinite(q[i]):
            return False
        for j in range(n):
            if not math.isfinite(M[i, j]):
                return False
    return True


@kernel
def certify_solution(M, q, z, row_scale, column_scale, q_scale):
    """Check a solution z of w = M z + q, w >= 0, z >= 0, z·w = 0: LCP_SOLVED or LCP_INACCURATE.

    It is solved if the natural residual max |min(z, w)| of the scaled problem is small. `row_scale`, `column_scale` and
    `q_scale` are the factors of rows, columns and q in the scaled problem; z is in its units.
    """
    n = q.shape[0]
    worst = 0.0
    largest = 0.0
    for i in range(n):
        w = q[i] * row_scale[i] * q_scale
        magnitude = abs(w)
        for j in range(n):
            term = M[i, j] * row_scale[i] * column_scale[j] * z[j]
            w += term
            magnitude += abs(term)
        worst = max(worst, abs(min(z[i], w)))
        largest = max(largest, magnitude)
    if worst <= RESIDUAL_TOLERANCE * largest:
        return LCP_SOLVED
    return LCP_INACCURATE
