"""Contacts of two balls, of which one or both are balls of capsules: their normal while the bodies move, and its turn.

The centre of such a ball is the centre of a sphere, or a place on the axis of a capsule. An end of the axis moves with
the capsule. A place between the ends slides along the axis, so that it stays the nearest one.
"""

from __future__ import annotations

import math

from physics.compiler.decorators import if_given, inlined, kernel
from physics.kernels.math import quaternion as qt
from physics.kernels.math.segments import nearest_place, nearest_places, point_on_segment
from physics.kernels.math.vector import minus, plus, row_vector, times
from physics.kernels.multibody.data.capsules import half_axis, half_length, is_capsule
from physics.kernels.multibody.data.parts import body_of, from_body
from physics.kernels.state.layout import SPHERE

# Place on an axis from which on it is an end, up to rounding.
_END = 1.0 - 1.0e-9

# Square of the sine of the angle between two axes below which their crossing point is too uncertain to follow.
_LEAST_SINE_SQUARED = 1.0e-4


@inlined
def _are_balls(a, b, many):
    """True if both bodies are capsules or spheres."""
    return (is_capsule(a, many) or many.bodies.body[a].shape == SPHERE) and (
        is_capsule(b, many) or many.bodies.body[b].shape == SPHERE
    )


@inlined
def _place(k, b, first, many):
    """Place on the axis of capsule b, from -1 to 1, of its ball in contact k; 0 for a sphere.

    `first` is the column of the body's anchor.
    """
    return many.contacts.anchor[k, first + 1] / half_length(b, many) if is_capsule(b, many) else 0.0


@inlined
def _slides(b, place, many):
    """True if the place of a contact slides along the axis of body b."""
    return is_capsule(b, many) and abs(place) < _END


def _same_normal(k, a, b, n, many):
    return n


@if_given("many.bodies.capsules", _same_normal)
def normal_between_axes(k, a, b, n, many):
    """Normal of contact k in the present poses of bodies a and b, if both have balls, else n.

    The anchors slide along the axes. n is the normal of the contact before the motion; bodies whose axes have passed
    through each other keep it.
    """
    if not _are_balls(a, b, many):
        return n
    x, u = row_vector(many.bodies.center, a, 0), half_axis(a, many)
    y, v = row_vector(many.bodies.center, b, 0), half_axis(b, many)
    s, t = _place(k, a, 0, many), _place(k, b, 3, many)
    one_slides, other_slides = _slides(a, s, many), _slides(b, t, many)
    if one_slides and other_slides:
        s, t, _ = nearest_places(x, u, y, v)
    elif one_slides:
        s = nearest_place(point_on_segment(y, v, t), x, u)
    elif other_slides:
        t = nearest_place(point_on_segment(x, u, s), y, v)
    if one_slides:
        many.contacts.anchor[k, 1] = s * half_length(a, many)
    if other_slides:
        many.contacts.anchor[k, 4] = t * half_length(b, many)
    d = minus(point_on_segment(x, u, s), point_on_segment(y, v, t))
    size = math.sqrt(qt.dot(d, d))
    if not qt.dot(d, n) > 0.0:
        return n
    return (d[0] / size, d[1] / size, d[2] / size)


@inlined
def _velocity_at(b, r, many):
    """Velocity of the point of a capsule or sphere b at r from its centre [m/s]."""
    r, b = from_body(b, r, many), body_of(b, many)
    return plus(row_vector(many.bodies.twist, b, 0), qt.cross(row_vector(many.bodies.twist, b, 3), r))


@inlined
def _turn_about_axis(b, u, n, w, distance, many):
    """Acceleration of the gap of a ball and the axis of capsule b, because the direction between them turns [m/s²].

    u is half the axis, n the normal, w the relative velocity of the ball's centre and the nearest point of the axis,
    and `distance` that of the two. In the frame of the capsule, the ball's centre moves at w' = w - ω x (distance n).
    Its distance from the axis has the acceleration w'ₜ²/distance for the direction t across axis and normal, besides
    the Coriolis and the centrifugal one. Together, with y along the axis, they are
    wₜ²/distance - 2 ωₜ w_y - ωₜ² distance.
    """
    y = times(1.0 / half_length(b, many), u)
    t = qt.cross(y, n)
    across, turn = qt.dot(w, t), qt.dot(row_vector(many.bodies.twist, body_of(b, many), 3), t)
    return across * across / distance - 2.0 * turn * qt.dot(w, y) - turn * turn * distance


@inlined
def _turn_of_crossing(a, b, u, v, n, w, distance, many):
    """Acceleration of the gap of two axes that cross, because their common normal n turns [m/s²].

    u and v are half the axes of a and b, w the relative velocity of their nearest points, and `distance` that of these.
    With unit vectors u and v, the normal turns at n' in their plane, with n'·u = -n·(ω_a x u) = -α and n'·v = -n·(ω_b x
    v) = -β. The nearest points slide at s' and t', for which w + s' u - t' v - distance n' is along n. Where they
    arrive, the axes move at α s' and β t' along n. So the acceleration is n'·w + α s' - β t'.
    """
    u, v = times(1.0 / half_length(a, many), u), times(1.0 / half_length(b, many), v)
    alpha = qt.dot(n, qt.cross(row_vector(many.bodies.twist, body_of(a, many), 3), u))
    beta = qt.dot(n, qt.cross(row_vector(many.bodies.twist, body_of(b, many), 3), v))
    c, along_u, along_v = qt.dot(u, v), qt.dot(w, u), qt.dot(w, v)
    square = 1.0 - c * c
    turn = (c * beta - alpha) * along_u + (c * alpha - beta) * along_v
    one, other = -distance * alpha - along_u, -distance * beta - along_v
    return (turn + alpha * (one - c * other) - beta * (c * one - other)) / square


@kernel
def _turn_between(k, a, b, many):
    """Acceleration of the gap of contact k, of bodies a and b, because the direction between their balls turns [m/s²].

    Axes that are nearly parallel cross nowhere; ends then touch instead, and the result is 0.
    """
    n, s, t = row_vector(many.contacts.frame, k, 0), _place(k, a, 0, many), _place(k, b, 3, many)
    u, v = half_axis(a, many), half_axis(b, many)
    p, q = times(s, u), times(t, v)
    w = minus(_velocity_at(a, p, many), _velocity_at(b, q, many))
    d = minus(plus(row_vector(many.bodies.center, a, 0), p), plus(row_vector(many.bodies.center, b, 0), q))
    distance = math.sqrt(qt.dot(d, d))
    one_slides, other_slides = _slides(a, s, many), _slides(b, t, many)
    if not distance > 0.0:
        return 0.0
    if one_slides and other_slides:
        m = qt.cross(u, v)
        if not qt.dot(m, m) > _LEAST_SINE_SQUARED * qt.dot(u, u) * qt.dot(v, v):
            return 0.0
        return _turn_of_crossing(a, b, u, v, n, w, distance, many)
    if one_slides:
        return _turn_about_axis(a, u, n, w, distance, many)
    if other_slides:
        return _turn_about_axis(b, v, n, w, distance, many)
    along = qt.dot(w, n)
    return (qt.dot(w, w) - along * along) / distance


def _same_target(k, a, b, time, target, many):
    return target


@if_given("many.bodies.capsules", _same_target)
def less_turn_of_axes(k, a, b, time, target, many):
    """Target velocity of contact k, less `time` [s] times the acceleration by which the normal's turn opens the gap.

    Parts a and b, which is below 0 for a wall, are those of the contact. It is the same target unless one of them is a
    capsule and both have balls.
    """
    if b < 0 or not (is_capsule(a, many) or is_capsule(b, many)) or not _are_balls(a, b, many):
        return target
    return (target[0] - time * _turn_between(k, a, b, many), target[1], target[2])
