"""Error control of a substep: it is cut into parts, and each part is compared with two steps of half its length.

Impacts need no short parts: the stages of a part end at the time of impact (`impact`). Other changes of contact cause
an error of first or second order in the part in which they happen: contacts that open, begin to slip or begin to stick,
slow impacts, and contact problems whose solution jumps to another one. Halving the part resolves all of them. Between
such changes the motion is smooth, and the method is of second order. With compliant contact smooth parts are
extrapolated (`extrapolation`), and parts in which a spring begins or ends to push have smaller errors
(`spring_switches`).

Lengths of parts are 1, 1/2, 1/4, ... of the substep, and a part begins at a multiple of its length. So when a part is
refused, its first half is the next one to try, and its single step is known already. After an accepted part the next
one is twice as long, if that fits.
"""

from __future__ import annotations

import math

from physics.compiler.decorators import if_given, inlined, kernel
from physics.kernels.multibody.stepping.compliant_stage import trials_of_springs
from physics.kernels.multibody.stepping.extrapolation import extrapolate_springs
from physics.kernels.multibody.stepping.foretold_twists import note_substep
from physics.kernels.multibody.stepping.lone_part import step_first_part, step_lone_part
from physics.kernels.multibody.stepping.part import UNITS_PER_SUBSTEP, following_part, max_body_error, step_part
from physics.kernels.multibody.stepping.snapshots import (
    SNAPSHOT_COARSE,
    SNAPSHOT_MIDDLE,
    SNAPSHOT_START,
    restore_snapshot,
    save_snapshot,
)
from physics.kernels.multibody.stepping.spring_switches import forget_switches, with_switches
from physics.kernels.state import layout as at
from physics.kernels.state.body import are_all_finite
from physics.kernels.state.fixed_body import is_fixed

# If the shortest part is above the allowed error, or after so many trials, the shortest part becomes this many times
# longer for the rest of the substep. Otherwise motion that rattles without end would take parts without end. There are
# 12 such lengths, so that a substep ends after some 600 trials, and those that springs of contacts ask for.
_COARSENING_FACTOR = 4
_MAX_TRIALS = 50

# Least tolerance of contact problems of many bodies, and least slop in bounding radii: below them rounding would
# decide.
MIN_SOLVER_TOLERANCE = 1.0e-11
MIN_RELATIVE_SLOP = 1.0e-12

# Least slop of a lone body, in bounding radii. Short parts must not lose a contact whose gap is mere rounding.
LONE_RELATIVE_SLOP = 1.0e-10


@kernel
def _step_with_halving(world, start, unit, lengths, switches, kept, sleep, records, many):
    """Advance the world by a part whose error is allowed: (units taken, its error, number of lengths tried).

    A unit is `unit` [s]. The first length tried is `lengths[0]` units; while the error is above 1, in multiples of the
    allowed one, the length is halved, down to `lengths[1]` units. The accepted state is that after two half steps, with
    compliant contact extrapolated.
    `start` is the time since the start of the call [s].
    """
    (part, shortest), offset_frame, tried = lengths, switches.flight.offset_frame, 1
    save_snapshot(SNAPSHOT_START, world, kept, records.memory, records.report, many, records.counts)
    step_part(world, start, part * unit, switches, sleep, records, many)
    while True:
        half = 0.5 * part * unit
        save_snapshot(SNAPSHOT_COARSE, world, kept, records.memory, records.report, many, records.counts)
        restore_snapshot(SNAPSHOT_START, world, kept, records.memory, records.report, many, records.counts)
        forget_switches(many)
        step_part(world, start, half, switches, sleep, records, many)
        save_snapshot(SNAPSHOT_MIDDLE, world, kept, records.memory, records.report, many, records.counts)
        step_part(world, start + half, half, switches, sleep, records, many)
        error = with_switches(max_body_error(offset_frame, kept, many), many)
        if error <= 1.0:
            extrapolate_springs(kept, many)
        if error <= 1.0 or part <= shortest:
            return part, error, tried
        restore_snapshot(
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


def _step_coupled_part(world, place, grid, lengths, switches, kept, sleep, records, many):
    now = grid[0] + place * grid[1]
    part, error, tried = _step_with_halving(world, now, grid[1], lengths, switches, kept, sleep, records, many)
    return part, following_part(place + part, part), error, tried


@if_given("kept.rates", _step_coupled_part)
def _step_next_part(world, place, grid, lengths, switches, kept, sleep, records, many):
    """Advance the world by a part whose error is allowed: (units taken, next part, its error, lengths tried).

    It begins `place` units after the start of the substep; `grid` is the time at which that starts since the start of
    the call, and the length of a unit [s]. `lengths` are the first length to try and the last one, in units. A lone
    body is awake in a part: if it sleeps, the whole world does.
    """
    return step_lone_part(world, place, grid, lengths[0], lengths[1], switches, kept, records, many)


@kernel
def step_with_error_control(world, start, h, switches, kept, sleep, records, many):
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
    sleep : Sleep or None
        None if the scene declares no sleep.
    records : Records
        Warm starts, reports and logs. The last column of `records.memory` keeps the length of the next part.
    many : BodiesWorkspace
        Scratch memory, with the state of the world.

    If the shortest part is above the allowed error, too, it is accepted and reported as a fallback. The shortest part
    is then longer for the rest of this substep.
    """
    place, shortest, unit, patience = 0, 1, h / UNITS_PER_SUBSTEP, _MAX_TRIALS + trials_of_springs(h, many)
    next_part = records.memory.shape[1] - 1
    many.settings[0].half_load_speed = _min_load_speed(0.5 * h, many)  # least scale of contact problems
    part = int(records.memory[world, next_part] * UNITS_PER_SUBSTEP)
    if part == 0:
        part = UNITS_PER_SUBSTEP
    note_substep(h, many)
    step_first_part(world, start, h, part * unit, switches, kept, records, many)
    while place < UNITS_PER_SUBSTEP:
        part, following, error, tried = _step_next_part(
            world, place, (start, unit), (part, shortest), switches, kept, sleep, records, many
        )
        place += part
        patience -= tried
        if not are_all_finite(many.bodies.state):
            return
        if error > 1.0:
            records.report[world, at.FALLBACKS] += 1.0
        if error > 1.0 or patience <= 0:
            shortest, patience = min(_COARSENING_FACTOR * shortest, UNITS_PER_SUBSTEP), _MAX_TRIALS
        records.memory[world, next_part] = min(2 * part, UNITS_PER_SUBSTEP) / UNITS_PER_SUBSTEP
        part = following
