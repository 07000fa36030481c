"""Cylinders: their support function, and the rim point that is nearest to a plane, which rolls along the rim.

The dimensions of a cylinder are its half extents (r, l, r), with its axis along body y. Its two rims are circles of
radius r about the ends of the axis. Contacts of a cylinder have two kinds of points, told by their feature:

- 0 and 1 are the points of the lower and the upper rim that reach farthest towards the other body. They roll along the
  rim as the cylinder turns.
- Others are fixed in the body.

All of this is left out of kernels whose scene has no cylinder.
"""

from __future__ import annotations

import math

from physics.compiler.decorators import if_given, inlined
from physics.kernels.math import quaternion as qt
from physics.kernels.math.vector import minus, plus, row_vector, times
from physics.kernels.multibody.data.parts import body_of
from physics.kernels.state.layout import CYLINDER

# Features of a contact of a cylinder below this number are rolling points: 0 of the lower rim, 1 of the upper one.
ROLLING_FEATURES = 2

# Square of the sine of the tilt of a cylinder below which no rim point is the lowest: rounding of unit vectors.
_LEAST_SINE_SQUARED = 1.0e-30


@if_given("many.bodies.cylinders", False)
def is_cylinder(b, many):
    """True if body or part b is a cylinder."""
    return many.bodies.body[b].shape == CYLINDER


def _without_cylinders(many):
    return False


@if_given("many.bodies.cylinders", _without_cylinders)
def has_cylinders(many):
    """True in a world with cylinders."""
    return True


@inlined
def axis_of(R):
    """Unit vector along the axis of a cylinder with the rotation matrix R, world frame."""
    return (R[1], R[4], R[7])


@inlined
def across_axis(axis, k):
    """Part of the vector k across the unit vector `axis`."""
    return minus(k, times(qt.dot(axis, k), axis))


@inlined
def cylinder_support(b, R, k, many):
    """Support function of cylinder b for a vector k of any length [m]: l |k·y| + r |k - (k·y) y|, with its axis y."""
    d, y = many.bodies.body[b].dims, axis_of(R)
    p = across_axis(y, k)
    return d[1] * abs(qt.dot(y, k)) + d[0] * math.sqrt(qt.dot(p, p))


@inlined
def cylinder_half_extent(dims, y):
    """Half the width of a cylinder along a direction that has the component y along its axis [m]."""
    return dims[1] * abs(y) + dims[0] * math.sqrt(max(0.0, 1.0 - y * y))


@inlined
def cylinder_support_arm(dims, R, k):
    """Point of a cylinder that reaches farthest along the vector k, from its centre, world frame [m].

    `dims` are its half extents, of which the first two are read.
    """
    y = axis_of(R)
    arm, p = times(math.copysign(dims[1], qt.dot(y, k)), y), across_axis(y, k)
    square = qt.dot(p, p)
    return plus(arm, times(dims[0] / math.sqrt(square), p)) if square > 0.0 else arm


@inlined
def rim_arm(b, end, R, k, many):
    """Point of a rim of cylinder b that reaches farthest along the unit vector k, from its centre, world frame [m].

    `end` is 0 for the lower rim, 1 for the upper one. Where all points of the rim reach equally far, it is the centre
    of the rim.
    """
    d, y = many.bodies.body[b].dims, axis_of(R)
    arm, p = times((2.0 * end - 1.0) * d[1], y), across_axis(y, k)
    square = qt.dot(p, p)
    return plus(arm, times(d[0] / math.sqrt(square), p)) if square > _LEAST_SINE_SQUARED else arm


@inlined
def rim_arm_rate(b, end, R, w, k, many):
    """Velocity of the point of `rim_arm`, as it rolls along the rim while k stays as it is [m/s].

    The cylinder turns at w. Its axis y has the rate y' = w x y. The point is at ±l y + r p/|p| with p = k - (k·y) y,
    so that p' = -(k·y') y - (k·y) y' and (p/|p|)' is the part of p'/|p| across p.
    """
    d, y = many.bodies.body[b].dims, axis_of(R)
    turn = qt.cross(w, y)
    rate, p = times((2.0 * end - 1.0) * d[1], turn), across_axis(y, k)
    square = qt.dot(p, p)
    if not square > _LEAST_SINE_SQUARED:
        return rate
    change = minus(times(-qt.dot(k, turn), y), times(qt.dot(k, y), turn))
    change = minus(change, times(qt.dot(change, p) / square, p))
    return plus(rate, times(d[0] / math.sqrt(square), change))


@inlined
def _free_angular_acceleration(b, many):
    """Angular acceleration α = -I⁻¹ (ω x I ω) of body b as it turns freely at its present twist, world frame [rad/s²].

    I is the inverse of the symmetric matrix A = I⁻¹, by its cofactors.
    """
    w, A = row_vector(many.bodies.twist, b, 3), many.bodies.inv_inertia
    xx, xy, xz = A[b, 0], A[b, 1], A[b, 2]
    yy, yz, zz = A[b, 3], A[b, 4], A[b, 5]
    rows = (xx, xy, xz), (xy, yy, yz), (xz, yz, zz)
    one, two, three = qt.cross(rows[1], rows[2]), qt.cross(rows[2], rows[0]), qt.cross(rows[0], rows[1])
    whole = qt.dot(rows[0], one)
    if not whole > 0.0:
        return (0.0, 0.0, 0.0)
    L = times(1.0 / whole, (qt.dot(one, w), qt.dot(two, w), qt.dot(three, w)))
    m = qt.cross(L, w)
    return (qt.dot(rows[0], m), qt.dot(rows[1], m), qt.dot(rows[2], m))


def _same_acceleration(k, b, first, acceleration, many):
    return acceleration


@if_given("many.bodies.cylinders", _same_acceleration)
def plus_free_turn(k, b, first, acceleration, many):
    """Acceleration of the point of part b in contact k, plus α x r of free turning if b is a cylinder [m/s²].

    `first` is the column of the body's arm r.
    """
    if not is_cylinder(b, many):
        return acceleration
    alpha = _free_angular_acceleration(body_of(b, many), many)
    return plus(acceleration, qt.cross(alpha, row_vector(many.contacts.arm, k, first)))
