"""Part of a substep with one moving body: it meets sudden changes, and is extrapolated.

The motion of a lone body among fixed ones has few sudden changes, and is smooth in between. Two things follow:

- The two half steps and the whole step of a smooth part have errors that differ by the factor 4. A third of their
  difference is added, which leaves an error of higher order (Richardson's extrapolation). The contacts that push are
  then closed again (`constraint_projection`).
- Sudden changes, as of a block that begins to tip over an edge, are looked for in the next part before a part is
  accepted (`sudden_change`). The parts around one are made so short that its error does not count.

All of this is left out of kernels unless exactly one body moves, among fixed ones.
"""

from __future__ import annotations

import math

from physics.compiler.decorators import if_given, inlined, kernel
from physics.kernels.multibody.data.driven_bodies import extrapolate_reported_work
from physics.kernels.multibody.data.lone_body import lone_body
from physics.kernels.multibody.stepping.allowed_error import allowed_error
from physics.kernels.multibody.stepping.constraint_projection import project_constraints
from physics.kernels.multibody.stepping.extrapolation import extrapolate_body
from physics.kernels.multibody.stepping.part import (
    following_part,
    max_body_error,
    step_part,
)
from physics.kernels.multibody.stepping.snapshots import (
    SNAPSHOT_COARSE,
    SNAPSHOT_END,
    SNAPSHOT_MIDDLE,
    SNAPSHOT_START,
    restore_snapshot,
    save_snapshot,
)
from physics.kernels.multibody.stepping.sudden_change import (
    FIRST_HALF,
    NEXT_PART,
    SECOND_HALF,
    note_rates,
    sudden_change,
)
from physics.kernels.state.body import are_all_finite

# Weight of the errors of parts in which a sudden change is or may be: such a part is one of few, and its error should
# be less than that of all others together.
_SUDDEN_WEIGHT = 256.0

# The error of a sudden change falls as the part is halved. Where it has stayed above this share so many times in a row,
# no shorter part would help: a slow landing changes the velocity at once, however short the part is.
_FALLING_SHARE = 0.75
_MAX_STALLS = 2


@inlined
def _step_halves(world, start, half, switches, kept, records, many):
    """Advance the lone body by two steps of `half` [s] from the start of a part, and extrapolate; return the error.

    The error is a multiple of the allowed one, before the extrapolation. `start` is the time since the start of the
    call [s].
    """
    many.lone.impacts[0] = 0
    step_part(world, start, half, switches, None, records, many)
    note_rates(FIRST_HALF, SNAPSHOT_START, half, kept, many)
    save_snapshot(SNAPSHOT_MIDDLE, world, kept, records.memory, records.report, many, records.counts)
    step_part(world, start + half, half, switches, None, records, many)
    note_rates(SECOND_HALF, SNAPSHOT_MIDDLE, half, kept, many)
    error = max_body_error(switches.flight.offset_frame, kept, many)
    if error <= 1.0 and many.lone.impacts[0] == 0:
        extrapolate_body(lone_body(many), kept, many)
        extrapolate_reported_work(world, kept.report[SNAPSHOT_COARSE], records.report, many)
        project_constraints(world, half, switches, records.memory, many)
    save_snapshot(SNAPSHOT_END, world, kept, records.memory, records.report, many, records.counts)
    return error


@inlined
def _hidden_error(error, place, lengths, unit, offset_frame, kept, many):
    """Error of a part that may have a sudden change, as a multiple of the allowed one, weighted.

    `error` is the one that its halves show. `lengths` are those of the part, which begins at `place`, and of the next
    one, in units of `unit` [s].
    """
    part, following = lengths
    sudden = (
        _SUDDEN_WEIGHT
        / allowed_error(many)
        * sudden_change(allowed_error(many) * error, part * unit, following * unit, offset_frame, kept, many)
    )
    if sudden > 1.0:
        many.lone.suspect[0] = place + part + following
    return max(sudden, _SUDDEN_WEIGHT * error) if place < many.lone.suspect[0] else sudden


@kernel
def step_lone_part(world, place, grid, part, shortest, switches, kept, records, many):
    """Advance the lone body by a part whose error is allowed: (units taken, next part, its error, lengths tried).

    The length is halved while the error is above the allowed one, down to `shortest` units. The part begins `place`
    units after the start of the substep; `grid` is the time at which that starts since the start of the call [s], and
    the length of a unit [s]. The snapshots `SNAPSHOT_START` and `SNAPSHOT_COARSE` are those of the first length to try,
    `part`; afterwards they are those of the next part. Errors are multiples of the allowed one.
    """
    (begin, unit), offset_frame = grid, switches.flight.offset_frame
    start, tried, stalls, before = begin + place * unit, 1, 0, math.inf
    while True:
        error = _step_halves(world, start, 0.5 * part * unit, switches, kept, records, many)
        if error <= 1.0 or part <= shortest or not are_all_finite(many.bodies.state):
            following = following_part(place + part, part)
            step_part(world, start + part * unit, following * unit, switches, None, records, many)
            note_rates(NEXT_PART, SNAPSHOT_END, following * unit, kept, many)
            hidden = _hidden_error(error, place, (part, following), unit, offset_frame, kept, many)
            stalls = stalls + 1 if hidden > _FALLING_SHARE * before else 0
            before = hidden
            if not hidden > 1.0 or stalls == _MAX_STALLS or part <= shortest:
                save_snapshot(SNAPSHOT_COARSE, world, kept, records.memory, records.report, many, records.counts)
                restore_snapshot(SNAPSHOT_END, world, kept, records.memory, records.report, many, records.counts)
                save_snapshot(SNAPSHOT_START, world, kept, records.memory, records.report, many, records.counts)
                return part, following, error, tried
        restore_snapshot(SNAPSHOT_MIDDLE, world, kept, records.memory, records.report, many, records.counts)
        save_snapshot(SNAPSHOT_COARSE, world, kept, records.memory, records.report, many, records.counts)
        restore_snapshot(SNAPSHOT_START, world, kept, records.memory, records.report, many, records.counts)
        part //= 2
        tried += 1


@if_given("kept.rates")
def step_first_part(world, start, h, part, switches, kept, records, many):
    """Step the first part of a substep as a whole, from the time `start` [s], and return to its start.

    h is the length of the substep, `part` that of the part [s]. It is only needed for a lone body.
    """
    many.lone.suspect[0] = 0
    many.lone.substep[0] = h
    save_snapshot(SNAPSHOT_START, world, kept, records.memory, records.report, many, records.counts)
    step_part(world, start, part, switches, None, records, many)
    save_snapshot(SNAPSHOT_COARSE, world, kept, records.memory, records.report, many, records.counts)
    restore_snapshot(SNAPSHOT_START, world, kept, records.memory, records.report, many, records.counts)
