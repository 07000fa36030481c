"""Part of a substep under error control (`adaptive_substep`): its step, its error, and the length of the next one."""

from __future__ import annotations

import math

from physics.compiler.decorators import inlined, kernel
from physics.kernels.forces.held_loads import set_clock
from physics.kernels.multibody.data.contact_set import subtract
from physics.kernels.multibody.stepping.allowed_error import allowed_error, reference_speed
from physics.kernels.multibody.stepping.snapshots import SNAPSHOT_COARSE
from physics.kernels.multibody.stepping.substep import substep_world
from physics.kernels.state.body import angular_velocity, read_state

# Units in a substep. The shortest part is one unit long at first.
UNITS_PER_SUBSTEP = 2**24

# Rounding of a position, in units of its last place.
_POSITION_ROUNDING = 16.0 * 2.0**-52


@inlined
def _length(a):
    return math.sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2])


@inlined
def _body_error(b, offset_frame, kept, many):
    """Error of body b: difference between its present state and that of the snapshot `SNAPSHOT_COARSE`.

    It is the larger of two ratios. One is the largest distance between points of the body in the two poses, in bounding
    radii. The other is the difference in velocity relative to the body's `reference_speed`.
    """
    body = many.bodies.body[b]
    x, q, v, L = read_state(many.bodies.state, b)
    y, p, u, K = read_state(kept.state[SNAPSHOT_COARSE], b)
    way, r = subtract(x, y), body.radius
    same, other = 0.0, 0.0
    for c in range(4):
        same += (q[c] - p[c]) ** 2
        other += (q[c] + p[c]) ** 2
    pose = _length(way) + 2.0 * r * math.sqrt(min(same, other))
    pose = max(0.0, pose - _POSITION_ROUNDING * _length(x)) / r
    w, z = angular_velocity(q, L, body, offset_frame), angular_velocity(p, K, body, offset_frame)
    change = _length(subtract(v, u)) + r * _length(subtract(w, z))
    return max(pose, change / reference_speed(v, w, body)) if change > 0.0 else pose


@inlined
def max_body_error(offset_frame, kept, many):
    """Largest error of any body (`_body_error`), as a multiple of the allowed error."""
    worst, allowed = 0.0, allowed_error(many)
    for b in range(many.bodies.state.shape[0]):
        found = _body_error(b, offset_frame, kept, many) / allowed
        if not found <= worst:
            worst = found
    return worst


@kernel
def step_part(world, start, h, switches, sleep, records, many):
    """Advance the world by one part of h [s], which starts `start` [s] after the start of the call.

    `sleep` is None if no body of the world sleeps. Groups that wake stay awake, even if the part is undone.
    """
    for b in range(many.bodies.state.shape[0]):
        set_clock(start, many.bodies.body[b])
        many.bodies.touched[b] = 0
    substep_world(world, start, h, switches, sleep, records, many)


@inlined
def following_part(place, part):
    """Length of the part that begins at `place` after one of length `part`, in units: twice that, where it fits.

    Double length is always tried: an error near rounding must not keep parts short.
    """
    return min(min(2 * part, UNITS_PER_SUBSTEP), place & -place)
