"""Error control of a substep: it is cut into parts that agree with two of half their length.

Impacts are met in time by a part of any length (`impact`). What is not, and makes an error of first or second order in
the part where it happens: contacts that open, begin to slip or hold; slow meetings; and contacts whose problem has
another answer. Halving finds all of them, and what moves smoothly is of second order in between.

Parts are `whole`, 1/2, 1/4, ... of the substep, at multiples of their length, so that a part that is refused begins
with the first half of it, which is known already. A part that is good for twice its length is followed by one.
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

# A substep in its shortest parts.
_UNITS_PER_SUBSTEP = 2**24

# Error that a part may have, in tolerances of the contact problem: what is left of that in one part, as a velocity, is
# some of them, and no shorter part shows less.
ERROR_PER_TOLERANCE = 100.0

# Where the shortest part does not meet the error, or after so many parts tried, those of the rest of the substep are no
# shorter than four times it: what has no limit, and what rattles without end, takes no end of parts. There are 12 such
# lengths, so that this ends after some 600 trials; the longer a part, the later it is refused for this reason.
_COARSENING_FACTOR = 4
_MAX_TRIALS = 50

# Tolerance of the contact problems of many bodies, and slop in bounding radii, below which rounding would decide.
MIN_SOLVER_TOLERANCE = 1.0e-11
MIN_RELATIVE_SLOP = 1.0e-12

# Rounding of a position, in units of its last place.
_POSITION_ROUNDING = 16.0 * 2.0**-52

SNAPSHOT_START, SNAPSHOT_COARSE, SNAPSHOT_MIDDLE = range(3)


@inlined
def _save_snapshot(slot, world, kept, memory, report, many, counts):
    """Save the present state of the world."""
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
    """Restore the saved state of the world, except the counts of the report.

    Events logged since then are dropped: their rows are overwritten.
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
    """Distance of body b from its state `SNAPSHOT_COARSE`, in its radius; and the difference in velocity, in its speed.

    The speed counts as at least the speed that the body's loads give it over its radius.
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
    """Largest error of any body, as a multiple of the allowed one."""
    worst, allowed = 0.0, ERROR_PER_TOLERANCE * many.settings[0].tolerance
    for b in range(many.bodies.state.shape[0]):
        found = _body_error(b, offset_frame, kept, many) / allowed
        if not found <= worst:
            worst = found
    return worst


@kernel
def _step_part(world, start, h, switches, records, many):
    """Take one part of h [s], `start` [s] after the call."""
    for b in range(many.bodies.state.shape[0]):
        set_clock(start, many.bodies.body[b])
        many.bodies.touched[b] = 0
    substep_world(world, start, h, switches, None, records, many)


@kernel
def _step_with_halving(world, start, unit, part, shortest, switches, kept, records, many):
    """Advance by `part` units of time [s], or a half, a quarter ... of it: (units taken, error, lengths tried)."""
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
        )  # the coarse answer of the first half
        part //= 2
        tried += 1


@inlined
def _min_load_speed(h, many):
    """Least speed that a body gains by its loads in h [m/s].

    The solves of a part are at least as coarse as those of the halves in which every substep is taken. A finer goal
    would be below the rounding of bodies that turn on edges, and no error is as small.
    """
    least = math.inf
    for b in range(many.bodies.state.shape[0]):
        least = min(least, many.bodies.body[b].acceleration * h)
    return least


@kernel
def step_with_error_control(world, start, h, switches, kept, records, many):
    """Advance the bodies of one world by h [s], `start` [s] after the call, in parts that meet the error.

    If the shortest part does not meet the error either, it counts as a fallback, and the shortest part is longer for
    the rest of this substep.

    `switches` are `MultibodySwitches`; `kept` is what `allocation.make_snapshots` makes.
    """
    place, shortest, unit, patience = 0, 1, h / _UNITS_PER_SUBSTEP, _MAX_TRIALS
    next_part = records.memory.shape[1] - 1
    many.settings[0].half_load_speed = _min_load_speed(0.5 * h, many)  # the scale of contact problems, at least
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
        )  # what rounding leaves is no reason to stay with short ones: it is always tried
        records.memory[world, next_part] = part / _UNITS_PER_SUBSTEP
        part = min(part, place & -place)
