"""Contacts of a convex polyhedron with a sphere, and with an ellipsoid."""

from __future__ import annotations

import math

from physics.compiler.decorators import inlined, kernel
from physics.kernels.math import quaternion as qt
from physics.kernels.math.vector import row_vector
from physics.kernels.multibody.data.contact_set import (
    add_ordered_contact,
    add_scaled,
    row_matrix,
    subtract,
    tangent_basis,
)
from physics.kernels.multibody.data.hull_tables import (
    FIRST_CORNER,
    FIRST_EDGE,
    FIRST_FACE,
    LAST_CORNER,
    LAST_EDGE,
    LAST_FACE,
)
from physics.kernels.multibody.narrowphase.ellipsoid_distance import (
    ellipsoid_matrix,
    ellipsoid_support_point,
    max_separation_direction,
    nearest_on_block,
    relative_rotation,
)
from physics.kernels.multibody.narrowphase.hull_hull import hull_edge
from physics.kernels.multibody.narrowphase.hull_pose import is_above_face, nearest_on_face, pose_hull
from physics.kernels.state.layout import ELLIPSOID, SPHERE

_NO_ELLIPSOID = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


@inlined
def nearest_on_hull(b, x, many):
    """Find the point of a hull's surface nearest to a point x: (point, outward unit normal, distance [m]).

    Hull b is number 0 of the pair, and x is in the coordinates of the pair (`hull_pose`). The distance is negative for
    x inside, where the shortest way out is through the nearest face. For x outside, the nearest point y is on a face
    whose plane is below x: x - y is a combination of the normals of the faces that meet at y, so that one of them
    points towards x.
    """
    hulls, best, face = many.narrowphase.hulls, -math.inf, 0
    for f in range(hulls.of[b, LAST_FACE] - hulls.of[b, FIRST_FACE]):
        height = qt.dot(row_vector(hulls.normal[0], f, 0), x) - hulls.offset[0, f]
        if height > best:
            best, face = height, f
    n = row_vector(hulls.normal[0], face, 0)
    y, distance = add_scaled(x, -best, n), best
    if best > 0.0:
        square = math.inf
        for f in range(hulls.of[b, LAST_FACE] - hulls.of[b, FIRST_FACE]):
            if qt.dot(row_vector(hulls.normal[0], f, 0), x) > hulls.offset[0, f]:
                near = nearest_on_face(0, b, f, x, many)
                w = subtract(x, near)
                if 0.0 < qt.dot(w, w) < square:
                    square, y = qt.dot(w, w), near
                    distance = math.sqrt(square)
                    n = (w[0] / distance, w[1] / distance, w[2] / distance)
    return y, n, distance


@kernel
def collide_sphere_hull(a, b, margin, h, many):
    """Add the contact of a sphere and a hull if their gap is at most `margin` [m].

    a and b are the two bodies in either order; h is the length of the stage [s].
    """
    ball, hull = a, b
    if many.bodies.body[b].shape == SPHERE:
        ball, hull = b, a
    origin, r = row_vector(many.bodies.center, hull, 0), many.bodies.body[ball].dims[0]
    x = row_vector(many.bodies.center, ball, 0)
    pose_hull(0, hull, origin, many)
    y, n, distance = nearest_on_hull(hull, subtract(x, origin), many)
    if distance - r > margin:
        return
    add_ordered_contact(a, b, ball, n, add_scaled(x, -r, n), add_scaled(origin, 1.0, y), distance - r, h, many)


@inlined
def hull_separation(hull, A, way, n, many):
    """Separation σ(n) of an ellipsoid and a hull along the unit vector n [m], as in `ellipsoid_distance`.

    The hull is number 0 of the pair. The ellipsoid has its centre at `way`, in the coordinates of the pair, and the
    matrix A (`ellipsoid_matrix`).
    """
    hulls, reach = many.narrowphase.hulls, -math.inf
    for k in range(hulls.of[hull, LAST_CORNER] - hulls.of[hull, FIRST_CORNER]):
        reach = max(reach, qt.dot(n, row_vector(hulls.corner[0], k, 0)))
    return qt.dot(n, way) - ellipsoid_support_point(A, n)[0] - reach


@inlined
def direction_from_edge(e, hull, S, dims, way, many):
    """Unit vector along which an ellipsoid is farthest apart from edge e of a hull, out of the hull.

    The hull is number 0 of the pair. The ellipsoid has rotation matrix S, semi-axes `dims` [m] and its centre at `way`,
    in the coordinates of the pair. `max_separation_direction` treats the edge as a block without width and height.
    """
    p, d, _, _ = hull_edge(0, hull, e, many)
    half = 0.5 * math.sqrt(qt.dot(d, d))
    u = (0.5 * d[0] / half, 0.5 * d[1] / half, 0.5 * d[2] / half)
    v, w = tangent_basis(u)
    E = (u[0], v[0], w[0], u[1], v[1], w[1], u[2], v[2], w[2])
    there = qt.transposed_matvec(E, subtract(way, add_scaled(p, 0.5, d)))
    segment = (half, 0.0, 0.0)
    start = nearest_on_block(there, segment)[1]
    n, _ = max_separation_direction(
        ellipsoid_matrix(relative_rotation(E, S), dims), True, _NO_ELLIPSOID, segment, there, start
    )
    return qt.matvec(E, n)


@kernel
def collide_ellipsoid_hull(a, b, margin, h, many):
    """Add the contact of an ellipsoid and a hull if their gap is at most `margin` [m].

    a and b are the two bodies in either order; h is the length of the stage [s].

    The contact normal is the direction of the largest separation, as in `ellipsoid_distance`. The first candidate is
    the normal of the face farthest from the ellipsoid. If the ellipsoid's nearest point lies over that face, this is
    the answer. If not, the nearest point of the hull is on an edge, and every edge gives a candidate. All candidates
    are measured against the whole hull, and the largest separation wins. If the bodies overlap, the edges may give no
    useful candidate, and the face is the way out.
    """
    round_, hull = a, b
    if many.bodies.body[b].shape == ELLIPSOID:
        round_, hull = b, a
    hulls, origin, size = (
        many.narrowphase.hulls,
        row_vector(many.bodies.center, hull, 0),
        many.bodies.body[round_].dims,
    )
    pose_hull(0, hull, origin, many)
    way, S, dims = (
        subtract(row_vector(many.bodies.center, round_, 0), origin),
        row_matrix(many.bodies.rotation, round_),
        (size[0], size[1], size[2]),
    )
    A, best, face = ellipsoid_matrix(S, dims), -math.inf, 0
    for f in range(hulls.of[hull, LAST_FACE] - hulls.of[hull, FIRST_FACE]):
        m = row_vector(hulls.normal[0], f, 0)
        gap = qt.dot(m, way) - ellipsoid_support_point(A, m)[0] - hulls.offset[0, f]
        if gap > best:
            best, face = gap, f
    if best > margin:
        return
    n = row_vector(hulls.normal[0], face, 0)
    if not is_above_face(0, hull, face, subtract(way, ellipsoid_support_point(A, n)[1]), many):
        for e in range(hulls.of[hull, LAST_EDGE] - hulls.of[hull, FIRST_EDGE]):
            m = direction_from_edge(e, hull, S, dims, way, many)
            gap = hull_separation(hull, A, way, m, many)
            if gap > best:
                best, n = gap, m
    if best > margin:
        return
    on_round = add_scaled(origin, 1.0, subtract(way, ellipsoid_support_point(A, n)[1]))
    on_hull = add_scaled(on_round, -best, n)
    add_ordered_contact(a, b, round_, n, on_round, on_hull, best, h, many)
