"""Contacts of a capsule with a wall, a sphere, another capsule and an ellipsoid.

A capsule touches with balls about points of its axis. Every contact is that of such a ball: of an end of the axis, or
of the point at which the axis passes another body. So a capsule that lies on something has two contacts, and each of
them has the gap and the normal of its own ball.
"""

from __future__ import annotations

import math

from physics.compiler.decorators import if_given, inlined, kernel
from physics.kernels.math import quaternion as qt
from physics.kernels.math.segments import nearest_place, nearest_places, point_on_segment
from physics.kernels.math.vector import minus, plus, row_vector
from physics.kernels.multibody.data.capsules import half_axis, half_length, is_capsule
from physics.kernels.multibody.data.contact_set import (
    add_contact,
    add_ordered_contact,
    add_scaled,
    row_matrix,
    tangent_basis,
)
from physics.kernels.multibody.narrowphase.ellipsoid_distance import (
    ellipsoid_matrix,
    ellipsoid_support_point,
    max_separation_direction,
    nearest_on_block,
    relative_rotation,
)
from physics.kernels.state.layout import WALL_NORMAL, WALL_OFFSET

_NO_ELLIPSOID = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)

# Features of a contact of two capsules: an end of the first axis, of the second one, an end of each, no end.
_SECOND_END, _BOTH_ENDS, _CROSSING = 2, 4, 8


@if_given("many.bodies.capsules", False)
def collide_capsule_wall(b, wall, margin, h, many):
    """Add the contacts of body b with a wall, if b is a capsule; return whether it is one.

    Both ends of the axis have a contact whose gap is at most `margin` [m]. h is the length of the stage [s].
    """
    if not is_capsule(b, many):
        return False
    n, r = row_vector(many.walls, wall, WALL_NORMAL), many.bodies.body[b].dims[0]
    for end in range(2):
        p = point_on_segment(row_vector(many.bodies.center, b, 0), half_axis(b, many), 2.0 * end - 1.0)
        gap = qt.dot(n, p) - many.walls[wall, WALL_OFFSET] - r
        if gap <= margin:
            point = add_scaled(p, -r, n)
            add_contact(b, -1 - wall, end, -1, n, (point, point), gap, h, many)
    return True


@inlined
def direction_between(p, q, u, v):
    """Distance of two points, and the unit vector from q to p; if they coincide, one across both directions u and v."""
    d = minus(p, q)
    size = math.sqrt(qt.dot(d, d))
    if size > 0.0:
        return size, (d[0] / size, d[1] / size, d[2] / size)
    n = qt.cross(u, v)
    square = qt.dot(n, n)
    if square > 0.0:
        s = 1.0 / math.sqrt(square)
        return size, (s * n[0], s * n[1], s * n[2])
    s = 1.0 / math.sqrt(qt.dot(u, u))
    return size, tangent_basis((s * u[0], s * u[1], s * u[2]))[0]


@kernel
def collide_capsule_sphere(capsule, ball, a, b, margin, h, many):
    """Add the contact of a capsule and a sphere, which are bodies a and b in either order.

    Their gap is at most `margin` [m]; h is the length of the stage [s].
    """
    center, u = many.bodies.center, half_axis(capsule, many)
    x, p = row_vector(center, ball, 0), row_vector(center, capsule, 0)
    q = point_on_segment(p, u, nearest_place(x, p, u))
    distance, n = direction_between(x, q, u, u)
    r, R = many.bodies.body[ball].dims[0], many.bodies.body[capsule].dims[0]
    gap = distance - r - R
    if gap <= margin:
        add_ordered_contact(a, b, ball, n, add_scaled(x, -r, n), add_scaled(q, R, n), gap, h, many)


@inlined
def _add_balls(a, b, feature, p, q, margin, h, many):
    """Add the contact of the balls of capsules a and b about the points p and q of their axes, if it is near enough."""
    distance, n = direction_between(p, q, half_axis(a, many), half_axis(b, many))
    one, other = many.bodies.body[a].dims[0], many.bodies.body[b].dims[0]
    gap = distance - one - other
    if gap <= margin:
        add_contact(a, b, feature, -1, n, (add_scaled(p, -one, n), add_scaled(q, other, n)), gap, h, many)


@kernel
def collide_capsules(a, b, margin, h, many):
    """Add the contacts of capsules a and b whose gaps are at most `margin` [m]; h is the length of the stage [s].

    They are those of the ends of each axis that lie beside the other axis, of two ends that are nearest to each other,
    and of the points at which the axes cross.
    """
    x, u = row_vector(many.bodies.center, a, 0), half_axis(a, many)
    y, v = row_vector(many.bodies.center, b, 0), half_axis(b, many)
    for end in range(2):
        side = 2.0 * end - 1.0
        p, q = point_on_segment(x, u, side), point_on_segment(y, v, side)
        t, s = nearest_place(p, y, v), nearest_place(q, x, u)
        if abs(t) < 1.0:
            _add_balls(a, b, end, p, point_on_segment(y, v, t), margin, h, many)
        if abs(s) < 1.0:
            _add_balls(a, b, _SECOND_END + end, point_on_segment(x, u, s), q, margin, h, many)
        if abs(t) == 1.0:
            q = point_on_segment(y, v, t)
            if nearest_place(q, x, u) == side:
                other = 1 if t > 0.0 else 0
                _add_balls(a, b, _BOTH_ENDS + 2 * end + other, p, q, margin, h, many)
    s, t, is_crossing = nearest_places(x, u, y, v)
    if is_crossing and abs(s) < 1.0 and abs(t) < 1.0:
        _add_balls(a, b, _CROSSING, point_on_segment(x, u, s), point_on_segment(y, v, t), margin, h, many)


@kernel
def nearest_of_capsule_ellipsoid(capsule, round_, many):
    """Nearest points of a capsule and an ellipsoid: (gap [m], unit vector out of the capsule, point of the ellipsoid).

    The axis is a block without width for `ellipsoid_distance`; the radius is subtracted from its distance.
    """
    R, x = row_matrix(many.bodies.rotation, capsule), row_vector(many.bodies.center, capsule, 0)
    d, segment = many.bodies.body[round_].dims, (0.0, half_length(capsule, many), 0.0)
    way = qt.transposed_matvec(R, minus(row_vector(many.bodies.center, round_, 0), x))
    A = ellipsoid_matrix(relative_rotation(R, row_matrix(many.bodies.rotation, round_)), (d[0], d[1], d[2]))
    n, gap = max_separation_direction(A, True, _NO_ELLIPSOID, segment, way, nearest_on_block(way, segment)[1])
    point = plus(x, qt.matvec(R, minus(way, ellipsoid_support_point(A, n)[1])))
    return gap - many.bodies.body[capsule].dims[0], qt.matvec(R, n), point


@kernel
def collide_capsule_ellipsoid(capsule, round_, a, b, margin, h, many):
    """Add the contact of a capsule and an ellipsoid, which are bodies a and b in either order.

    Their gap is at most `margin` [m]; h is the length of the stage [s].
    """
    gap, n, point = nearest_of_capsule_ellipsoid(capsule, round_, many)
    if gap <= margin:
        add_ordered_contact(a, b, round_, n, point, add_scaled(point, -gap, n), gap, h, many)
