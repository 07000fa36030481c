"""Capsules: all points within a radius r of an axis, a segment along body y that the body's centre halves.

The dimensions of a capsule are its half extents (r, l + r, r), with half the length l of the axis. Its surface touches
where balls of radius r about points of the axis touch. Such a point of the axis stays with the body, and the contact
stays below it along the normal.

All of this is left out of kernels whose scene has no capsule.
"""

from __future__ import annotations

import math

from physics.compiler.decorators import if_given, inlined
from physics.kernels.math import quaternion as qt
from physics.kernels.state.layout import CAPSULE


@if_given("many.bodies.capsules", False)
def is_capsule(b, many):
    """True if body b is a capsule."""
    return many.bodies.body[b].shape == CAPSULE


@inlined
def half_length(b, many):
    """Half the length of the axis of capsule b [m]."""
    return many.bodies.body[b].dims[1] - many.bodies.body[b].dims[0]


@inlined
def half_axis_along(b, R, many):
    """Vector from the centre of capsule b to the upper end of its axis [m], for the rotation matrix R."""
    s = half_length(b, many)
    return (s * R[1], s * R[4], s * R[7])


@inlined
def half_axis(b, many):
    """Vector from the centre of capsule b to the upper end of its axis, world frame [m]."""
    s, R = half_length(b, many), many.bodies.rotation
    return (s * R[b, 1], s * R[b, 4], s * R[b, 7])


@inlined
def farthest_axis_end(b, R, k, many):
    """End of the axis of capsule b that reaches farther along k, from its centre [m], for the rotation matrix R."""
    u = half_axis_along(b, R, many)
    s = math.copysign(1.0, qt.dot(u, k))
    return (s * u[0], s * u[1], s * u[2])


@inlined
def capsule_support(b, R, k, many):
    """Support function of capsule b for a vector k of any length [m]: l |k·y| + r |k|, with its axis along y."""
    return abs(qt.dot(half_axis_along(b, R, many), k)) + many.bodies.body[b].dims[0] * math.sqrt(qt.dot(k, k))
