"""Contacts of a cylinder and a convex polyhedron, a block or a hull.

The direction of the largest separation decides (`cylinder_separation`). Where a face of the polyhedron or an end of the
cylinder separates as well as any other direction, up to a slop, the part above it touches (`cylinder_face`). Else one
point touches: of the side or a rim at an edge, or at a corner. An edge along the side touches with both ends of the
part beside it. Where the direction is nearly that of a face or end, by 11 degrees, the part above that touches, too.
"""

from __future__ import annotations

import math

from physics.compiler.decorators import inlined, kernel
from physics.kernels.math import quaternion as qt
from physics.kernels.math.segments import nearest_places, point_on_segment
from physics.kernels.math.vector import minus, plus, row_vector, times
from physics.kernels.multibody.data.contact_set import pair_slop
from physics.kernels.multibody.data.cylinders import (
    BESIDE_FEATURE,
    SINGLE_FEATURE,
    across_axis,
    axis_of,
    cylinder_support_arm,
    rotation_of,
)
from physics.kernels.multibody.data.hull_tables import (
    FIRST_EDGE,
    FIRST_FACE,
    LAST_EDGE,
    LAST_FACE,
)
from physics.kernels.multibody.data.parts import body_of
from physics.kernels.multibody.narrowphase.box_sat import FLAT_COSINE
from physics.kernels.multibody.narrowphase.cylinder_face import (
    add_flat_end,
    add_of_pair,
    add_on_face,
    add_outline,
    end_towards,
)
from physics.kernels.multibody.narrowphase.cylinder_separation import (
    AT_CORNER,
    ON_END,
    SIDE_AND_EDGE,
    best_face,
    best_of_others,
    farthest_corner,
)
from physics.kernels.multibody.narrowphase.hull_clip import has_corner
from physics.kernels.multibody.narrowphase.hull_hull import hull_edge
from physics.kernels.multibody.narrowphase.hull_pose import nearest_on_face, pose_hull
from physics.kernels.multibody.narrowphase.segment_polyhedron import edge_segment

# Cosine of the angle between an edge and the axis from which on the edge lies along the side (8 degrees).
_ALONG_COSINE = 0.99

# Component along the axis up to which a direction is nearly that of the side (11 degrees).
_FLAT_SINE = 0.2

# Component along the axis up to which a direction is that of the side.
_SIDE_SINE = 1.0e-6


@inlined
def _face_towards(hull, n, many):
    """Face at the corner that reaches farthest along n whose normal is nearest to n."""
    hulls, first = many.narrowphase.hulls, many.narrowphase.hulls.of[hull, FIRST_FACE]
    corner, best, face = farthest_corner(hull, n, many)[1], -math.inf, 0
    for f in range(hulls.of[hull, LAST_FACE] - first):
        c = qt.dot(n, row_vector(hulls.normal[0], f, 0))
        if c > best and has_corner(first + f, corner, hulls):
            best, face = c, f
    return face


@inlined
def _add_on_end(pair, n, limits, h, many):
    """Add the contacts of an end against n and the face towards it; return the least gap [m]."""
    end, face = end_towards(pair[0], n, many), _face_towards(pair[1], n, many)
    low, _ = add_flat_end(pair, face, end, limits, h, many)
    return min(low, add_outline(pair, face, end, limits, h, many))


@inlined
def _add_beside(pair, feature, q, x, limits, h, many):
    """Add the contact of the polyhedron's point q with the side of the cylinder; return its gap, else inf [m]."""
    y = axis_of(rotation_of(pair[0], many))
    w, (least, margin) = across_axis(y, minus(x, q)), limits
    far = math.sqrt(qt.dot(w, w))
    gap = far - many.bodies.body[pair[0]].dims[0]
    if gap > margin or not far > 0.0:
        return math.inf
    gap, n = max(gap, least), times(1.0 / far, w)
    add_of_pair(pair, feature, -1, n, (plus(q, times(gap, n)), q), gap, h, many)
    return gap


@kernel
def _add_edge_along(pair, e, x, limits, h, many):
    """Add both ends of the part of edge e that lies beside a cylinder, with its centre at x: the least gap [m]."""
    p, d, _, _ = hull_edge(0, pair[1], e, many)
    y, l = axis_of(rotation_of(pair[0], many)), many.bodies.body[pair[0]].dims[1]
    start, slope = qt.dot(y, minus(p, x)), qt.dot(y, d)
    first = min(max((math.copysign(l, -slope) - start) / slope, 0.0), 1.0)
    last = min(max((math.copysign(l, slope) - start) / slope, 0.0), 1.0)
    low = _add_beside(pair, BESIDE_FEATURE, plus(p, times(first, d)), x, limits, h, many)
    return min(low, _add_beside(pair, BESIDE_FEATURE + 1, plus(p, times(last, d)), x, limits, h, many))


@inlined
def _edge_along(pair, n, x, slop, many):
    """Edge along the side that reaches farthest along n and is nearest to the cylinder's centre x; -1 if there is none.

    The end that reaches farther may be a slop [m] behind the farthest corner.
    """
    y, nearest, found = axis_of(rotation_of(pair[0], many)), math.inf, -1
    reach = farthest_corner(pair[1], n, many)[0] - slop
    for e in range(many.narrowphase.hulls.of[pair[1], LAST_EDGE] - many.narrowphase.hulls.of[pair[1], FIRST_EDGE]):
        p, d, _, _ = hull_edge(0, pair[1], e, many)
        if abs(qt.dot(d, y)) < _ALONG_COSINE * math.sqrt(qt.dot(d, d)):
            continue
        w = across_axis(y, minus(x, p))
        if qt.dot(w, w) < nearest and qt.dot(n, p) + max(0.0, qt.dot(n, d)) >= reach:
            nearest, found = qt.dot(w, w), e
    return found


@kernel
def _add_along(pair, n, x, limits, h, many):
    """Add both ends of an edge along the side, if one touches along n; return whether it does."""
    slop = pair_slop(body_of(pair[0], many), body_of(pair[1], many), many)
    if abs(qt.dot(n, axis_of(rotation_of(pair[0], many)))) > _FLAT_SINE:
        return False
    edge = _edge_along(pair, n, x, slop, many)
    return edge >= 0 and _add_edge_along(pair, edge, x, limits, h, many) <= limits[0] + slop


@kernel
def _add_single(pair, kind, index, n, x, limits, h, many):
    """Add the contact of the features that separate best, of the kind and number as of `best_of_others`."""
    (can, hull), hulls, R, least = pair, many.narrowphase.hulls, rotation_of(pair[0], many), limits[0]
    l, y = many.bodies.body[can].dims[1], axis_of(R)
    if _add_along(pair, n, x, limits, h, many):
        return
    if kind == AT_CORNER and abs(qt.dot(n, y)) <= _SIDE_SINE:
        _add_beside(pair, BESIDE_FEATURE, row_vector(hulls.corner[0], index, 0), x, limits, h, many)
        return
    p = plus(x, cylinder_support_arm(many.bodies.body[can].dims, R, times(-1.0, n)))
    if kind == SIDE_AND_EDGE:
        q, v = edge_segment(hull, index, many)
        s, _, _ = nearest_places(x, times(l, y), q, v)
        p = plus(point_on_segment(x, times(l, y), s), times(-many.bodies.body[can].dims[0], n))
    add_of_pair(pair, SINGLE_FEATURE, -1, n, (p, plus(p, times(-least, n))), least, h, many)


@kernel
def _add_beyond_face(pair, face, x, limits, h, many):
    """Add the contact of a cylinder that a face separates best, though no part of it is above the face."""
    (can, hull), n = pair, row_vector(many.narrowphase.hulls.normal[0], face, 0)
    if _add_along(pair, n, x, limits, h, many):
        return
    p = plus(x, cylinder_support_arm(many.bodies.body[can].dims, rotation_of(can, many), times(-1.0, n)))
    q = nearest_on_face(0, hull, face, p, many)
    add_of_pair(pair, SINGLE_FEATURE, -1, n, (plus(q, times(limits[0], n)), q), limits[0], h, many)


@inlined
def _add_near_flat(pair, face, n, limits, h, many):
    """Add the part above a face or end whose direction is nearly n: the least gap, inf if there is none [m]."""
    m = row_vector(many.narrowphase.hulls.normal[0], face, 0)
    y = axis_of(rotation_of(pair[0], many))
    if abs(qt.dot(n, y)) >= FLAT_COSINE:
        return _add_on_end(pair, n, limits, h, many)
    if qt.dot(n, m) >= FLAT_COSINE:
        return add_on_face(pair, face, limits, h, many)
    return math.inf


@kernel
def collide_cylinder_hull(can, hull, margin, h, many):
    """Add the contacts of a cylinder and a block or hull whose gaps are at most `margin` [m].

    h is the length of the stage [s].
    """
    origin, pair = row_vector(many.bodies.center, hull, 0), (can, hull)
    pose_hull(0, hull, origin, many)
    x = minus(row_vector(many.bodies.center, can, 0), origin)
    apart, face = best_face(can, hull, x, margin, many)
    if apart > margin:
        return
    further, n, kind, index = best_of_others(can, hull, x, many)
    if further > margin:
        return
    slop = pair_slop(body_of(can, many), body_of(hull, many), many)
    if further <= apart + slop:
        if add_on_face(pair, face, (apart, margin), h, many) > apart + slop:
            _add_beyond_face(pair, face, x, (apart, margin), h, many)
        return
    limits = (further, margin)
    if kind == ON_END:
        low = _add_on_end(pair, n, limits, h, many)
    else:
        low = _add_near_flat(pair, face, n, limits, h, many)
    if low > further + slop:
        _add_single(pair, kind, index, n, x, limits, h, many)
