"""Disjoint sets, joined pair by pair: union-find with path halving.

The array `parent` links each member to another member of its set, or to itself; a member linked to itself is the root,
which stands for the set.

Reference: R. E. Tarjan, *Efficiency of a good but not linear set union algorithm*, J. ACM 22, 1975.
"""

from __future__ import annotations

from physics.compiler.decorators import inlined


@inlined
def find_root(b, parent):
    """Find the root of the set that holds b, which is the lowest index of the set, and shorten the links on the way."""
    while parent[b] != b:
        parent[b] = parent[parent[b]]
        b = parent[b]
    return b


@inlined
def unite_sets(a, b, parent):
    """Join the set that holds a and the set that holds b."""
    a, b = find_root(a, parent), find_root(b, parent)
    parent[max(a, b)] = min(a, b)
