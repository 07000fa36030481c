"""Linear systems with one 6 x 6 block for every two bodies that touch: block LU in the order of `elimination`.

Body b has its block on the diagonal in `diagonal[b]`, and with each later neighbour c = column[k], start[b] <= k <
stop[b], the blocks `lower[k]` (row c, column b) and `upper[k]` (row b, column c). Elimination of b takes

    A_cd -= (A_cb A_bb⁻¹) A_bd

for all its later neighbours c and d, and leaves A_bb⁻¹ and A_cb A_bb⁻¹ in place of A_bb and A_cb.

Reference: A. George, J. W.-H. Liu, *Computer Solution of Large Sparse Positive Definite Systems*, 1981, chapter 5.
"""

from __future__ import annotations

from physics.kernels.compiler import inlined, kernel

SIZE = 6  # of a block: velocity and angular velocity of a body


@kernel
def clear(begin, end, many):
    """Set the system of the bodies `many.order[begin:end]` to zero."""
    for i in range(begin, end):
        b = many.order[i]
        for r in range(SIZE):
            for c in range(SIZE):
                many.diagonal[b, r, c] = 0.0
        for k in range(many.start[b], many.stop[b]):
            for r in range(SIZE):
                for c in range(SIZE):
                    many.lower[k, r, c] = many.upper[k, r, c] = 0.0


@inlined
def place_of(b, c, many):
    """Where the blocks of b and its later neighbour c are in `lower` and `upper`."""
    k = many.start[b]
    while many.column[k] != c:
        k += 1
    return k


@inlined
def six(A, k, r):
    """Row r of block A[k]."""
    return (A[k, r, 0], A[k, r, 1], A[k, r, 2], A[k, r, 3], A[k, r, 4], A[k, r, 5])


@inlined
def _along(a, B, k, c):
    """a times column c of block B[k]."""
    return (a[0] * B[k, 0, c] + a[1] * B[k, 1, c] + a[2] * B[k, 2, c]) + (
        a[3] * B[k, 3, c] + a[4] * B[k, 4, c] + a[5] * B[k, 5, c]
    )


@inlined
def _row_product(a, B, k):
    """a B[k]: all of it before anything is written, so that it can be made several numbers at a time."""
    return (
        _along(a, B, k, 0), _along(a, B, k, 1), _along(a, B, k, 2),
        _along(a, B, k, 3), _along(a, B, k, 4), _along(a, B, k, 5),
    )  # fmt: skip


@inlined
def _take_product(target, t, A, i, B, j):
    """target[t] -= A[i] B[j]."""
    for r in range(SIZE):
        x, y = _row_product(six(A, i, r), B, j), six(target, t, r)
        target[t, r, 0], target[t, r, 1], target[t, r, 2] = y[0] - x[0], y[1] - x[1], y[2] - x[2]
        target[t, r, 3], target[t, r, 4], target[t, r, 5] = y[3] - x[3], y[4] - x[4], y[5] - x[5]


@inlined
def _times(A, k, D, b):
    """A[k] = A[k] D[b]."""
    for r in range(SIZE):
        x = _row_product(six(A, k, r), D, b)
        A[k, r, 0], A[k, r, 1], A[k, r, 2], A[k, r, 3], A[k, r, 4], A[k, r, 5] = x


@kernel
def invert(A, b, swaps):
    """Invert block A[b] in place (Gauss and Jordan, with row exchanges)."""
    for p in range(SIZE):
        best = p
        for r in range(p + 1, SIZE):
            if abs(A[b, r, p]) > abs(A[b, best, p]):
                best = r
        swaps[p] = best
        if best != p:
            for c in range(SIZE):
                A[b, p, c], A[b, best, c] = A[b, best, c], A[b, p, c]
        s = 1.0 / A[b, p, p]
        A[b, p, p] = 1.0
        for c in range(SIZE):
            A[b, p, c] *= s
        for r in range(SIZE):
            if r != p:
                f = A[b, r, p]
                A[b, r, p] = 0.0
                for c in range(SIZE):
                    A[b, r, c] -= f * A[b, p, c]
    for p in range(SIZE - 1, -1, -1):
        if swaps[p] != p:
            for r in range(SIZE):
                A[b, r, p], A[b, r, swaps[p]] = A[b, r, swaps[p]], A[b, r, p]


@inlined
def _take_from(c, d, i, j, many):
    """A_cd -= A_cb A_bb⁻¹ A_bd for neighbours c = column[i] and d = column[j] of b."""
    lower, upper = many.lower, many.upper
    if c == d:
        _take_product(many.diagonal, c, lower, i, upper, j)
    elif many.rank[c] > many.rank[d]:
        _take_product(lower, place_of(d, c, many), lower, i, upper, j)
    else:
        _take_product(upper, place_of(c, d, many), lower, i, upper, j)


@kernel
def factor(begin, end, many):
    """Replace the system of the bodies `many.order[begin:end]` by its factors."""
    for place in range(begin, end):
        b = many.order[place]
        invert(many.diagonal, b, many.swaps)
        for i in range(many.start[b], many.stop[b]):
            _times(many.lower, i, many.diagonal, b)
        for i in range(many.start[b], many.stop[b]):
            for j in range(many.start[b], many.stop[b]):
                _take_from(many.column[i], many.column[j], i, j, many)


@inlined
def _row_dot(A, k, r, x, i):
    """Row r of block A[k] times x[i]."""
    return (A[k, r, 0] * x[i, 0] + A[k, r, 1] * x[i, 1] + A[k, r, 2] * x[i, 2]) + (
        A[k, r, 3] * x[i, 3] + A[k, r, 4] * x[i, 4] + A[k, r, 5] * x[i, 5]
    )


@inlined
def _image(A, k, x, i):
    """A[k] x[i]."""
    return (
        _row_dot(A, k, 0, x, i), _row_dot(A, k, 1, x, i), _row_dot(A, k, 2, x, i),
        _row_dot(A, k, 3, x, i), _row_dot(A, k, 4, x, i), _row_dot(A, k, 5, x, i),
    )  # fmt: skip


@inlined
def _take(x, i, A, k, j):
    """x[i] -= A[k] x[j]."""
    y = _image(A, k, x, j)
    for r in range(SIZE):
        x[i, r] -= y[r]


@kernel
def substitute(begin, end, x, many):
    """Overwrite the right sides x (a row of 6 for each body) with the solution of the factored system."""
    for i in range(begin, end):
        b = many.order[i]
        for k in range(many.start[b], many.stop[b]):
            _take(x, many.column[k], many.lower, k, b)
    for i in range(end - 1, begin - 1, -1):
        b = many.order[i]
        for k in range(many.start[b], many.stop[b]):
            _take(x, b, many.upper, k, many.column[k])
        x[b, 0], x[b, 1], x[b, 2], x[b, 3], x[b, 4], x[b, 5] = _image(many.diagonal, b, x, b)
