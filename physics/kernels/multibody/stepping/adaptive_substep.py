"""Error control of a substep: it is cut into parts, and each part is compared with two steps of half its length.

Impacts need no short parts: the stages of a part end at the time of impact (`impact`). Other changes of contact cause
an error of first or second order in the part in which they happen: contacts that open, begin to slip or begin to stick,
slow impacts, and contact problems whose solution jumps to another one. Halving the part resolves all of them. Between
such changes the motion is smooth, and the method is of second order.

Lengths of parts are 1, 1/2, 1/4, ... of the substep, and a part begins at a multiple of its length. So when a part is
refused, its first half is the next one to try, and its single step is known already. After an accepted part the next
one is twice as long, if that fits.
"""

from __future__ import annotations

import math

from physics.compiler.decorators import inlined, kernel
from physics.kernels.forces.held_loads import set_clock
from physics.kernels.multibody.data.arrays import WARM_CONTACT_COUNT, WARM_CONTACT_SIZE, WARM_HEADER_SIZE
from physics.kernels.multibody.data.contact_set import subtract
from physics.kernels.multibody.stepping.substep import substep_world
from physics.kernels.state import layout as at
from physics.kernels.state.body import angular_velocity, are_all_finite, read_state
from physics.kernels.state.fixed_body import is_fixed

# Units in a substep. The shortest part is one unit long at first.
_UNITS_PER_SUBSTEP = 2**24

# Allowed error of a part, in tolerances of the contact problem. The residual of a solve changes velocities by a few
# tolerances, however short the part is.
ERROR_PER_TOLERANCE = 100.0

# If the shortest part is above the allowed error, or after so many trials, the shortest part becomes this many times
# longer for the rest of the substep. Otherwise motion that rattles without end would take parts without end. There are
# 12 such lengths, so that a substep ends after some 600 trials.
_COARSENING_FACTOR = 4
_MAX_TRIALS = 50

# Least tolerance of contact problems of many bodies, and least slop in bounding radii: below them rounding would
# decide.
MIN_SOLVER_TOLERANCE = 1.0e-11
MIN_RELATIVE_SLOP = 1.0e-12

# Rounding of a position, in units of its last place.
_POSITION_ROUNDING = 16.0 * 2.0**-52

# Index of a snapshot: at the start of a part, after its single step, after the first of its two half steps.
SNAPSHOT_START, SNAPSHOT_COARSE, SNAPSHOT_MIDDLE = range(3)


@inlined
def _save_snapshot(slot, world, kept, memory, report, many, counts):
    """Save the present state of the world in `kept`, at index `slot` (`SNAPSHOT_START` ...).

    A snapshot has the states of the bodies, the world's rows of `memory` and `report`, and its counts of events.
    """
    for b in range(many.bodies.state.shape[0]):
        for c in range(many.bodies.state.shape[1]):
            kept.state[slot, b, c] = many.bodies.state[b, c]
    for c in range(WARM_HEADER_SIZE + WARM_CONTACT_SIZE * int(memory[world, WARM_CONTACT_COUNT])):
        kept.memory[slot, c] = memory[world, c]
    for c in range(at.REPORT_SIZE):
        kept.report[slot, c] = report[world, c]
    for b in range(many.bodies.state.shape[0]):
        kept.counts[slot, b] = counts[world * many.bodies.state.shape[0] + b]


@inlined
def _restore_snapshot(slot, world, kept, memory, report, many, counts):
    """Restore the state of the world from `kept`, at index `slot`, except solves and iterations in the report.

    Events logged since the snapshot are dropped: later events overwrite their rows.
    """
    for b in range(many.bodies.state.shape[0]):
        for c in range(many.bodies.state.shape[1]):
            many.bodies.state[b, c] = kept.state[slot, b, c]
    for c in range(WARM_HEADER_SIZE + WARM_CONTACT_SIZE * int(kept.memory[slot, WARM_CONTACT_COUNT])):
        memory[world, c] = kept.memory[slot, c]
    for c in range(at.REPORT_SIZE):
        if c != at.SOLVES and c != at.ITERATIONS:
            report[world, c] = kept.report[slot, c]
    for b in range(many.bodies.state.shape[0]):
        counts[world * many.bodies.state.shape[0] + b] = kept.counts[slot, b]


@inlined
def _length(a):
    return math.sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2])


@inlined
def _body_error(b, offset_frame, kept, many):
    """Error of body b: difference between its present state and that of the snapshot `SNAPSHOT_COARSE`.

    It is the larger of two ratios. One is the largest distance between points of the body in the two poses, in bounding
    radii. The other is the difference in velocity relative to the body's speed. That speed counts as at least √(r a):
    the one that loads of acceleration a give over a bounding radius r.
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
    speed = _length(v) + r * _length(w) + math.sqrt(r * body.acceleration)
    change = _length(subtract(v, u)) + r * _length(subtract(w, z))
    return max(pose, change / speed) if change > 0.0 else pose


@inlined
def _max_body_error(offset_frame, kept, many):
    """Largest error of any body (`_body_error`), as a multiple of the allowed error."""
    worst, allowed = 0.0, ERROR_PER_TOLERANCE * many.settings[0].tolerance
    for b in range(many.bodies.state.shape[0]):
        found = _body_error(b, offset_frame, kept, many) / allowed
        if not found <= worst:
            worst = found
    return worst


@kernel
def _step_part(world, start, h, switches, records, many):
    """Advance the world by one part of h [s], which starts `start` [s] after the start of the call."""
    for b in range(many.bodies.state.shape[0]):
        set_clock(start, many.bodies.body[b])
        many.bodies.touched[b] = 0
    substep_world(world, start, h, switches, None, records, many)


@kernel
def _step_with_halving(world, start, unit, part, shortest, switches, kept, records, many):
    """Advance the world by a part whose error is allowed: (units taken, its error, number of lengths tried).

    A unit is `unit` [s]. The first length tried is `part` units; while the error is above 1, in multiples of the
    allowed one, the length is halved, down to `shortest` units. The accepted state is that after two half steps.
    `start` is the time since the start of the call [s].
    """
    offset_frame, tried = switches.flight.offset_frame, 1
    _save_snapshot(SNAPSHOT_START, world, kept, records.memory, records.report, many, records.counts)
    _step_part(world, start, part * unit, switches, records, many)
    while True:
        half = 0.5 * part * unit
        _save_snapshot(SNAPSHOT_COARSE, world, kept, records.memory, records.report, many, records.counts)
        _restore_snapshot(SNAPSHOT_START, world, kept, records.memory, records.report, many, records.counts)
        _step_part(world, start, half, switches, records, many)
        _save_snapshot(SNAPSHOT_MIDDLE, world, kept, records.memory, records.report, many, records.counts)
        _step_part(world, start + half, half, switches, records, many)
        error = _max_body_error(offset_frame, kept, many)
        if error <= 1.0 or part <= shortest:
            return part, error, tried
        _restore_snapshot(
            SNAPSHOT_MIDDLE, world, kept, records.memory, records.report, many, records.counts
        )  # the single step over the first half, which is tried next
        part //= 2
        tried += 1


@inlined
def _min_load_speed(h, many):
    """Least speed that loads give to a body in a time h [s], over all bodies that are not fixed [m/s].

    It is the smallest scale of contact problems under error control. Solves in short parts are then as coarse as in
    half a substep. A finer goal would be below the rounding of bodies that turn on edges.
    """
    least = math.inf
    for b in range(many.bodies.state.shape[0]):
        if not is_fixed(b, many.bodies):
            least = min(least, many.bodies.body[b].acceleration * h)
    return least


@kernel
def step_with_error_control(world, start, h, switches, kept, records, many):
    """Advance the bodies of one world by a substep of h [s], in parts whose error is allowed.

    Parameters
    ----------
    world : int
        Index of the world.
    start : float
        Time since the start of the call [s].
    h : float
        Length of the substep [s].
    switches : MultibodySwitches
        Effects that are compiled in.
    kept : WorldSnapshots
        Room for snapshots, from `allocation.make_snapshots`.
    records : Records
        Warm starts, reports and logs. The last column of `records.memory` keeps the length of the next part.
    many : BodiesWorkspace
        Scratch memory, with the state of the world.

    If the shortest part is above the allowed error, too, it is accepted and reported as a fallback. The shortest part
    is then longer for the rest of this substep.
    """
    place, shortest, unit, patience = 0, 1, h / _UNITS_PER_SUBSTEP, _MAX_TRIALS
    next_part = records.memory.shape[1] - 1
    many.settings[0].half_load_speed = _min_load_speed(0.5 * h, many)  # least scale of contact problems
    part = int(records.memory[world, next_part] * _UNITS_PER_SUBSTEP)
    if part == 0:
        part = _UNITS_PER_SUBSTEP
    while place < _UNITS_PER_SUBSTEP:
        now = start + place * unit
        part, error, tried = _step_with_halving(world, now, unit, part, shortest, switches, kept, records, many)
        place += part
        patience -= tried
        if not are_all_finite(many.bodies.state):
            return
        if error > 1.0:
            records.report[world, at.FALLBACKS] += 1.0
        if error > 1.0 or patience <= 0:
            shortest, patience = min(_COARSENING_FACTOR * shortest, _UNITS_PER_SUBSTEP), _MAX_TRIALS
        part = min(
            2 * part, _UNITS_PER_SUBSTEP
        )  # double length is always tried: an error near rounding must not keep parts short
        records.memory[world, next_part] = part / _UNITS_PER_SUBSTEP
        part = min(part, place & -place)
