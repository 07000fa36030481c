"""In which order to eliminate the bodies of an island, and which 6 x 6 blocks that fills.

Minimum degree: always the body with the fewest neighbours is next, and its neighbours become neighbours of each other.
A tower, or bodies side by side on one plate, fill nothing whatever the numbers of their bodies; a heap fills little,
for most of its bodies lie on a wall or on two or three others.

References
----------
.. [1] W. F. Tinney, J. W. Walker, *Direct solutions of sparse network equations by optimally ordered triangular
       factorization*, Proc. IEEE 55, 1967.
.. [2] A. George, J. W.-H. Liu, *Computer Solution of Large Sparse Positive Definite Systems*, 1981, chapter 5.
"""

from __future__ import annotations

from physics.kernels.compile.decorators import inlined, kernel

_NO_ENTRY = -1


@inlined
def _add_neighbour(a, b, many):
    """Add b to the list of neighbours of a, at its front; whether there was room."""
    k = many.links[0]
    if k == many.neighbour.shape[0]:
        return False
    many.neighbour[k, 0], many.neighbour[k, 1] = b, many.head[a]
    many.head[a], many.links[0] = k, k + 1
    many.degree[a] += 1
    return True


@inlined
def _mark_neighbours(a, mark, many):
    """Write `mark` to all neighbours of a that are not eliminated, and to a itself."""
    many.mark[a] = mark
    k = many.head[a]
    while k != _NO_ENTRY:
        many.mark[many.neighbour[k, 0]] = mark
        k = many.neighbour[k, 1]


@inlined
def _put_in_bucket(b, many):
    """Put b at the front of the list of bodies of its degree."""
    d = many.degree[b]
    many.ahead[b], many.behind[b] = _NO_ENTRY, many.bucket[d]
    if many.bucket[d] != _NO_ENTRY:
        many.ahead[many.bucket[d]] = b
    many.bucket[d] = b


@inlined
def _take_from_bucket(b, many):
    """Take b out of the list of bodies of its degree."""
    if many.ahead[b] == _NO_ENTRY:
        many.bucket[many.degree[b]] = many.behind[b]
    else:
        many.behind[many.ahead[b]] = many.behind[b]
    if many.behind[b] != _NO_ENTRY:
        many.ahead[many.behind[b]] = many.ahead[b]


@inlined
def _build_graph(first, last, begin, end, many):
    """Neighbours of the bodies of one island, from its contacts; whether there was room."""
    many.links[0] = 0
    for i in range(begin, end):
        b = many.order[i]
        many.head[b], many.degree[b], many.rank[b], many.mark[b] = _NO_ENTRY, 0, _NO_ENTRY, _NO_ENTRY
    before_a = before_b = _NO_ENTRY
    for i in range(first, last):
        a, b = many.ends[many.queue[i], 0], many.ends[many.queue[i], 1]
        if b < 0 or (a == before_a and b == before_b):
            continue
        before_a, before_b = a, b
        if not (_add_neighbour(a, b, many) and _add_neighbour(b, a, many)):
            return False
    return True


@inlined
def _write_column(b, at, many):
    """Write the neighbours of b that are left to `many.column` from `at` on; where they end, or -1: no room."""
    k = many.head[b]
    while k != _NO_ENTRY:
        other = many.neighbour[k, 0]
        if many.rank[other] == _NO_ENTRY:
            if at == many.column.shape[0]:
                return _NO_ENTRY
            many.column[at] = other
            at += 1
        k = many.neighbour[k, 1]
    return at


@inlined
def _eliminate_body(start, end, b, many):
    """Take b from its neighbours `many.column[start:end]` and make them neighbours of each other; whether room was."""
    for i in range(start, end):
        a = many.column[i]
        _take_from_bucket(a, many)
        many.degree[a] -= 1
        if end - start > 1:
            _mark_neighbours(a, b * many.mark.shape[0] + a, many)
        for j in range(start, end):
            other = many.column[j]
            is_new = end - start > 1 and many.mark[other] != b * many.mark.shape[0] + a
            if is_new and not _add_neighbour(a, other, many):
                return False
        _put_in_bucket(a, many)
    return True


@kernel
def order_elimination(first, last, begin, end, most, many):
    """Reorder the bodies `many.order[begin:end]` of an island with contacts `many.queue[first:last]` for elimination.

    `many.rank` receives the place of each, `many.column[start[b] : stop[b]]` those of its neighbours that come later.
    Returns the products of blocks that elimination takes; -1: there is no room for it, or they are more than `most`.
    """
    if not _build_graph(first, last, begin, end, many):
        return -1
    for d in range(end - begin):
        many.bucket[d] = _NO_ENTRY
    for i in range(end - 1, begin - 1, -1):
        _put_in_bucket(many.order[i], many)
    at = least = work = 0
    for i in range(begin, end):
        while many.bucket[least] == _NO_ENTRY:
            least += 1
        b = many.bucket[least]
        _take_from_bucket(b, many)
        many.order[i], many.rank[b], many.start[b] = b, i, at
        at = _write_column(b, at, many)
        if at < 0 or not _eliminate_body(many.start[b], at, b, many):
            return -1
        many.stop[b] = at
        d = at - many.start[b]
        work += 1 + d + d * d
        if work > most:
            return -1
        least = max(0, least - 1)
    return work
