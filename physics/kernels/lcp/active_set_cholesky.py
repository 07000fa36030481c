"""Cholesky factor of the clamped rows and columns of a matrix, updated as indices are added and removed.

Clamped indices are those of contacts that push in Dantzig's method (`dantzig`). `floats` holds the factor in its first
n rows and the matrix, with a diagonal scaled to [1/4, 1), in the next n. `index` holds the clamped indices in the order
of the factor, then for every index its place there, negative if it is not clamped. An index is added by a new row of
the factor. When an index is removed, the rows behind it are computed anew from the matrix, so that errors do not
accumulate.
"""

from __future__ import annotations

import math

from physics.compiler.decorators import kernel

# An index is dependent on the clamped ones if its Schur complement is at most this share of its diagonal entry.
DEPENDENT_TOLERANCE = 2.0**-40


@kernel
def clamp_index(floats, index, n, count, k):
    """Append index k to the `count` clamped indices, and its row to the Cholesky factor; n is the size of the problem.

    Returns False if k depends linearly on the clamped indices; then it is not added.
    """
    factor, A, clamped = floats[:n], floats[n : 2 * n], index[:n]
    schur = A[k, k]
    for r in range(count):
        entry = A[k, clamped[r]]
        for t in range(r):
            entry -= factor[count, t] * factor[r, t]
        entry /= factor[r, r]
        factor[count, r] = entry
        schur -= entry * entry
    if not schur > DEPENDENT_TOLERANCE * A[k, k]:
        return False
    factor[count, count] = math.sqrt(schur)
    clamped[count] = k
    index[n + k] = count
    return True


@kernel
def release_index(floats, index, n, count, k):
    """Remove index k from the `count` clamped ones, and rebuild the factor behind it; return the new count."""
    clamped = index[:n]
    place = index[n + k]
    index[n + k] = -1
    kept = place
    for r in range(place + 1, count):
        j = clamped[r]
        index[n + j] = -1
        if clamp_index(floats, index, n, kept, j):
            kept += 1
    return kept


@kernel
def solve_clamped(factor, count, x):
    """Solve L Lᵀ y = x with the first `count` rows of a Cholesky factor L; y overwrites x."""
    for r in range(count):
        for t in range(r):
            x[r] -= factor[r, t] * x[t]
        x[r] /= factor[r, r]
    for r in range(count - 1, -1, -1):
        for t in range(r + 1, count):
            x[r] -= factor[t, r] * x[t]
        x[r] /= factor[r, r]
