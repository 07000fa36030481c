"""Dantzig's method: principal pivoting for the complementarity problem of contacts without friction.

For a symmetric positive semidefinite M and any q find z with

    w = M z + q,    w >= 0,    z >= 0,    z·w = 0.

One index after the other with w_i < 0 is *driven*: z_i grows while every index
that is already in order stays so. The *clamped* indices keep w = 0 (their z
follows), the free ones keep z = 0 (their w follows). The first of these to reach
zero blocks and changes sides; the drive ends when w_i itself reaches zero.

Redundant contacts make M singular. In exact arithmetic a positive semidefinite
M still never lets a dependent index into the clamped set: a free index whose
row depends on the clamped ones does not move, hence does not block, and a driven
dependent index does not end its drive until some clamped one has left. So the
clamped block stays positive definite and has a Cholesky factor, which grows by
a row and is rebuilt from the place where an index leaves: no drift. If nothing
blocks such a drive, M z + q >= 0 has no solution with z >= 0: a body wedged
between walls that both move in.

z and w are computed afresh after every drive, so that errors do not add up. Ties
go to the least index, which keeps degenerate problems from cycling.

References
----------
.. [1] D. Baraff, *Fast contact force computation for nonpenetrating rigid
   bodies*, SIGGRAPH 1994, section 4, doi:10.1145/192161.192168.
.. [2] R. W. Cottle, J.-S. Pang, R. E. Stone, *The Linear Complementarity
   Problem*, SIAM, 2009, section 4.3 (symmetric principal pivoting).
.. [3] Y.-Y. Chang, *Least-index resolution of degeneracy in linear
   complementarity problems*, Stanford SOL 79-14, 1979.
"""

from __future__ import annotations

import math

from physics.compiler.decorators import kernel
from physics.kernels.lcp.active_set_cholesky import DEPENDENT_TOLERANCE, clamp_index, release_index, solve_clamped
from physics.kernels.lcp.scaling_and_certificate import (
    LCP_BAD_DATA,
    LCP_PIVOT_LIMIT,
    LCP_RAY,
    LCP_SOLVED,
    are_finite,
    certify_solution,
    inverse_power_of_two,
)

# Dimensionless: the scaled diagonal is in [1/4, 1), the scaled q at most 1. Rounding is 2^-53.
DIRECTION_TOLERANCE = 2.0**-44  # times the largest rate: a smaller rate counts as zero
_TIE_TOLERANCE = 2.0**-42  # times 1 + max z: a driven w above minus this has reached zero
SIGN_TOLERANCE = 2.0**-40  # times 1 + max z: a w above minus this counts as >= 0

# Rows of `floats` after the factor (n rows) and the scaled matrix (n rows): scales, right-hand side q, w, rates of z
# and w in the present drive, and scratch.
SCALE, RHS, W, RATE_Z, RATE_W, SCRATCH = range(6)


def dantzig_sizes(n: int) -> tuple[tuple[int, int], int]:
    """Shape of the array `floats` (float64) and length of `index` (int64) of `dantzig` for a problem of size n."""
    return (2 * n + 6, n), 2 * n


@kernel
def scale_problem(M, q, floats):
    """Scale M and q by powers of two, and write them into `floats`; return the factors of M and of q.

    The factor of M is 0 if a diagonal entry is negative.
    """
    n = q.shape[0]
    A, scale, rhs = floats[n : 2 * n], floats[2 * n + SCALE], floats[2 * n + RHS]
    largest = 0.0
    for i in range(n):
        if M[i, i] < 0.0:
            return 0.0, 1.0
        largest = max(largest, M[i, i])
    whole = inverse_power_of_two(largest)
    largest = 0.0
    for i in range(n):
        # the power of four that brings the diagonal entry into [1/4, 1), shared by its row and column
        exponent = math.frexp(M[i, i] * whole)[1]
        scale[i] = math.ldexp(1.0, -((exponent + 1) // 2))
        largest = max(largest, abs(q[i]) * scale[i])
    q_scale = inverse_power_of_two(largest)
    for i in range(n):
        rhs[i] = q[i] * scale[i] * q_scale
        for j in range(n):
            A[i, j] = M[i, j] * whole * scale[i] * scale[j]
    return whole, q_scale


@kernel
def find_rates(floats, index, n, count, i):
    """Compute the rates of z and w in the drive of index i: z_i grows at rate 1, and clamped w stay zero.

    They are written to the rows RATE_Z and RATE_W of `floats`. Returns (largest rate, whether i is independent of the
    clamped indices).
    """
    factor, A, clamped = floats[:n], floats[n : 2 * n], index[:n]
    rate_z, rate_w, x = floats[2 * n + RATE_Z], floats[2 * n + RATE_W], floats[2 * n + SCRATCH]
    for r in range(count):
        x[r] = -A[i, clamped[r]]
    solve_clamped(factor, count, x)
    largest = 1.0
    for k in range(n):
        rate_z[k] = 0.0
        rate_w[k] = A[k, i]
    for r in range(count):
        rate_z[clamped[r]] = x[r]
        largest = max(largest, abs(x[r]))
    for k in range(n):
        for r in range(count):
            rate_w[k] += A[k, clamped[r]] * x[r]
    return largest, rate_w[i] > DEPENDENT_TOLERANCE * A[i, i]


@kernel
def find_block(floats, index, z, n, i, largest, is_independent):
    """Find the index that blocks the drive of i, the growth of z_i until w_i = 0: (index, step of z_i).

    It is the first index whose z or w reaches zero.
    The index is -1 if nothing blocks. If w_i also reaches zero there, within rounding, i itself is returned, which ends
    the drive. Otherwise i would depend on the clamped indices, and rounding would decide the next pivot.
    """
    w, rate_z, rate_w = floats[2 * n + W], floats[2 * n + RATE_Z], floats[2 * n + RATE_W]
    threshold = DIRECTION_TOLERANCE * largest
    step = math.inf
    blocking = -1
    if is_independent:
        step = -w[i] / rate_w[i]
        blocking = i
    for k in range(n):
        if index[n + k] >= 0:
            value, rate = z[k], rate_z[k]
        else:
            value, rate = w[k], rate_w[k]
        # -2: found dependent in this drive. An index with a negative w is not in order yet, and does not block.
        if k == i or index[n + k] == -2 or rate >= -threshold or value < 0.0:
            continue
        if value < -step * rate:
            step = -value / rate
            blocking = k
    if is_independent and blocking != i:
        largest = step
        for k in range(n):
            largest = max(largest, z[k] + step * max(rate_z[k], 0.0))
        if w[i] + step * rate_w[i] >= -_TIE_TOLERANCE * (1.0 + largest):
            blocking = i
    return blocking, step


@kernel
def drive_to_zero(floats, index, z, n, count, i, budget):
    """Drive index i: increase z_i until w_i = 0, by at most `budget` pivots. Returns (status, pivots, clamped count).

    z and w of all indices and the clamped set are updated. `count` is the number of clamped indices before.
    """
    w, rate_z, rate_w = floats[2 * n + W], floats[2 * n + RATE_Z], floats[2 * n + RATE_W]
    for pivots in range(budget):
        largest, is_independent = find_rates(floats, index, n, count, i)
        blocking, step = find_block(floats, index, z, n, i, largest, is_independent)
        if blocking < 0:
            return LCP_RAY, pivots, count
        z[i] += step
        for k in range(n):
            # an index that is in order stays so: rounding must not carry its z or w below zero
            if index[n + k] >= 0:
                z[k] = max(z[k] + step * rate_z[k], 0.0)
            elif w[k] >= 0.0:
                w[k] = max(w[k] + step * rate_w[k], 0.0)
            else:
                w[k] += step * rate_w[k]
        if index[n + blocking] >= 0:
            z[blocking] = 0.0
            w[blocking] = 0.0
            count = release_index(floats, index, n, count, blocking)
            continue
        w[blocking] = 0.0
        if clamp_index(floats, index, n, count, blocking):
            count += 1
        else:
            index[n + blocking] = -2
        if blocking == i:
            return LCP_SOLVED, pivots + 1, count
    return LCP_PIVOT_LIMIT, budget, count


@kernel
def recompute(floats, index, z, n, count):
    """Compute z and w = M z + q anew from the clamped set, so that errors do not add up.

    z of the clamped indices is solved with the factor, and refined once; other z are 0.
    """
    factor, A, clamped = floats[:n], floats[n : 2 * n], index[:n]
    rhs, w, x = floats[2 * n + RHS], floats[2 * n + W], floats[2 * n + SCRATCH]
    for k in range(n):
        z[k] = 0.0
        w[k] = rhs[k]
        if index[n + k] == -2:
            index[n + k] = -1
    largest = 0.0
    for _ in range(2):
        for r in range(count):
            x[r] = -w[clamped[r]]
        solve_clamped(factor, count, x)
        for r in range(count):
            z[clamped[r]] += x[r]
        for k in range(n):
            w[k] = rhs[k]
            for r in range(count):
                w[k] += A[k, clamped[r]] * z[clamped[r]]
    for r in range(count):
        z[clamped[r]] = max(z[clamped[r]], 0.0)
        largest = max(largest, z[clamped[r]])
        w[clamped[r]] = 0.0
    for k in range(n):
        if index[n + k] < 0 and abs(w[k]) <= SIGN_TOLERANCE * (1.0 + largest):
            w[k] = 0.0


@kernel
def drive_all(floats, index, z, n, max_pivots):
    """Drive one index with w < 0 after the other, the first one each time, until none is left: (status, pivots)."""
    count = 0
    pivots = 0
    while True:
        recompute(floats, index, z, n, count)
        i = 0
        while i < n and not floats[2 * n + W, i] < 0.0:
            i += 1
        if i == n:
            return LCP_SOLVED, pivots
        status, done, count = drive_to_zero(floats, index, z, n, count, i, max_pivots - pivots)
        pivots += done
        if status != LCP_SOLVED:
            return status, pivots


@kernel
def dantzig(M, q, z, floats, index, max_pivots):
    """Solve w = M z + q, w >= 0, z >= 0, z·w = 0 for symmetric positive semidefinite M.

    Parameters
    ----------
    M : (n or more, n or more) float64
        Only the leading n x n block is read. Symmetry and semidefiniteness are
        taken on trust, except for the sign of the diagonal.
    q : (n,) float64
        Its length is the size of the problem.
    z : (n,) float64, out
        The solution if the status is `LCP_SOLVED`; the best found if it is
        `INACCURATE`; zeros otherwise. With dependent rows of M one of many
        solutions (w is the same for all): positive on independent rows only.
    floats : (2 n + 6, n) float64, scratch
        Cholesky factor, scaled matrix, six vectors.
    index : (2 n,) int64, scratch
        Clamped indices in the order of the factor, place of each index there or -1.
    max_pivots : int
        Largest number of changes of the clamped set.

    Returns
    -------
    status : int
        0 solved, 1 ray (no z >= 0 has M z + q >= 0), 2 pivot limit, 3 data not
        finite or a negative diagonal, 4 solved but inaccurate.
    pivots : int
        Changes of the clamped set made; 0 if q >= 0, where z = 0 is the solution.

    Notes
    -----
    O(n c + c³) per pivot with c clamped indices, at most the rank of M. Nothing
    is allocated. Scaling M, or q, by a power of two gives exactly the scaled z.
    """
    n = q.shape[0]
    z[:n] = 0.0
    if not are_finite(M, q):
        return LCP_BAD_DATA, 0
    whole, q_scale = scale_problem(M, q, floats)
    if whole == 0.0:
        return LCP_BAD_DATA, 0
    index[n : 2 * n] = -1
    status, pivots = drive_all(floats, index, z, n, max_pivots)
    if status != LCP_SOLVED:
        z[:n] = 0.0
        return status, pivots
    ones = floats[2 * n + SCRATCH]
    ones[:] = 1.0
    status = certify_solution(floats[n : 2 * n], floats[2 * n + RHS], z, ones, ones, 1.0)
    for j in range(n):
        z[j] *= floats[2 * n + SCALE, j] * (whole / q_scale)
    return status, pivots
