"""Nearest points of segments x + s u with -1 <= s <= 1: x is the middle, u leads from there to an end."""

from __future__ import annotations

from physics.compiler.decorators import inlined
from physics.kernels.math import quaternion as qt
from physics.kernels.math.vector import minus, plus, times

# Square of the sine of the angle below which two segments are parallel: their nearest points are then arbitrary.
_PARALLEL_SINE_SQUARED = 1.0e-12


@inlined
def point_on_segment(x, u, s):
    """Point x + s u."""
    return plus(x, times(s, u))


@inlined
def nearest_place(p, x, u):
    """Place s, from -1 to 1, of the point of a segment that is nearest to p."""
    return min(max(qt.dot(u, minus(p, x)) / qt.dot(u, u), -1.0), 1.0)


@inlined
def nearest_places(x, u, y, v):
    """Places (s, t) of the nearest points of two segments, and whether their directions differ.

    Parallel segments have many nearest points; the result is one pair of them.

    Reference: C. Ericson, *Real-Time Collision Detection*, 2005, section 5.1.9.
    """
    a, b, e, w = qt.dot(u, u), qt.dot(u, v), qt.dot(v, v), minus(x, y)
    c, f, square = qt.dot(u, w), qt.dot(v, w), a * e - b * b
    is_crossing = square > _PARALLEL_SINE_SQUARED * a * e
    s = min(max((b * f - c * e) / square, -1.0), 1.0) if is_crossing else 0.0
    t = (b * s + f) / e
    if abs(t) > 1.0:
        t = min(max(t, -1.0), 1.0)
        s = min(max((b * t - c) / a, -1.0), 1.0)
    return s, t, is_crossing
