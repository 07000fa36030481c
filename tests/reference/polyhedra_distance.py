"""Distance of two convex polyhedra by trying all their features: a slow oracle that knows no search.

Apart, the nearest points are a vertex and a triangle of a face, or two edges. Overlapping, the shortest way apart is
along a normal of a face, or across two edges.
"""

from __future__ import annotations

from itertools import pairwise, product
from typing import NamedTuple

import numpy as np

import physics
from physics.kernels.multibody.data.hull_tables import CUBE
from physics.rotations import rotation_matrices


class Posed(NamedTuple):
    """Corners (v, 3), faces as lists of corners, and edges as pairs of corners, in the world."""

    corners: np.ndarray
    loops: list
    edges: np.ndarray


def posed(body: physics.Body, pos, quat) -> Posed:
    """A block or a hull in a pose."""
    solid = CUBE if body.kind == "block" else body.polyhedron
    own = solid.vertices * body.dimensions if body.kind == "block" else solid.vertices
    corners = np.asarray(pos) + (own + np.asarray(body.center)) @ rotation_matrices(np.asarray(quat)).T
    return Posed(corners, solid.loops, np.asarray(solid.edges)[:, :2].astype(int))


def _point_triangle(x, a, b, c) -> float:
    """Distance of a point from a triangle: over its inside, else to one of its sides."""
    n = np.cross(b - a, c - a)
    over = all(np.cross(q - p, x - p) @ n >= 0 for p, q in ((a, b), (b, c), (c, a)))
    if over:
        return abs((x - a) @ n) / np.linalg.norm(n)
    return min(_point_segment(x, p, q) for p, q in ((a, b), (b, c), (c, a)))


def _point_segment(x, p, q) -> float:
    d = q - p
    return float(np.linalg.norm(x - p - np.clip((x - p) @ d / (d @ d), 0, 1) * d))


def _segments(p, q, r, s) -> float:
    """Distance of two segments: between points inside both where the lines cross there, else from an end."""
    d, e, w = q - p, s - r, r - p
    n = np.cross(d, e)
    if n @ n > 1e-20 * (d @ d) * (e @ e):
        a, b = np.cross(w, e) @ n / (n @ n), np.cross(w, d) @ n / (n @ n)
        if 0 <= a <= 1 and 0 <= b <= 1:
            return abs(w @ n) / np.linalg.norm(n)
    ends = (_point_segment(p, r, s), _point_segment(q, r, s), _point_segment(r, p, q), _point_segment(s, p, q))
    return min(ends)


def distance_apart(a: Posed, b: Posed) -> float:
    """Distance of two polyhedra that do not overlap [m]."""
    found = [
        _point_triangle(x, *(other.corners[k] for k in (loop[0], *pair)))
        for one, other in ((a, b), (b, a))
        for x in one.corners
        for loop in other.loops
        for pair in pairwise(loop[1:])
    ]
    found += [_segments(*a.corners[list(edge)], *b.corners[list(other)]) for edge, other in product(a.edges, b.edges)]
    return min(found)


def separation(a: Posed, b: Posed) -> float:
    """Largest separation along a normal of a face or across two edges [m]; negative where the polyhedra overlap."""
    axes = [
        np.cross(one.corners[loop[1]] - one.corners[loop[0]], one.corners[loop[2]] - one.corners[loop[0]])
        for one in (a, b)
        for loop in one.loops
    ]
    axes += [
        np.cross(a.corners[i] - a.corners[j], b.corners[k] - b.corners[m])
        for (i, j), (k, m) in product(a.edges, b.edges)
    ]
    axes = [axis / np.linalg.norm(axis) for axis in axes if np.linalg.norm(axis) > 1e-9]
    both = np.array(axes + [-axis for axis in axes])
    return float(((both @ a.corners.T).min(axis=1) - (both @ b.corners.T).max(axis=1)).max())
