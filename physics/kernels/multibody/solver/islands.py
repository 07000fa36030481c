"""Islands: groups of bodies connected by contacts, walls left out. Each is a contact problem of its own.

Contacts and bodies are listed island by island (union-find, then a counting sort). Within an island they keep the order
of their indices, so that the results of an island do not depend on other islands.

Reference: R. E. Tarjan, *Efficiency of a good but not linear set union algorithm*, J. ACM 22, 1975 (with path halving).
"""

from __future__ import annotations

from physics.compiler.decorators import inlined, kernel
from physics.kernels.math.union_find import find_root, unite_sets


@inlined
def union_contacts(n, many):
    """Join the bodies of the n contacts into islands, as a union-find forest in `many.islands.parent`."""
    parent = many.islands.parent
    for b in range(parent.shape[0]):
        parent[b] = b
    for k in range(n):
        if many.contacts.bodies[k, 1] >= 0:
            unite_sets(many.contacts.bodies[k, 0], many.contacts.bodies[k, 1], parent)


@inlined
def _list_contacts(n, many):
    """Number the islands in the order of their first contacts, and list the n contacts; return the number of islands.

    Writes `many.islands.contacts` and `first_contact`. The number of an island is stored in `of_body` at the root body
    of the island in the union-find forest.
    """
    island, begin, parent, count = many.islands.of_body, many.islands.first_contact, many.islands.parent, 0
    for b in range(island.shape[0]):
        island[b] = -1
    for k in range(n):
        root = find_root(many.contacts.bodies[k, 0], parent)
        if island[root] < 0:
            island[root], begin[count] = count, 0
            count += 1
        begin[island[root]] += 1
    total = 0
    for i in range(count):
        total, begin[i] = total + begin[i], total
    for k in range(n):
        i = island[find_root(many.contacts.bodies[k, 0], parent)]
        many.islands.contacts[begin[i]] = k
        begin[i] += 1
    for i in range(count, 0, -1):
        begin[i] = begin[i - 1]
    begin[0] = 0
    return count


@inlined
def _list_bodies(count, many):
    """List the bodies of the `count` islands in `many.islands.bodies`, and write `of_body` and `first_body`."""
    island, begin, total = many.islands.of_body, many.islands.first_body, 0
    for i in range(count + 1):
        begin[i] = 0
    for b in range(island.shape[0]):
        island[b] = island[find_root(b, many.islands.parent)]  # the root comes first
        if island[b] >= 0:
            begin[island[b]] += 1
    for i in range(count):
        total, begin[i] = total + begin[i], total
    for b in range(island.shape[0]):
        if island[b] >= 0:
            many.islands.bodies[begin[island[b]]] = b
            begin[island[b]] += 1
    for i in range(count, 0, -1):
        begin[i] = begin[i - 1]
    begin[0] = 0


@kernel
def find_islands(n, many):
    """Sort the n contacts of the set, and their bodies, into islands; return the number of islands.

    Contacts of island i are `many.islands.contacts[first_contact[i] : first_contact[i + 1]]`, its bodies
    `many.islands.bodies[first_body[i] : first_body[i + 1]]`.
    """
    union_contacts(n, many)
    count = _list_contacts(n, many)
    _list_bodies(count, many)
    return count
