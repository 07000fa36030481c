"""Contacts of a cylinder and a ball: the nearest point of the cylinder to a point, and how the normal turns.

The gap is the distance φ of the ball's centre from the cylinder, less its radius. The point of the cylinder slides over
its surface so that it stays the nearest one. The ball is a sphere, one about a point of a capsule's axis, or a point of
a polyhedron beside the side of the cylinder, of which its body carries the centre along. Where two sides are beside
each other, it is a ball about a point of the second axis.
"""

from __future__ import annotations

import math

from physics.compiler.decorators import if_given, inlined, kernel
from physics.kernels.math import quaternion as qt
from physics.kernels.math.vector import minus, plus, row_vector, times
from physics.kernels.multibody.data.arrays import FEATURES_PER_PAIR
from physics.kernels.multibody.data.capsules import is_capsule
from physics.kernels.multibody.data.cylinders import (
    BESIDE_FEATURE,
    SINGLE_FEATURE,
    axis_of,
    is_cylinder,
    rotation_of,
)
from physics.kernels.multibody.data.parts import body_of, center_velocity, first_part
from physics.kernels.state.layout import SPHERE


@inlined
def _from_side_and_end(dims, y):
    """Heights of a point y over the side and the end of a cylinder [m], and the direction from the axis."""
    across = math.sqrt(y[0] * y[0] + y[2] * y[2])
    out = (y[0] / across, 0.0, y[2] / across) if across > 0.0 else (1.0, 0.0, 0.0)
    return across - dims[0], abs(y[1]) - dims[1], out


@inlined
def nearest_in_frame(dims, y):
    """Nearest point of the surface of a cylinder to a point y: (distance, n, point), all in the frame of the cylinder.

    `dims` are its half extents, of which half the length may be infinite. The distance is negative inside, where n
    leads the shortest way out.
    """
    side, end, out = _from_side_and_end(dims, y)
    sign = math.copysign(1.0, y[1])
    if side > 0.0 and end > 0.0:
        distance = math.sqrt(side * side + end * end)
        n = (side / distance * out[0], sign * end / distance, side / distance * out[2])
        return distance, n, (dims[0] * out[0], sign * dims[1], dims[0] * out[2])
    if side > end:
        return side, out, (dims[0] * out[0], y[1], dims[0] * out[2])
    return end, (0.0, sign, 0.0), (y[0], sign * dims[1], y[2])


@inlined
def _nearest(can, x, is_beside, many):
    """Do the work of `nearest_in_frame` for cylinder `can` and a point x; the normal is in the world frame.

    If `is_beside`, it is the nearest point of the side, which goes on beyond the ends.
    """
    d, R = many.bodies.body[can].dims, rotation_of(can, many)
    y = qt.transposed_matvec(R, minus(x, row_vector(many.bodies.center, can, 0)))
    distance, n, p = nearest_in_frame((d[0], math.inf if is_beside else d[1], d[2]), y)
    return distance, qt.matvec(R, n), p


@kernel
def nearest_of_cylinder(can, x, many):
    """Nearest point of the surface of cylinder `can` to a point x: (distance, n out of it, point); negative inside."""
    distance, n, p = _nearest(can, x, False, many)
    return distance, n, plus(row_vector(many.bodies.center, can, 0), qt.matvec(rotation_of(can, many), p))


@inlined
def _is_beside(k, many):
    """True if contact k is that of a point of a polyhedron beside the side of a cylinder."""
    return BESIDE_FEATURE <= many.contacts.id[k] % FEATURES_PER_PAIR < SINGLE_FEATURE


@inlined
def _cylinder_and_ball(k, a, b, many):
    """Find (cylinder, ball) among parts a and b of contact k, or (-1, -1) if they are no such pair."""
    can, ball = a, b
    if not is_cylinder(a, many):
        can, ball = b, a
    is_ball = is_cylinder(can, many) and many.contacts.owner[k] == -1
    is_ball = is_ball and (many.bodies.body[ball].shape == SPHERE or is_capsule(ball, many) or _is_beside(k, many))
    return (can, ball) if is_ball else (-1, -1)


@inlined
def ball_arm(k, ball, first, many):
    """Centre of the ball of contact k from the centre of its part, world frame [m]; `first` is its anchor's column."""
    if many.bodies.body[ball].shape == SPHERE:
        return (0.0, 0.0, 0.0)
    if is_cylinder(ball, many):
        return times(many.contacts.anchor[k, first + 1], axis_of(rotation_of(ball, many)))
    return qt.matvec(rotation_of(ball, many), row_vector(many.contacts.anchor, k, first))


@if_given("many.bodies.cylinders", False)
def is_beside_cylinder(k, b, first, many):
    """True if part b is the second one of two cylinders whose sides are beside each other in contact k.

    `first` is the column of its anchor. Its point stays under a point of its axis, as that of a capsule.
    """
    if first == 0 or not (is_cylinder(b, many) and many.contacts.owner[k] == -1 and _is_beside(k, many)):
        return False
    return is_cylinder(first_part(k, many), many)


def _same_normal(k, a, b, n, many):
    return n


@if_given("many.bodies.cylinders", _same_normal)
def normal_beside_cylinder(k, a, b, n, many):
    """Normal of contact k in the present poses of parts a and b, if they are a cylinder and a ball, else n.

    The anchor of the cylinder moves to its nearest point.
    """
    can, ball = _cylinder_and_ball(k, a, b, many)
    if can < 0:
        return n
    first, other = (0, 3) if can == a else (3, 0)
    x = plus(row_vector(many.bodies.center, ball, 0), ball_arm(k, ball, other, many))
    _, m, p = _nearest(can, x, _is_beside(k, many), many)
    for c in range(3):
        many.contacts.anchor[k, first + c] = p[c]
    return times(-1.0, m) if can == a else m


@kernel
def _turn_beside(can, ball, arm, is_beside, many):
    """Acceleration of the gap of a ball besides those of the points of both bodies [m/s²].

    `arm` leads to the ball's centre from that of its part. In the frame of the cylinder, which turns at ω, the centre
    has the velocity u. Its distance φ has the gradient n, and in u the second derivative n_r u_t²/ρ + u_m²/φ. Here t is
    along the rim, ρ the distance from the axis, n_r the part of n across the axis, and m across n and t. On the side
    the first term is left, with n_r = 1, and on an end none. Coriolis and centrifugal accelerations of the centre, φ n
    from the nearest point, are -2 n·(ω x u) and φ (ω² - (n·ω)²).
    """
    b, d, R = body_of(can, many), many.bodies.body[can].dims, rotation_of(can, many)
    dims = (d[0], math.inf if is_beside else d[1], d[2])
    w, x = row_vector(many.bodies.twist, b, 3), plus(row_vector(many.bodies.center, ball, 0), arm)
    rho = minus(x, row_vector(many.bodies.center, can, 0))
    v = plus(center_velocity(ball, many), qt.cross(row_vector(many.bodies.twist, body_of(ball, many), 3), arm))
    u = minus(minus(v, center_velocity(can, many)), qt.cross(w, rho))
    y, u, w = qt.transposed_matvec(R, rho), qt.transposed_matvec(R, u), qt.transposed_matvec(R, w)
    distance, n, _ = nearest_in_frame(dims, y)
    side, end, out = _from_side_and_end(dims, y)
    bent = 0.0
    if side > 0.0 or side > end:
        along = out[0] * u[2] - out[2] * u[0]
        bent = qt.dot(n, out) * along * along / (side + d[0])
    if side > 0.0 and end > 0.0:
        t = (-out[2], 0.0, out[0])
        away = qt.dot(u, qt.cross(n, t))
        bent += away * away / distance
    spin = qt.dot(n, w)
    return bent - 2.0 * qt.dot(n, qt.cross(w, u)) + distance * (qt.dot(w, w) - spin * spin)


def _same_target(k, a, b, time, target, many):
    return target


@if_given("many.bodies.cylinders", _same_target)
def less_turn_beside_cylinder(k, a, b, time, target, many):
    """Target velocity of contact k, less `time` [s] times the acceleration by which the normal's turn opens the gap.

    It is the same target unless parts a and b, which is below 0 for a wall, are a cylinder and a ball.
    """
    if b < 0:
        return target
    can, ball = _cylinder_and_ball(k, a, b, many)
    if can < 0:
        return target
    arm = ball_arm(k, ball, 3 if can == a else 0, many)
    return (target[0] - time * _turn_beside(can, ball, arm, _is_beside(k, many), many), target[1], target[2])
