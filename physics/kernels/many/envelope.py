"""Linear systems with one 6 x 6 block for every two bodies that touch: block LU inside an envelope.

Bodies are numbered by breadth-first search from a body with few neighbours (Cuthill and McKee), so that those that
touch have numbers close to each other; between the first neighbour and the diagonal a row is full. A stack is
tridiagonal, and its factor costs as much as its bodies. Walls do not move and do not count.

Reference: E. Cuthill, J. McKee, *Reducing the bandwidth of sparse symmetric matrices*, ACM 1969; A. George,
J. W.-H. Liu, *Computer Solution of Large Sparse Positive Definite Systems*, 1981, chapter 4.
"""

from __future__ import annotations

from physics.kernels.compiler import inlined, kernel

SIZE = 6  # of a block: velocity and angular velocity of a body


@inlined
def _link(n, many):
    """Write the neighbours of every body, one after the other: `degree`, `offset`, `neighbour`."""
    ends, degree, offset = many.ends, many.degree, many.offset
    count = degree.shape[0]
    for b in range(count):
        degree[b] = 0
    links = 0
    for k in range(n):
        a, b = ends[k, 0], ends[k, 1]
        if b < 0 or (k > 0 and ends[k - 1, 0] == a and ends[k - 1, 1] == b):
            continue
        many.pairs[links, 0], many.pairs[links, 1] = a, b  # the near pairs are not needed any more
        links += 1
        degree[a] += 1
        degree[b] += 1
    total = 0
    for b in range(count):
        offset[b] = total
        total += degree[b]
        degree[b] = 0
    for k in range(links):
        a, b = many.pairs[k, 0], many.pairs[k, 1]
        many.neighbour[offset[a] + degree[a]], many.neighbour[offset[b] + degree[b]] = b, a
        degree[a] += 1
        degree[b] += 1


@inlined
def _seed(many):
    """The body of a contact that has no number yet with the fewest neighbours, or -1."""
    best = -1
    for b in range(many.degree.shape[0]):
        if many.touched[b] == 1 and many.rank[b] < 0 and (best < 0 or many.degree[b] < many.degree[best]):
            best = b
    return best


@inlined
def _number(many):
    """Write `rank` (number of a body, -1: in no contact) and `order` (body of a number); how many have one."""
    for b in range(many.rank.shape[0]):
        many.rank[b] = -1
    count = head = 0
    while True:
        if head == count:
            seed = _seed(many)
            if seed < 0:
                return count
            many.order[count], many.rank[seed] = seed, count
            count += 1
        b = many.order[head]
        head += 1
        for k in range(many.offset[b], many.offset[b] + many.degree[b]):
            other = many.neighbour[k]
            if many.rank[other] < 0:
                many.order[count], many.rank[other] = other, count
                count += 1


@kernel
def lay_out(n, many):
    """Number the bodies and lay out the envelope of the n contacts: bodies numbered, 0 if there is no room for it."""
    _link(n, many)
    count = _number(many)
    total = 0
    for i in range(count):
        b, first = many.order[i], i
        for k in range(many.offset[b], many.offset[b] + many.degree[b]):
            first = min(first, many.rank[many.neighbour[k]])
        many.first[i], many.start[i] = first, total - first
        total += i - first + 1
    return count if total <= many.lower.shape[0] else 0


@kernel
def clear(count, many):
    """Set the system to the identity."""
    last = many.start[count - 1] + count
    for k in range(last):
        for r in range(SIZE):
            for c in range(SIZE):
                many.lower[k, r, c] = many.upper[k, r, c] = 0.0
    for i in range(count):
        for r in range(SIZE):
            many.lower[many.start[i] + i, r, r] = 1.0


@inlined
def block_of(i, j, many):
    """Array and place of block (i, j): the diagonal and what is below it in `lower`, the rest in `upper`."""
    if i >= j:
        return many.lower, many.start[i] + j
    return many.upper, many.start[j] + i


@inlined
def _take_product(target, k, A, i, B, j):
    """target[k] -= A[i] B[j]."""
    for r in range(SIZE):
        for c in range(SIZE):
            total = 0.0
            for s in range(SIZE):
                total += A[i, r, s] * B[j, s, c]
            target[k, r, c] -= total


@inlined
def _invert(A, k, spare):
    """Invert block A[k] in place by elimination with row exchanges."""
    for r in range(SIZE):
        for c in range(SIZE):
            spare[r, c] = A[k, r, c]
            spare[r, c + SIZE] = 1.0 if r == c else 0.0
    for p in range(SIZE):
        best = p
        for r in range(p + 1, SIZE):
            if abs(spare[r, p]) > abs(spare[best, p]):
                best = r
        if best != p:
            for c in range(p, 2 * SIZE):
                spare[p, c], spare[best, c] = spare[best, c], spare[p, c]
        s = 1.0 / spare[p, p]
        for c in range(p, 2 * SIZE):
            spare[p, c] *= s
        for r in range(SIZE):
            f = spare[r, p]
            if r != p and f != 0.0:
                for c in range(p, 2 * SIZE):
                    spare[r, c] -= f * spare[p, c]
    for r in range(SIZE):
        for c in range(SIZE):
            A[k, r, c] = spare[r, c + SIZE]


@kernel
def factor(count, many):
    """Replace the system by its factors: L below the diagonal, U above, the inverses of U's diagonal blocks on it."""
    lower, upper, first, start = many.lower, many.upper, many.first, many.start
    for i in range(count):
        for j in range(first[i], i):
            for k in range(max(first[i], first[j]), j):
                _take_product(lower, start[i] + j, lower, start[i] + k, upper, start[j] + k)
                _take_product(upper, start[i] + j, lower, start[j] + k, upper, start[i] + k)
            _times_inverse(lower, start[i] + j, start[j] + j, many.spare)
            _take_product(lower, start[i] + i, lower, start[i] + j, upper, start[i] + j)
        _invert(lower, start[i] + i, many.spare)


@inlined
def _times_inverse(A, k, d, spare):
    """A[k] = A[k] A[d], where A[d] holds the inverse of a diagonal block."""
    for r in range(SIZE):
        for c in range(SIZE):
            total = 0.0
            for s in range(SIZE):
                total += A[k, r, s] * A[d, s, c]
            spare[r, c] = total
    for r in range(SIZE):
        for c in range(SIZE):
            A[k, r, c] = spare[r, c]


@inlined
def _take(x, i, A, k, j):
    """x[i] -= A[k] x[j]."""
    for r in range(SIZE):
        total = 0.0
        for s in range(SIZE):
            total += A[k, r, s] * x[j, s]
        x[i, r] -= total


@kernel
def substitute(count, x, many):
    """Overwrite the right sides x ((count, 6), by number) with the solution."""
    lower, upper, first, start = many.lower, many.upper, many.first, many.start
    for i in range(count):
        for j in range(first[i], i):
            _take(x, i, lower, start[i] + j, j)
    for i in range(count - 1, -1, -1):
        for r in range(SIZE):
            total = 0.0
            for s in range(SIZE):
                total += lower[start[i] + i, r, s] * x[i, s]
            many.spare[r, 0] = total
        for r in range(SIZE):
            x[i, r] = many.spare[r, 0]
        for j in range(first[i], i):
            _take(x, j, upper, start[i] + j, i)
