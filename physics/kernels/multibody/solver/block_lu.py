"""Linear systems with one 6 x 6 block for every touching pair: block LU in the order of `minimum_degree`.

Body b has its diagonal block in `diagonal[b]`. For each neighbour c = column[k] that is eliminated after b, with
start[b] <= k < stop[b], there are the blocks `lower[k]` (row c, column b) and `upper[k]` (row b, column c). The
elimination of b computes

    A_cd -= (A_cb A_bb⁻¹) A_bd

for all its later neighbours c and d, and leaves A_bb⁻¹ and A_cb A_bb⁻¹ in place of A_bb and A_cb.

A block is a row of 48 numbers: six columns of eight. A column has three numbers of a velocity and an unused one, then
three of an angular velocity and an unused one. So a column is two `Lanes`, called its halves, and a block times a
column is a sum of six columns, each times a number.

Reference: A. George, J. W.-H. Liu, *Computer Solution of Large Sparse Positive Definite Systems*, 1981, chapter 5.
"""

from __future__ import annotations

from physics.compiler.decorators import inlined, kernel
from physics.compiler.simd import Lanes, larger, load_lanes, max_of_lanes, select_lanes, store_lanes
from physics.kernels.multibody.data.arrays import BLOCK_SIZE, COLUMN_SIZE

# Rows and columns of a block: velocity and angular velocity of a body.
TWIST_DOFS = 6

# Position in a column at which the angular velocity begins.
ANGULAR_OFFSET = 4

# A pivot on the diagonal is accepted if no number below it is larger by more than this factor (threshold pivoting). A
# check afterwards is cheaper than a search for the largest pivot, which makes each step wait for the last one. With a
# factor of 8, six heaps left 8 % more solves unconverged; with 1, 5 % fewer, which may be chance. Neither changes the
# time.
PIVOT_FACTOR = 2.0


@kernel
def clear_system(begin, end, many):
    """Set the linear system of the bodies `many.islands.bodies[begin:end]` to zero."""
    for i in range(begin, end):
        b = many.islands.bodies[i]
        for c in range(BLOCK_SIZE):
            many.system.diagonal[b, c] = 0.0
        for k in range(many.system.start[b], many.system.stop[b]):
            for c in range(BLOCK_SIZE):
                many.system.lower[k, c] = many.system.upper[k, c] = 0.0


@inlined
def find_block_index(b, c, many):
    """Index in `lower` and `upper` of the blocks of body b and its later neighbour c."""
    k = many.system.start[b]
    while many.system.column[k] != c:
        k += 1
    return k


@inlined
def block_columns(A, k):
    """Columns of block A[k], as twelve halves: first and second half of the first column, of the second, and so on."""
    return (
        load_lanes(A, k, 0), load_lanes(A, k, 4), load_lanes(A, k, 8), load_lanes(A, k, 12),
        load_lanes(A, k, 16), load_lanes(A, k, 20), load_lanes(A, k, 24), load_lanes(A, k, 28),
        load_lanes(A, k, 32), load_lanes(A, k, 36), load_lanes(A, k, 40), load_lanes(A, k, 44),
    )  # fmt: skip


@inlined
def _multiply_column(X, B, j, c):
    """Product of a block and a column, as two halves.

    X has the block's columns from `block_columns`. The column's six numbers are in row j of B, from column c on.
    """
    x, y, z, u, v, w = B[j, c], B[j, c + 1], B[j, c + 2], B[j, c + 4], B[j, c + 5], B[j, c + 6]
    return (
        (x * X[0] + y * X[2] + z * X[4]) + (u * X[6] + v * X[8] + w * X[10]),
        (x * X[1] + y * X[3] + z * X[5]) + (u * X[7] + v * X[9] + w * X[11]),
    )


@inlined
def _subtract_product(target, t, A, i, B, j):
    """Subtract a product of blocks: target[t] -= A[i] B[j]."""
    X = block_columns(A, i)
    for c in range(0, BLOCK_SIZE, COLUMN_SIZE):
        y = _multiply_column(X, B, j, c)
        store_lanes(target, t, c, load_lanes(target, t, c) - y[0])
        store_lanes(target, t, c + ANGULAR_OFFSET, load_lanes(target, t, c + ANGULAR_OFFSET) - y[1])


@inlined
def _multiply_in_place(A, k, D, b):
    """Multiply a block from the right: A[k] = A[k] D[b]."""
    X = block_columns(A, k)
    for c in range(0, BLOCK_SIZE, COLUMN_SIZE):
        y = _multiply_column(X, D, b, c)
        store_lanes(A, k, c, y[0])
        store_lanes(A, k, c + ANGULAR_OFFSET, y[1])


@inlined
def _lane_index(k):
    """Mask of four truth values: True for lane k only."""
    return Lanes(0.0, 1.0, 2.0, 3.0) == k


@inlined
def _lanes_after(k):
    """Mask of four truth values: True for the lanes after lane k."""
    return Lanes(0.0, 1.0, 2.0, 3.0) > k


@inlined
def _component(x, p):
    """Number p (0 to 5) of a column x that is given as two halves."""
    return x[0][p] if p < 3 else x[1][p - 3]


@inlined
def _with_component(x, p, value):
    """Column x, given as two halves, with its number p (0 to 5) replaced by `value`."""
    if p < 3:
        return select_lanes(_lane_index(p), value, x[0]), x[1]
    return x[0], select_lanes(_lane_index(p - 3), value, x[1])


@inlined
def _max_below_pivot(x, p):
    """Largest absolute value of the numbers after number p (0 to 5) of a column x, given as two halves."""
    if p < 3:
        return max_of_lanes(larger(select_lanes(_lanes_after(p), abs(x[0]), 0.0), abs(x[1])))
    return max_of_lanes(select_lanes(_lanes_after(p - 3), abs(x[1]), 0.0))


@inlined
def _eliminate_column(y, p, s, x):
    """Column y after a Gauss-Jordan step: row p is scaled by s, and its multiples are subtracted from the other rows.

    x is the column with the pivot.
    """
    t = s * _component(y, p)
    return _with_component((y[0] - t * x[0], y[1] - t * x[1]), p, t)


@inlined
def _gauss_jordan_step(p, least, x, a, b, c, d, e):
    """Do one step of a Gauss-Jordan inversion with the pivot in row p of column x: (least, a, b, c, d, e, x).

    a to e are the other five columns of the block. `least` is the smallest margin so far by which a pivot was larger
    than necessary; negative if one was too small.
    """
    value = _component(x, p)
    s = 1.0 / value
    least = min(least, PIVOT_FACTOR * abs(value) - _max_below_pivot(x, p))
    y = _with_component((-s * x[0], -s * x[1]), p, s)
    return (
        least,
        _eliminate_column(a, p, s, x),
        _eliminate_column(b, p, s, x),
        _eliminate_column(c, p, s, x),
        _eliminate_column(d, p, s, x),
        _eliminate_column(e, p, s, x),
        y,
    )


@inlined
def _invert_unpivoted(A, k):
    """Invert block A[k] in place with pivots on the diagonal; return False, and change nothing, if one is too small."""
    X = block_columns(A, k)
    a, b, c, d, e, f = (X[0], X[1]), (X[2], X[3]), (X[4], X[5]), (X[6], X[7]), (X[8], X[9]), (X[10], X[11])
    least, b, c, d, e, f, a = _gauss_jordan_step(0, 1.0e300, a, b, c, d, e, f)
    least, c, d, e, f, a, b = _gauss_jordan_step(1, least, b, c, d, e, f, a)
    least, d, e, f, a, b, c = _gauss_jordan_step(2, least, c, d, e, f, a, b)
    least, e, f, a, b, c, d = _gauss_jordan_step(3, least, d, e, f, a, b, c)
    least, f, a, b, c, d, e = _gauss_jordan_step(4, least, e, f, a, b, c, d)
    least, a, b, c, d, e, f = _gauss_jordan_step(5, least, f, a, b, c, d, e)
    if not least >= 0.0:
        return False
    store_lanes(A, k, 0, a[0])
    store_lanes(A, k, 4, a[1])
    store_lanes(A, k, 8, b[0])
    store_lanes(A, k, 12, b[1])
    store_lanes(A, k, 16, c[0])
    store_lanes(A, k, 20, c[1])
    store_lanes(A, k, 24, d[0])
    store_lanes(A, k, 28, d[1])
    store_lanes(A, k, 32, e[0])
    store_lanes(A, k, 36, e[1])
    store_lanes(A, k, 40, f[0])
    store_lanes(A, k, 44, f[1])
    return True


@inlined
def _entry_index(r, c):
    """Index of the entry in row r and column c of a block, in the block's 48 numbers."""
    return COLUMN_SIZE * c + r + r // 3


@kernel
def _invert_pivoted(A, b, swaps):
    """Invert block A[b] in place by Gauss-Jordan elimination with row exchanges; `swaps` (6,) is scratch for these."""
    for p in range(TWIST_DOFS):
        best = p
        for r in range(p + 1, TWIST_DOFS):
            if abs(A[b, _entry_index(r, p)]) > abs(A[b, _entry_index(best, p)]):
                best = r
        swaps[p] = best
        for c in range(TWIST_DOFS):
            i, j = _entry_index(p, c), _entry_index(best, c)
            A[b, i], A[b, j] = A[b, j], A[b, i]
        s = 1.0 / A[b, _entry_index(p, p)]
        A[b, _entry_index(p, p)] = 1.0
        for c in range(TWIST_DOFS):
            A[b, _entry_index(p, c)] *= s
        for r in range(TWIST_DOFS):
            if r != p:
                f = A[b, _entry_index(r, p)]
                A[b, _entry_index(r, p)] = 0.0
                for c in range(TWIST_DOFS):
                    A[b, _entry_index(r, c)] -= f * A[b, _entry_index(p, c)]
    for p in range(TWIST_DOFS - 1, -1, -1):
        for r in range(TWIST_DOFS):
            i, j = _entry_index(r, p), _entry_index(r, swaps[p])
            A[b, i], A[b, j] = A[b, j], A[b, i]


@kernel
def invert_block(A, b, swaps):
    """Invert block A[b] in place, with row exchanges only if a pivot on the diagonal is too small.

    `swaps` (6,) is scratch.
    """
    if not _invert_unpivoted(A, b):
        _invert_pivoted(A, b, swaps)


@inlined
def _update_schur_complement(c, d, i, j, many):
    """Do A_cd -= A_cb A_bb⁻¹ A_bd for neighbours c = column[i] and d = column[j] of an eliminated body b."""
    lower, upper = many.system.lower, many.system.upper
    if c == d:
        _subtract_product(many.system.diagonal, c, lower, i, upper, j)
    elif many.system.rank[c] > many.system.rank[d]:
        _subtract_product(lower, find_block_index(d, c, many), lower, i, upper, j)
    else:
        _subtract_product(upper, find_block_index(c, d, many), lower, i, upper, j)


@kernel
def factor_system(begin, end, many):
    """Replace the linear system of the bodies `many.islands.bodies[begin:end]` by its LU factors."""
    for place in range(begin, end):
        b = many.islands.bodies[place]
        invert_block(many.system.diagonal, b, many.system.swaps)
        for i in range(many.system.start[b], many.system.stop[b]):
            _multiply_in_place(many.system.lower, i, many.system.diagonal, b)
        for i in range(many.system.start[b], many.system.stop[b]):
            for j in range(many.system.start[b], many.system.stop[b]):
                _update_schur_complement(many.system.column[i], many.system.column[j], i, j, many)


@inlined
def _subtract_block_product(x, i, A, k, j):
    """Subtract the product of a block and a column: x[i] -= A[k] x[j]."""
    y = _multiply_column(block_columns(A, k), x, j, 0)
    store_lanes(x, i, 0, load_lanes(x, i, 0) - y[0])
    store_lanes(x, i, ANGULAR_OFFSET, load_lanes(x, i, ANGULAR_OFFSET) - y[1])


@kernel
def solve_factored(begin, end, x, many):
    """Overwrite the right side x, a column for each body, with the solution of the factored system.

    The bodies are `many.islands.bodies[begin:end]`.
    """
    for i in range(begin, end):
        b = many.islands.bodies[i]
        for k in range(many.system.start[b], many.system.stop[b]):
            _subtract_block_product(x, many.system.column[k], many.system.lower, k, b)
    for i in range(end - 1, begin - 1, -1):
        b = many.islands.bodies[i]
        for k in range(many.system.start[b], many.system.stop[b]):
            _subtract_block_product(x, b, many.system.upper, k, many.system.column[k])
        y = _multiply_column(block_columns(many.system.diagonal, b), x, b, 0)
        store_lanes(x, b, 0, y[0])
        store_lanes(x, b, ANGULAR_OFFSET, y[1])
