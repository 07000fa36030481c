"""Order in which the bodies of an island are eliminated from its linear system, and the 6 x 6 blocks that this fills.

Minimum degree: the body with the fewest neighbours is always eliminated next, and its neighbours become neighbours of
each other. Towers, and bodies side by side on one plate, get no fill, whatever the numbers of their bodies. Heaps get
little, since most of their bodies lie on a wall or on two or three others.

References
----------
.. [1] W. F. Tinney, J. W. Walker, *Direct solutions of sparse network equations by optimally ordered triangular
       factorization*, Proc. IEEE 55, 1967.
.. [2] A. George, J. W.-H. Liu, *Computer Solution of Large Sparse Positive Definite Systems*, 1981, chapter 5.
"""

from __future__ import annotations

from physics.compiler.decorators import inlined, kernel

_NO_ENTRY = -1


@inlined
def _add_neighbour(a, b, many):
    """Add body b to the front of body a's list of neighbours; return False if there was no room."""
    k = many.system.links[0]
    if k == many.system.neighbour.shape[0]:
        return False
    many.system.neighbour[k, 0], many.system.neighbour[k, 1] = b, many.system.head[a]
    many.system.head[a], many.system.links[0] = k, k + 1
    many.system.degree[a] += 1
    return True


@inlined
def _mark_neighbours(a, mark, many):
    """Write the stamp `mark` to body a and to all bodies in its list of neighbours."""
    many.system.mark[a] = mark
    k = many.system.head[a]
    while k != _NO_ENTRY:
        many.system.mark[many.system.neighbour[k, 0]] = mark
        k = many.system.neighbour[k, 1]


@inlined
def _put_in_bucket(b, many):
    """Add body b to the front of the list (bucket) of bodies of its degree."""
    d = many.system.degree[b]
    many.system.ahead[b], many.system.behind[b] = _NO_ENTRY, many.system.bucket[d]
    if many.system.bucket[d] != _NO_ENTRY:
        many.system.ahead[many.system.bucket[d]] = b
    many.system.bucket[d] = b


@inlined
def _take_from_bucket(b, many):
    """Take body b out of the list (bucket) of bodies of its degree."""
    if many.system.ahead[b] == _NO_ENTRY:
        many.system.bucket[many.system.degree[b]] = many.system.behind[b]
    else:
        many.system.behind[many.system.ahead[b]] = many.system.behind[b]
    if many.system.behind[b] != _NO_ENTRY:
        many.system.ahead[many.system.behind[b]] = many.system.ahead[b]


@inlined
def _build_graph(first, last, begin, end, many):
    """Build the lists of neighbours of an island's bodies from its contacts; return False if there was no room.

    The island has contacts `islands.contacts[first:last]` and bodies `islands.bodies[begin:end]`.
    """
    many.system.links[0] = 0
    for i in range(begin, end):
        b = many.islands.bodies[i]
        many.system.head[b], many.system.degree[b], many.system.rank[b], many.system.mark[b] = (
            _NO_ENTRY,
            0,
            _NO_ENTRY,
            _NO_ENTRY,
        )
    before_a = before_b = _NO_ENTRY
    for i in range(first, last):
        a, b = many.contacts.bodies[many.islands.contacts[i], 0], many.contacts.bodies[many.islands.contacts[i], 1]
        if b < 0 or (a == before_a and b == before_b):
            continue
        before_a, before_b = a, b
        if not (_add_neighbour(a, b, many) and _add_neighbour(b, a, many)):
            return False
    return True


@inlined
def _write_column(b, at, many):
    """Write the remaining neighbours of body b to `many.system.column`, from position `at` on.

    Returns the position behind them, or -1 if there was no room.
    """
    k = many.system.head[b]
    while k != _NO_ENTRY:
        other = many.system.neighbour[k, 0]
        if many.system.rank[other] == _NO_ENTRY:
            if at == many.system.column.shape[0]:
                return _NO_ENTRY
            many.system.column[at] = other
            at += 1
        k = many.system.neighbour[k, 1]
    return at


@inlined
def _eliminate_body(start, end, b, many):
    """Eliminate body b: its remaining neighbours become neighbours of each other, and their degrees no longer count b.

    The remaining neighbours are `many.system.column[start:end]`. Returns False if there was no room for the new ones.
    """
    for i in range(start, end):
        a = many.system.column[i]
        _take_from_bucket(a, many)
        many.system.degree[a] -= 1
        if end - start > 1:
            _mark_neighbours(a, b * many.system.mark.shape[0] + a, many)
        for j in range(start, end):
            other = many.system.column[j]
            is_new = end - start > 1 and many.system.mark[other] != b * many.system.mark.shape[0] + a
            if is_new and not _add_neighbour(a, other, many):
                return False
        _put_in_bucket(a, many)
    return True


@kernel
def order_elimination(first, last, begin, end, most, many):
    """Order the bodies of an island for elimination; return the number of products of 6 x 6 blocks that it takes.

    The island has contacts `islands.contacts[first:last]` and bodies `islands.bodies[begin:end]`, which are sorted into
    the order. `system.rank` receives the position of each body, `system.column[start[b] : stop[b]]` the neighbours of
    body b that come later. The result is -1 if there is no room, or if the number is more than `most`.
    """
    if not _build_graph(first, last, begin, end, many):
        return -1
    for d in range(end - begin):
        many.system.bucket[d] = _NO_ENTRY
    for i in range(end - 1, begin - 1, -1):
        _put_in_bucket(many.islands.bodies[i], many)
    at = least = cost = 0
    for i in range(begin, end):
        while many.system.bucket[least] == _NO_ENTRY:
            least += 1
        b = many.system.bucket[least]
        _take_from_bucket(b, many)
        many.islands.bodies[i], many.system.rank[b], many.system.start[b] = b, i, at
        at = _write_column(b, at, many)
        if at < 0 or not _eliminate_body(many.system.start[b], at, b, many):
            return -1
        many.system.stop[b] = at
        d = at - many.system.start[b]
        cost += 1 + d + d * d
        if cost > most:
            return -1
        least = max(0, least - 1)
    return cost
