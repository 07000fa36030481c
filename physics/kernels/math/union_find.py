"""Disjoint sets, joined pair by pair: union-find with path halving.

Reference: R. E. Tarjan, *Efficiency of a good but not linear set union algorithm*, J. ACM 22, 1975.
"""

from __future__ import annotations

from physics.compiler.decorators import inlined


@inlined
def find_root(b, parent):
    """First body of the island of b."""
    while parent[b] != b:
        parent[b] = parent[parent[b]]
        b = parent[b]
    return b


@inlined
def unite_sets(a, b, parent):
    """Join the islands of a and b."""
    a, b = find_root(a, parent), find_root(b, parent)
    parent[max(a, b)] = min(a, b)
