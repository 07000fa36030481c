"""Largest separation of a cylinder and a convex polyhedron, over all directions in which features can meet.

The direction n that separates best leads out of the polyhedron. Unless it is the normal of a face, it is one of these:

- of an end of the cylinder;
- across an edge and the axis;
- across an edge, from there to a rim (`rim_line`), if it lies between the normals of the edge's two faces;
- from a corner to its nearest point of the cylinder, on the side or on a rim.

Each is measured with the support functions of both bodies, so that none can be too large, and the largest one is the
distance of the bodies or, reversed, the shortest way that moves them apart.

The polyhedron is number 0 of the pair, and vectors are in its coordinates (`hull_pose`).
"""

from __future__ import annotations

import math

from physics.compiler.decorators import inlined, kernel
from physics.kernels.math import quaternion as qt
from physics.kernels.math.vector import minus, plus, row_vector, times
from physics.kernels.multibody.data.contact_set import add_scaled
from physics.kernels.multibody.data.cylinder_balls import nearest_of_cylinder
from physics.kernels.multibody.data.cylinders import axis_of, cylinder_support, rotation_of
from physics.kernels.multibody.data.hull_tables import (
    FIRST_CORNER,
    FIRST_EDGE,
    FIRST_FACE,
    LAST_CORNER,
    LAST_EDGE,
    LAST_FACE,
)
from physics.kernels.multibody.narrowphase.hull_hull import hull_edge
from physics.kernels.multibody.narrowphase.rim_line import rim_line_normal

# Features of the cylinder and the polyhedron that separate best: an end and whatever is nearest to it; the side and an
# edge; a rim and an edge; a corner and the side or a rim.
ON_END, SIDE_AND_EDGE, RIM_AND_EDGE, AT_CORNER = range(4)


@kernel
def best_face(can, hull, x, far, many):
    """Find the face that is farthest from a cylinder with its centre at x: (separation [m], face).

    The search stops at a face farther than `far` [m].
    """
    hulls, best, face, R = many.narrowphase.hulls, -math.inf, 0, rotation_of(can, many)
    for f in range(hulls.of[hull, LAST_FACE] - hulls.of[hull, FIRST_FACE]):
        n = row_vector(hulls.normal[0], f, 0)
        apart = qt.dot(n, x) - cylinder_support(can, R, n, many) - hulls.offset[0, f]
        if apart > best:
            best, face = apart, f
            if best > far:
                break
    return best, face


@kernel
def farthest_corner(hull, n, many):
    """Corner of a polyhedron that reaches farthest along n: (its height n·x [m], its number)."""
    hulls, best, corner = many.narrowphase.hulls, -math.inf, 0
    for k in range(hulls.of[hull, LAST_CORNER] - hulls.of[hull, FIRST_CORNER]):
        reach = qt.dot(n, row_vector(hulls.corner[0], k, 0))
        if reach > best:
            best, corner = reach, k
    return best, corner


@inlined
def _separation(can, hull, x, n, many):
    """Separation of a cylinder with its centre at x from a polyhedron along the unit vector n [m]."""
    reach = cylinder_support(can, rotation_of(can, many), n, many)
    return qt.dot(n, x) - reach - farthest_corner(hull, n, many)[0]


@inlined
def _is_between(left, right, d, n):
    """True if n, across the edge d, lies between the normals `left` and `right` of the edge's two faces."""
    one, other = qt.dot(qt.cross(left, n), d), qt.dot(qt.cross(n, right), d)
    return one * other >= 0.0 and qt.dot(n, left) + qt.dot(n, right) > 0.0


@kernel
def _best_at_edge(can, hull, x, e, many):
    """Largest separation of a cylinder from edge e: (separation [m], unit vector, kind); -inf if there is none."""
    p, d, left, right = hull_edge(0, hull, e, many)
    R, dims = rotation_of(can, many), many.bodies.body[can].dims
    y, w, best, n, kind = axis_of(R), minus(x, p), -math.inf, left, SIDE_AND_EDGE
    if qt.dot(left, y) * qt.dot(right, y) < 0.0:
        m = qt.cross(d, y)
        s = math.copysign(1.0 / math.sqrt(qt.dot(m, m)), qt.dot(m, left) + qt.dot(m, right))
        n = times(s, m)
        best = qt.dot(n, w) - dims[0]
    along = times(1.0 / math.sqrt(qt.dot(d, d)), d)
    for end in range(2):
        m = rim_line_normal(add_scaled(w, (2.0 * end - 1.0) * dims[1], y), y, dims[0], along)
        if _is_between(left, right, d, m):
            apart = qt.dot(m, w) - cylinder_support(can, R, m, many)
            if apart > best:
                best, n, kind = apart, m, RIM_AND_EDGE
    return best, n, kind


@kernel
def best_of_others(can, hull, x, many):
    """Best separation apart from faces: (separation [m], unit vector, kind, number of the end, edge or corner).

    An end is preferred to others unless they separate by more than rounding.
    """
    hulls, y, origin = many.narrowphase.hulls, axis_of(rotation_of(can, many)), row_vector(many.bodies.center, hull, 0)
    n, kind, index = times(-1.0, y), ON_END, 1
    best, other = _separation(can, hull, x, n, many), _separation(can, hull, x, y, many)
    if other > best:
        best, n, index = other, y, 0
    for e in range(hulls.of[hull, LAST_EDGE] - hulls.of[hull, FIRST_EDGE]):
        apart, m, found = _best_at_edge(can, hull, x, e, many)
        if apart > best:
            best, n, kind, index = apart, m, found, e
    for k in range(hulls.of[hull, LAST_CORNER] - hulls.of[hull, FIRST_CORNER]):
        _, m, _ = nearest_of_cylinder(can, plus(origin, row_vector(hulls.corner[0], k, 0)), many)
        m = times(-1.0, m)
        reach, corner = farthest_corner(hull, m, many)  # behind which corner k may lie
        apart = qt.dot(m, x) - cylinder_support(can, rotation_of(can, many), m, many) - reach
        if apart > best:
            best, n, kind, index = apart, m, AT_CORNER, corner
    return best, n, kind, index
