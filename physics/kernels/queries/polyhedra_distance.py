"""Nearest points of two convex polyhedra, blocks or hulls, exact to rounding.

Apart, they are found by the algorithm of Gilbert, Johnson and Keerthi (`narrowphase.gjk`), which ends on the nearest
features after a few steps. Touching or overlapping, the direction in which the bodies separate by the shortest way is
one of a finite number: the normals of all faces, and the products of edges (`narrowphase.hull_hull`).
"""

from __future__ import annotations

import math

from physics.compiler.decorators import inlined, kernel
from physics.kernels.math import quaternion as qt
from physics.kernels.math.vector import minus, plus, row_vector, times
from physics.kernels.multibody.data.contact_set import add_scaled, put_vector, row_matrix
from physics.kernels.multibody.data.hull_tables import FIRST_CORNER, LAST_CORNER
from physics.kernels.multibody.narrowphase.gjk import closest_on_simplex, support_point
from physics.kernels.multibody.narrowphase.hull_hull import (
    hull_edge,
    max_hull_edge_separation,
    max_hull_face_separation,
)
from physics.kernels.multibody.narrowphase.hull_pose import pose_hull

# Largest number of iterations; about five are usual.
_MAX_ITERATIONS = 100

# The search ends when the distance exceeds its lower bound by at most this share, or by the rounding of the bound.
_DISTANCE_TOLERANCE = 1.0e-14
_ROUNDING = 4.0e-15

# Share of the larger bounding radius below which the distance leaves its direction too few digits: a separating axis
# has all of them. There a distance between two vertices is found too small, by less than this share.
_TOUCHING = 1.0e-9


@inlined
def _farthest_point(a, x, v, scratch):
    """Point of polyhedron a that reaches farthest along v, with its geometric centre at x."""
    return support_point(a, x, row_matrix(scratch.bodies.rotation, a), v, 0.0, True, scratch)


@inlined
def _keep_points(count, kept, pair):
    """Reorder `pair.on_first` as `closest_on_simplex` has reordered the simplex, whose rows were `pair.corners`.

    `count` corners were there, `kept` are left.
    """
    for row in range(count):
        put_vector(pair.points, row, 0, row_vector(pair.on_first, row, 0))
    for row in range(kept):
        w = row_vector(pair.simplex, row, 0)
        for old in range(count):
            u = row_vector(pair.corners, old, 0)
            if u[0] == w[0] and u[1] == w[1] and u[2] == w[2]:
                put_vector(pair.on_first, row, 0, row_vector(pair.points, old, 0))


@inlined
def _point_of_first(v, count, pair):
    """Point of the first body that belongs to the point v of the simplex: the same combination of its corners."""
    S, P = pair.simplex, pair.on_first
    a, p = row_vector(S, 0, 0), row_vector(P, 0, 0)
    if count == 1:
        return p
    b, q = row_vector(S, 1, 0), row_vector(P, 1, 0)
    if count == 2:
        d = minus(b, a)
        return add_scaled(p, min(max(qt.dot(minus(v, a), d) / qt.dot(d, d), 0.0), 1.0), minus(q, p))
    c, r = row_vector(S, 2, 0), row_vector(P, 2, 0)
    n = qt.cross(minus(b, a), minus(c, a))
    s = qt.dot(n, qt.cross(minus(c, v), minus(a, v))) / qt.dot(n, n)
    t = qt.dot(n, qt.cross(minus(a, v), minus(b, v))) / qt.dot(n, n)
    return add_scaled(add_scaled(p, s, minus(q, p)), t, minus(r, p))


@kernel
def _nearest_apart(a, b, scratch):
    """Vector from b to a between the nearest points, and the point of a from the centre of b; zeros if they touch."""
    pair, origin = scratch.narrowphase, (0.0, 0.0, 0.0)
    x = minus(row_vector(scratch.bodies.center, a, 0), row_vector(scratch.bodies.center, b, 0))
    v, count, touch = x, 0, _TOUCHING * max(scratch.bodies.body[a].radius, scratch.bodies.body[b].radius)
    if not qt.dot(v, v) > touch * touch:
        v = (1.0, 0.0, 0.0)
    for _ in range(_MAX_ITERATIONS):
        p = _farthest_point(a, x, (-v[0], -v[1], -v[2]), scratch)
        w, square = minus(p, _farthest_point(b, origin, v, scratch)), qt.dot(v, v)
        rounding = _ROUNDING * math.sqrt(square * max(qt.dot(w, w), qt.dot(p, p)))
        if count > 0 and square - qt.dot(v, w) <= _DISTANCE_TOLERANCE * square + rounding:
            break
        put_vector(pair.simplex, count, 0, w)
        put_vector(pair.on_first, count, 0, p)
        for row in range(count + 1):
            put_vector(pair.corners, row, 0, row_vector(pair.simplex, row, 0))
        before = count + 1
        v, count = closest_on_simplex(count, scratch)
        if count == 4 or not qt.dot(v, v) > touch * touch:
            return origin, origin
        _keep_points(before, count, pair)
    return v, _point_of_first(v, count, pair)


@inlined
def _lowest_corner(which, b, n, scratch):
    """Corner of body b, number `which` of the pair, that reaches least along n; in the coordinates of the pair."""
    hulls, low, lowest = scratch.narrowphase.hulls, math.inf, 0
    for k in range(hulls.of[b, LAST_CORNER] - hulls.of[b, FIRST_CORNER]):
        height = qt.dot(n, row_vector(hulls.corner[which], k, 0))
        if height < low:
            low, lowest = height, k
    return row_vector(hulls.corner[which], lowest, 0)


@inlined
def _across_edges(a, b, i, j, scratch):
    """Unit vector across edge i of a and edge j of b, out of b, and the points of both on the line along it."""
    p, d, _, _ = hull_edge(0, a, i, scratch)
    q, e, _, _ = hull_edge(1, b, j, scratch)
    n, w = qt.cross(d, e), minus(q, p)
    n = times(math.copysign(1.0 / math.sqrt(qt.dot(n, n)), -qt.dot(n, p)), n)  # the pair's origin is the centre of a
    dd, de, ee = qt.dot(d, d), qt.dot(d, e), qt.dot(e, e)
    t = (de * qt.dot(d, w) - dd * qt.dot(e, w)) / (dd * ee - de * de)
    s = min(max((qt.dot(d, w) + t * de) / dd, 0.0), 1.0)
    return n, add_scaled(p, s, d), add_scaled(q, min(max(t, 0.0), 1.0), e)


@kernel
def _overlap(a, b, scratch):
    """Separation of touching polyhedra by the axis that separates best: (gap, n out of b, point of a, point of b)."""
    hulls, origin = scratch.narrowphase.hulls, row_vector(scratch.bodies.center, a, 0)
    pose_hull(0, a, origin, scratch)
    pose_hull(1, b, origin, scratch)
    own, face = max_hull_face_separation(0, a, b, math.inf, scratch)
    other, other_face = max_hull_face_separation(1, b, a, math.inf, scratch)
    across, i, j = max_hull_edge_separation(a, b, scratch)
    if across > max(own, other):
        n, p, q = _across_edges(a, b, i, j, scratch)
        gap = across
    elif other > own:
        n = row_vector(hulls.normal[1], other_face, 0)
        gap, p = other, _lowest_corner(0, a, n, scratch)
        q = add_scaled(p, -gap, n)
    else:
        n = times(-1.0, row_vector(hulls.normal[0], face, 0))
        gap, q = own, _lowest_corner(1, b, times(-1.0, n), scratch)
        p = add_scaled(q, gap, n)
    return gap, n, plus(origin, p), plus(origin, q)


@kernel
def nearest_of_polyhedra(a, b, scratch):
    """Nearest points of polyhedra a and b: (gap [m], unit vector n out of b, point of a, point of b), world frame."""
    v, p = _nearest_apart(a, b, scratch)
    gap = math.sqrt(qt.dot(v, v))
    if not gap > 0.0:
        return _overlap(a, b, scratch)
    on_a = plus(row_vector(scratch.bodies.center, b, 0), p)
    return gap, times(1.0 / gap, v), on_a, minus(on_a, v)
