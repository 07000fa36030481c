"""Cylinders: their support function, and points that roll over their surface, on a plane.

The dimensions of a cylinder are its half extents (r, l, r), with its axis along body y. Contacts of a cylinder have
kinds of points, told by their feature, a number:

- Those below `ROLLING_FEATURES` belong to the points of a cross-section that reach farthest towards a wall, or towards
  a flat face that owns the contact's normal. They roll along their circle as the cylinder turns. Features 0 and 1 are
  those of the lower and the upper rim; others are where the line of contact of the side ends over an edge of a face.
- `BESIDE_FEATURE` and the next one belong to points of a polyhedron beside the side, which slides over them
  (`cylinder_balls`).
- All others are fixed in their bodies.

All of this is left out of kernels whose scene has no cylinder.
"""

from __future__ import annotations

import math

from physics.compiler.decorators import if_given, inlined
from physics.kernels.math import quaternion as qt
from physics.kernels.math.vector import minus, plus, row_vector, times
from physics.kernels.multibody.data.parts import body_of
from physics.kernels.state.layout import CYLINDER

# Sides of a face of a polyhedron, at most.
_MAX_SIDES = 64

# Points of the ring of a face, which carry the load of a cylinder that stands.
RING_POINTS = 8

# Features of a contact of a cylinder. First rolling points: of the lower and the upper rim, then those over the sides
# of a face, from `CLIPPED_FEATURE` on.
CLIPPED_FEATURE = 2
ROLLING_FEATURES = CLIPPED_FEATURE + _MAX_SIDES

# Points of the rings of both ends; the lowest point of either rim where it is not one of them; corners of a polyhedron
# on an end; two crossings of each side of a face with a rim.
RING_FEATURE = ROLLING_FEATURES
LOWEST_FEATURE = RING_FEATURE + 2 * RING_POINTS
CORNER_FEATURE = LOWEST_FEATURE + 2
CROSSING_FEATURE = CORNER_FEATURE + _MAX_SIDES

# Points of a polyhedron beside the side, of which two touch if an edge lies along it; any other single contact.
BESIDE_FEATURE = CROSSING_FEATURE + 2 * _MAX_SIDES
SINGLE_FEATURE = BESIDE_FEATURE + 2

# Square of the sine of the tilt of a cylinder below which no rim point is the lowest: rounding of unit vectors.
_LEAST_SINE_SQUARED = 1.0e-30

# Square of the sine s below which rounding is taken off the part of a vector across the axis once more. It leaves up to
# 1e-15 of the vector in it, along the axis. On a rim of radius r this is 1e-15 r/s: 1e-10 r, far less than a slop.
_CLEARED_SINE_SQUARED = 1.0e-10


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
def _towards_rim(axis, k):
    """Part p of the vector k across the unit vector `axis`, and p·p: 0 if k is along the axis up to rounding.

    If k is nearly along the axis, rounding in p may be as long as p and along the axis, so that a point of a rim in the
    direction of p would be off the cylinder.
    """
    p, whole = across_axis(axis, k), qt.dot(k, k)
    square = qt.dot(p, p)
    if square > _CLEARED_SINE_SQUARED * whole:
        return p, square
    p = across_axis(axis, p)
    square = qt.dot(p, p)
    return p, square if square > _LEAST_SINE_SQUARED * whole else 0.0


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
    arm, (p, square) = times(math.copysign(dims[1], qt.dot(y, k)), y), _towards_rim(y, k)
    return plus(arm, times(dims[0] / math.sqrt(square), p)) if square > 0.0 else arm


@inlined
def rolling_arm(b, place, R, k, many):
    """Point of a cross-section of cylinder b that reaches farthest along the unit vector k, from its centre [m].

    `place` is that of the cross-section on the axis, from the centre [m]; vectors are in the world frame. Where all
    points of the circle reach equally far, it is the centre of the circle.
    """
    arm, (p, square) = times(place, axis_of(R)), _towards_rim(axis_of(R), k)
    return plus(arm, times(many.bodies.body[b].dims[0] / math.sqrt(square), p)) if square > 0.0 else arm


@inlined
def rim_arm(b, end, R, k, many):
    """Point of the lower (0) or upper (1) rim of cylinder b that reaches farthest along k; see `rolling_arm`."""
    return rolling_arm(b, (2.0 * end - 1.0) * many.bodies.body[b].dims[1], R, k, many)


@inlined
def rolling_arm_rate(b, place, R, w, k, many):
    """Velocity of the point of `rolling_arm`, as it rolls along its circle while k stays as it is [m/s].

    The cylinder turns at w. Its axis y has the rate y' = w x y. The point is at s y + r p/|p| with p = k - (k·y) y, so
    that p' = -(k·y') y - (k·y) y' and (p/|p|)' is the part of p'/|p| across p.
    """
    d, y = many.bodies.body[b].dims, axis_of(R)
    turn = qt.cross(w, y)
    rate, (p, square) = times(place, turn), _towards_rim(y, k)
    if not square > 0.0:
        return rate
    change = minus(times(-qt.dot(k, turn), y), times(qt.dot(k, y), turn))
    change = minus(change, times(qt.dot(change, p) / square, p))
    return plus(rate, times(d[0] / math.sqrt(square), change))


@inlined
def rotation_of(b, many):
    """Rotation matrix of body or part b."""
    R = many.bodies.rotation
    return (R[b, 0], R[b, 1], R[b, 2], R[b, 3], R[b, 4], R[b, 5], R[b, 6], R[b, 7], R[b, 8])


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
