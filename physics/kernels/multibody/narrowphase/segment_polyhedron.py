"""Distance of a segment x + s u, -1 <= s <= 1, and a convex polyhedron.

The polyhedron is number 0 of the pair, and vectors are in the coordinates of the pair (`hull_pose`). `many` is the
workspace of a step, or the scratch of a query.
"""

from __future__ import annotations

import math

from physics.compiler.decorators import inlined, kernel
from physics.kernels.math import quaternion as qt
from physics.kernels.math.segments import nearest_places, point_on_segment
from physics.kernels.math.vector import minus, row_vector
from physics.kernels.multibody.data.contact_set import add_scaled
from physics.kernels.multibody.data.hull_tables import FIRST_EDGE, FIRST_FACE, LAST_EDGE, LAST_FACE
from physics.kernels.multibody.narrowphase.hull_ellipsoid import nearest_on_hull
from physics.kernels.multibody.narrowphase.hull_hull import hull_edge


@kernel
def part_inside(hull, x, u, many):
    """Part of a segment inside a polyhedron: (first place, last place); the first is larger if nothing is inside."""
    hulls, first, last = many.narrowphase.hulls, -1.0, 1.0
    for f in range(hulls.of[hull, LAST_FACE] - hulls.of[hull, FIRST_FACE]):
        n = row_vector(hulls.normal[0], f, 0)
        room, slope = hulls.offset[0, f] - qt.dot(n, x), qt.dot(n, u)
        if slope > 0.0:
            last = min(last, room / slope)
        elif slope < 0.0:
            first = max(first, room / slope)
        elif room < 0.0:
            return 1.0, -1.0
    return first, last


@kernel
def segment_separation(hull, x, u, many):
    """Largest separation of a segment and a polyhedron: (separation [m], unit vector out of the polyhedron).

    It is negative where they overlap, and then the shortest way that separates them. The direction is the normal of a
    face, or that of an edge and the segment, if it lies between the normals of the edge's two faces.
    """
    hulls, best, out = many.narrowphase.hulls, -math.inf, (0.0, 0.0, 0.0)
    for f in range(hulls.of[hull, LAST_FACE] - hulls.of[hull, FIRST_FACE]):
        n = row_vector(hulls.normal[0], f, 0)
        apart = qt.dot(n, x) - abs(qt.dot(n, u)) - hulls.offset[0, f]
        if apart > best:
            best, out = apart, n
    for e in range(hulls.of[hull, LAST_EDGE] - hulls.of[hull, FIRST_EDGE]):
        p, d, left, right = hull_edge(0, hull, e, many)
        if not qt.dot(left, u) * qt.dot(right, u) < 0.0:
            continue
        n = qt.cross(d, u)
        s = math.copysign(1.0 / math.sqrt(qt.dot(n, n)), qt.dot(n, left) + qt.dot(n, right))
        n = (s * n[0], s * n[1], s * n[2])
        apart = qt.dot(n, minus(x, p))
        if apart > best:
            best, out = apart, n
    return best, out


@inlined
def edge_segment(hull, e, many):
    """Edge e of a polyhedron as a segment: (middle, vector from there to an end) [m]."""
    p, d, _, _ = hull_edge(0, hull, e, many)
    return add_scaled(p, 0.5, d), (0.5 * d[0], 0.5 * d[1], 0.5 * d[2])


@kernel
def nearest_of_segment(hull, x, u, many):
    """Nearest points of a segment and a polyhedron that do not overlap: (distance [m], n, place, point).

    n is the unit vector out of the polyhedron, the place is that on the segment, and the point that of the polyhedron.
    An end of the segment is nearest to any feature, or the segment passes an edge.
    """
    best, place, out, point = math.inf, 0.0, (0.0, 1.0, 0.0), x
    for end in range(2):
        y, n, distance = nearest_on_hull(hull, point_on_segment(x, u, 2.0 * end - 1.0), many)
        if distance < best:
            best, place, out, point = distance, 2.0 * end - 1.0, n, y
    for e in range(many.narrowphase.hulls.of[hull, LAST_EDGE] - many.narrowphase.hulls.of[hull, FIRST_EDGE]):
        p, d = edge_segment(hull, e, many)
        s, t, _ = nearest_places(x, u, p, d)
        q = point_on_segment(p, d, t)
        w = minus(point_on_segment(x, u, s), q)
        square = qt.dot(w, w)
        if 0.0 < square < best * best:
            best, place, point = math.sqrt(square), s, q
            out = (w[0] / best, w[1] / best, w[2] / best)
    return best, out, place, point
