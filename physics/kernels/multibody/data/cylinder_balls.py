"""Contacts of a cylinder and a ball: the nearest point of the cylinder to a point, and how the normal turns.

The gap is the distance φ of the ball's centre from the cylinder, less its radius. The point of the cylinder slides over
its surface so that it stays the nearest one.
"""

from __future__ import annotations

import math

from physics.compiler.decorators import if_given, inlined, kernel
from physics.kernels.math import quaternion as qt
from physics.kernels.math.vector import minus, plus, row_vector, times
from physics.kernels.multibody.data.cylinders import is_cylinder
from physics.kernels.multibody.data.parts import body_of, center_velocity
from physics.kernels.state.layout import SPHERE


@inlined
def _rotation(b, many):
    R = many.bodies.rotation
    return (R[b, 0], R[b, 1], R[b, 2], R[b, 3], R[b, 4], R[b, 5], R[b, 6], R[b, 7], R[b, 8])


@inlined
def _from_side_and_end(dims, y):
    """Heights of a point y over the side and the end of a cylinder [m], and the direction from the axis."""
    across = math.sqrt(y[0] * y[0] + y[2] * y[2])
    out = (y[0] / across, 0.0, y[2] / across) if across > 0.0 else (1.0, 0.0, 0.0)
    return across - dims[0], abs(y[1]) - dims[1], out


@inlined
def nearest_in_frame(dims, y):
    """Nearest point of the surface of a cylinder to a point y: (distance, n, point), all in the frame of the cylinder.

    `dims` are its half extents. The distance is negative inside, where n leads the shortest way out.
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
def _nearest(can, x, many):
    """Do the work of `nearest_in_frame` for cylinder `can` and a point x; the normal is in the world frame."""
    d, R = many.bodies.body[can].dims, _rotation(can, many)
    y = qt.transposed_matvec(R, minus(x, row_vector(many.bodies.center, can, 0)))
    distance, n, p = nearest_in_frame((d[0], d[1], d[2]), y)
    return distance, qt.matvec(R, n), p


@kernel
def nearest_of_cylinder(can, x, many):
    """Nearest point of the surface of cylinder `can` to a point x: (distance, n out of it, point); negative inside."""
    distance, n, p = _nearest(can, x, many)
    return distance, n, plus(row_vector(many.bodies.center, can, 0), qt.matvec(_rotation(can, many), p))


@inlined
def _has_ball(a, b, many):
    """True if one of the parts a and b is a cylinder and the other one a sphere."""
    return (is_cylinder(a, many) and many.bodies.body[b].shape == SPHERE) or (
        is_cylinder(b, many) and many.bodies.body[a].shape == SPHERE
    )


def _same_normal(k, a, b, n, many):
    return n


@if_given("many.bodies.cylinders", _same_normal)
def normal_beside_cylinder(k, a, b, n, many):
    """Normal of contact k in the present poses of parts a and b, if they are a cylinder and a sphere, else n.

    The anchor of the cylinder moves to its nearest point.
    """
    if not _has_ball(a, b, many):
        return n
    is_first = is_cylinder(a, many)
    can, ball, first = (a, b, 0) if is_first else (b, a, 3)
    _, m, p = _nearest(can, row_vector(many.bodies.center, ball, 0), many)
    for c in range(3):
        many.contacts.anchor[k, first + c] = p[c]
    return times(-1.0, m) if is_first else m


@kernel
def _turn_beside(can, ball, many):
    """Acceleration of the gap of a ball besides those of the points of both bodies [m/s²].

    In the frame of the cylinder, which turns at ω, the ball's centre has the velocity u. The distance φ of the centre
    has the gradient n, and in u the second derivative n_r u_t²/ρ + u_m²/φ. Here t is along the rim, ρ the distance from
    the axis, n_r the part of n across the axis, and m across n and t. On the side the first term is left, with n_r = 1,
    and on an end none. Coriolis and centrifugal accelerations of the centre, φ n from the nearest point, are
    -2 n·(ω x u) and φ (ω² - (n·ω)²).
    """
    b, d, R = body_of(can, many), many.bodies.body[can].dims, _rotation(can, many)
    w, rho = (
        row_vector(many.bodies.twist, b, 3),
        minus(row_vector(many.bodies.center, ball, 0), row_vector(many.bodies.center, can, 0)),
    )
    u = minus(minus(center_velocity(ball, many), center_velocity(can, many)), qt.cross(w, rho))
    y, u, w = qt.transposed_matvec(R, rho), qt.transposed_matvec(R, u), qt.transposed_matvec(R, w)
    distance, n, _ = nearest_in_frame((d[0], d[1], d[2]), y)
    side, end, out = _from_side_and_end(d, y)
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

    It is the same target unless parts a and b, which is below 0 for a wall, are a cylinder and a sphere.
    """
    if b < 0 or not _has_ball(a, b, many):
        return target
    can, ball = (a, b) if is_cylinder(a, many) else (b, a)
    return (target[0] - time * _turn_beside(can, ball, many), target[1], target[2])
