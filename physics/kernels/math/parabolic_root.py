"""Root of a gap, by the parabola through its known values."""

from __future__ import annotations

import math

from physics.compiler.decorators import inlined


@inlined
def second_difference(a, fa, b, fb, c, fc):
    """Second divided difference of three values: half of a parabola's second derivative; 0 of equal places."""
    if not (a < b < c):
        return 0.0
    return ((fc - fb) / (c - b) - (fb - fa) / (b - a)) / (c - a)


@inlined
def parabola_crossing_time(low_gap, high_gap, width, bend):
    """Root in [0, width] of the parabola from low_gap >= 0 to high_gap < 0, `width` later.

    With the slope B at its start and `bend` c, c x² + B x + low_gap = 0: of the root's two forms the one that does not
    cancel. A gap that grows at first (B > 0) comes down again: c < 0.
    """
    if not low_gap > 0.0:
        return 0.0
    B = (high_gap - low_gap) / width - bend * width
    root = math.sqrt(max(B * B - 4.0 * bend * low_gap, 0.0))
    x = 2.0 * low_gap / (root - B) if B < 0.0 else (B + root) / (-2.0 * bend)
    return min(x, width)
