"""Find the time at which a gap closes, by the parabola through its known values."""

from __future__ import annotations

import math

from physics.compiler.decorators import inlined


@inlined
def second_difference(a, fa, b, fb, c, fc):
    """Second divided difference of the values fa, fb, fc at a < b < c; 0 unless a < b < c.

    It is half of the second derivative of the parabola through the three points.
    """
    if not (a < b < c):
        return 0.0
    return ((fc - fb) / (c - b) - (fb - fa) / (b - a)) / (c - a)


@inlined
def parabola_crossing_time(low_gap, high_gap, width, bend):
    """Root x in [0, width] of a parabola that is low_gap >= 0 at x = 0 and high_gap < 0 at x = width.

    `bend` is half of the parabola's second derivative, as `second_difference` gives it. With the slope B at x = 0 the
    equation is bend x² + B x + low_gap = 0. Of the two formulas for its root the one without cancellation is used.
    Where the gap grows at first (B > 0), bend < 0, since it is negative at the end.
    """
    if not low_gap > 0.0:
        return 0.0
    B = (high_gap - low_gap) / width - bend * width
    root = math.sqrt(max(B * B - 4.0 * bend * low_gap, 0.0))
    x = 2.0 * low_gap / (root - B) if B < 0.0 else (B + root) / (-2.0 * bend)
    return min(x, width)
