"""Friction with two coefficients where bodies touch each other: contact frames along the axes, stretched.

`contact_law.anisotropic_friction` turns elliptic cones into circular ones by stretched tangents. Here solvers take the
Jacobian from the contact frames (normal, tangents) alone. So the frames have their first tangent along the axis of
μ1, and the second one has the length μ2/μ1. Velocities, targets and impulses p of contacts are then those of a problem
with circular cones. The impulse in the world frame stays Eᵀ p for a frame E. The inverse needs the square of the
stretch (`less_stretch`).

The axis of a contact is, in this order,

1. that of its first body, of those of the scene, with an axis of its own, which turns with the body;
2. that of its wall; between two bodies the scene's, along the contact plane;
3. any direction, if the axis is along the normal.

All of this is left out of kernels whose scene has one coefficient: `many.grain` is None there.
"""

from __future__ import annotations

import math

from physics.compiler.decorators import if_given, inlined
from physics.kernels.contact_law.anisotropic_friction import friction_ratio
from physics.kernels.math import quaternion as qt
from physics.kernels.math.vector import as_vector, minus, row_vector, times
from physics.kernels.multibody.data.fixed_bodies import body_at
from physics.kernels.state.layout import WALL_TANGENT_1

# An axis counts as being along the normal if its component along the contact plane is shorter than this.
_LEAST_SINE = 1.0e-6


@inlined
def _own_axis(b, many):
    """Axis of body b, world frame; 0 if it has none of its own."""
    a, R = row_vector(many.grain.body_axis, b, 0), many.bodies.rotation
    return (
        R[b, 0] * a[0] + R[b, 1] * a[1] + R[b, 2] * a[2],
        R[b, 3] * a[0] + R[b, 4] * a[1] + R[b, 5] * a[2],
        R[b, 6] * a[0] + R[b, 7] * a[1] + R[b, 8] * a[2],
    )


@inlined
def _axis(k, many):
    """Axis of contact k, world frame; the head of this module has the order of those that it may have."""
    a, end = many.contacts.bodies[k, 0], many.contacts.bodies[k, 1]
    b = body_at(end, many)
    first, second = (b, a) if 0 <= b < a else (a, b)
    axis = _own_axis(first, many)
    if second >= 0 and not qt.dot(axis, axis) > 0.0:
        axis = _own_axis(second, many)
    if qt.dot(axis, axis) > 0.0:
        return axis
    if b < 0:
        return row_vector(many.walls, -1 - end, WALL_TANGENT_1)
    return as_vector(many.grain.axis)


def _even_tangents(k, n, t1, t2, many):
    return t1, t2


@if_given("many.grain", _even_tangents)
def grain_tangents(k, n, t1, t2, many):
    """Tangents of contact k with the normal n: along the axis of its friction, and across it, stretched.

    t1 and t2 complete n to a right-handed frame; t2 may have any length.
    """
    axis = _axis(k, many)
    along = minus(axis, times(qt.dot(n, axis), n))
    size = math.sqrt(qt.dot(along, along))
    if size > _LEAST_SINE:
        t1 = times(1.0 / size, along)
    return t1, times(friction_ratio(many.bodies.body[many.contacts.bodies[k, 0]]), qt.cross(n, t1))


def _as_it_is(k, p, many):
    return p


@if_given("many.grain", _as_it_is)
def stretched_inv_mass(k, m, many):
    """Inverse mass m of a body along the stretched tangent of contact k: m times the square of its length."""
    ratio = friction_ratio(many.bodies.body[many.contacts.bodies[k, 0]])
    return ratio * ratio * m


@if_given("many.grain", _as_it_is)
def less_stretch(k, p, many):
    """Impulse of contact k in its frame, from the product p of the frame and the impulse in the world frame."""
    ratio = friction_ratio(many.bodies.body[many.contacts.bodies[k, 0]])
    return p[0], p[1], p[2] / (ratio * ratio)
