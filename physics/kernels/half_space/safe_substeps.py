"""Count the substeps in which a body in flight cannot reach a wall and needs no collision detection."""

from __future__ import annotations

import math

from physics.compiler.decorators import inlined
from physics.kernels.forces.held_loads import has_fields
from physics.kernels.half_space.contact_point import wall_normal
from physics.kernels.half_space.contact_set import is_flight_clear
from physics.kernels.math import quaternion as qt
from physics.kernels.state.layout import WALL_OFFSET

# Fewest substeps that are worth counting, and most that are counted. In as many substeps rounding adds up to at most
# _ROUNDING, relative to the coordinates: each substep has a handful of operations with an error of 2⁻⁵³ each.
_MIN_SUBSTEPS = 4
_MAX_SUBSTEPS = 1 << 20
_ROUNDING = 2.0**-28

_FAR = 1.0e300


@inlined
def _size(a):
    """Sum of the absolute values of a vector's components, an upper bound of its length."""
    return abs(a[0]) + abs(a[1]) + abs(a[2])


@inlined
def count_clear_substeps(x, v, h, left, scratch):
    """Number of the next substeps of length h [s] in which free flight from x with velocity v meets no wall.

    At most `left` substeps are counted, and none (0) where the first substep may already meet a wall. Results with and
    without the count have the same bits: `is_flight_clear` would be true of each counted substep.

    The first substep is tested by `is_flight_clear`. For more of them the acceleration must be constant, so a body in
    force fields gets 1. Let s and c be the parts of velocity and acceleration towards a wall. Within the time t the gap
    loses at most s t + c t²/2. Half of each gap may be lost that way. The other half is left for rounding, and for
    textbook schemes, which go up to c t h/2 further.
    """
    body = scratch.body
    if not is_flight_clear(x, v, h, scratch):
        return 0
    if left < _MIN_SUBSTEPS or has_fields(body):
        return 1
    walls, a = scratch.scene.walls, (body.free_acceleration[0], body.free_acceleration[1], body.free_acceleration[2])
    size, t, first = _size(x), h * min(left, _MAX_SUBSTEPS), _MIN_SUBSTEPS * h
    nearest = _FAR
    for k in range(walls.shape[0]):
        n = wall_normal(walls, k)
        gap = qt.dot(n, x) - walls[k, WALL_OFFSET] - body.radius
        way, s, c = 0.5 * gap, max(0.0, -qt.dot(n, v)), max(0.0, -qt.dot(n, a))
        if first * (s + 0.5 * first * c) > way:
            return 1
        if s + c > 0.0:
            t = min(t, 2.0 * way / (s + math.sqrt(s * s + 2.0 * c * way)))
        nearest, size = min(nearest, gap), max(size, abs(walls[k, WALL_OFFSET]))
    if not 0.5 * nearest > _ROUNDING * (size + t * (_size(v) + 0.5 * t * _size(a))):
        return 1
    return max(1, int(t / h))
