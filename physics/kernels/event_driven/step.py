"""The event-driven step of every world: smooth motion between events, each located to rounding.

A body flies, collides, moves in contact or rests:

- *flies*: exact flight to the next wall (`time_of_impact`);
- *collides*: impulses at all touching contacts at once, or at one after the other, by the solver of the time-stepping
  scheme. A rebound that
  would be over within a threshold of time is not made: the rest of such a sequence of bounces, t/(1 - e) long for a
  first bounce of length t, is left out and stated with the event that ends it;
- *moves*: extrapolated smooth motion with the forces of the regime (`extrapolated_midpoint`, `contact_forces`) until a
guard (`guards`) ends
  it; then the next regime is looked for a moment ahead (`contact_mode`), where what the guard has foretold has
  happened;
- *rests*: nothing changes until the load does.

Where no regime is consistent (Painlevé) the velocities jump: the impulse of an inelastic collision, looked for a
moment ahead.

Baraff, *Coping with friction for non-penetrating rigid body simulation*, SIGGRAPH 1991, for impulses where forces
have no solution.
"""

from __future__ import annotations

import math

from physics.kernels.compile.decorators import inlined, kernel
from physics.kernels.contact_solver.solve import solve_contacts
from physics.kernels.event_driven.acceleration_problem import read_resting
from physics.kernels.event_driven.chatter_control import is_crowded, note_leap, note_step, set_pace
from physics.kernels.event_driven.constraint_projection import cancel
from physics.kernels.event_driven.contact_candidates import (
    ASKS,
    ASKS_SLIDING,
    COLLIDES,
    FLIES,
    GOES_BACK,
    IS_LOST,
    RESTS,
)
from physics.kernels.event_driven.contact_mode import find_regime
from physics.kernels.event_driven.guards import FORCES, NO_GUARD, NO_STEP, WATCH
from physics.kernels.event_driven.impact import carry_on, collide, jump, note, principal_axes
from physics.kernels.event_driven.mode_acceptance import GROWTH, SHORTER, judge
from physics.kernels.event_driven.mode_transitions import keep_contacts, log_changes, recall_contacts
from physics.kernels.event_driven.smooth_segment import body_speed, look_ahead, move
from physics.kernels.event_driven.time_of_impact import fly_freely, fly_to_wall, note_unresolved
from physics.kernels.forces.held_loads import bind_fields, refresh_loads, set_clock
from physics.kernels.math import quaternion as qt
from physics.kernels.parallel.work_stealing import begin, next_world
from physics.kernels.state import layout as at
from physics.kernels.state.body import (
    angular_velocity,
    bind_body,
    can_bear,
    is_finite,
    note_fault,
    read_state,
    write_state,
)
from physics.kernels.state.contact_law_dispatch import bind_laws
from physics.kernels.time_stepping import event_log as ev

# Gaps of this share of what they are the difference of are rounding; see `set_thresholds` for HOP.
ROUNDING = 1.0e-15
HOP = 4.0

# Contacts that touch within this share of the same time, and ten times the tolerance, do so at once: rounding would
# else make two impacts of that of an edge, with another outcome.
TOGETHER = 1.0e-10
TINY = 1.0e-300

# Sliding ends at this share of the speed at which a contact that leaves counts as still.
SLOW = 1.0e-2

NOTHING = -1


@kernel
def set_thresholds(y, h, tilted, work, motion):
    """Set the gap and speed that count as zero, and the time a regime is looked ahead; problems are solved to rounding.

    Gaps are differences of places, wherever the body may go within h.
    A contact is still when the speed would not lift it by HOP gaps that count as none: a bounce as low as that would
    gain from being set down on the wall what it loses in the impact.
    """
    work.still = work.unseen = 0.0
    x, speed = y[0], body_speed(y, tilted, work)
    motion.touch = max(work.slop, ROUNDING * (work.radius + math.sqrt(qt.dot(x, x)) + h * speed))
    motion.noise = 1.0e-13 * speed
    motion.still = math.sqrt(2.0 * HOP * work.acceleration * motion.touch) + motion.noise
    motion.slow = SLOW * motion.still + motion.noise
    unit = work.radius / (speed + math.sqrt(work.radius * work.acceleration) + TINY)
    set_pace(unit, motion)
    motion.together = (TOGETHER + 10.0 * work.tolerance) * unit


@inlined
def begin_part(y, start, h, tilted, memory, work, motion):
    """Prepare a part of length h that begins at the time `start` of the step."""
    set_clock(start, work)
    refresh_loads(y, 0.0, tilted, work)
    set_thresholds(y, h, tilted, work, motion)
    motion.assured = 0.0
    recall_contacts(memory, work.i, work, motion)
    motion.left_out, motion.turns = 0.0, 0


@kernel
def find_what(y, is_foretold, watched, friction, smooth, tilted, pivots, work, motion, report):
    """Find the regime from y on, and whether a contact problem had to be solved, since the body may come to rest.

    It is looked for a moment ahead where a guard has foretold that the regime ends.
    """
    seen, later = y, 0.0
    if is_foretold:
        seen, later = look_ahead(y, tilted, work, motion), motion.ahead
    motion.assured = later
    refresh_loads(seen, later, tilted, work)
    what, n, v, L = find_regime(seen, friction, tilted, work, motion)
    what = judge(what, watched, y, tilted, work, motion)
    if what not in (ASKS, ASKS_SLIDING):
        return what, False
    if n > 0:
        P = principal_axes(seen, tilted, work)
        solved = solve_contacts(n, friction, smooth, pivots, v, L, P, work)
        note(solved, report, work)
        v, L = solved[0], solved[1]
    what = read_resting(n, seen, v, L, friction, what == ASKS_SLIDING, tilted, work, motion)
    return judge(what, watched, y, tilted, work, motion), True


@kernel
def come_to_rest(y, t, tilted, work, motion, log, counts):
    """State of what rests from the time t on."""
    if motion.is_resting:
        return y
    motion.is_resting = 1
    ev.note_change(log, counts, work.i, t + motion.left_out, ev.REST, -1)
    x, q, _, _ = cancel(y, tilted, work, motion)
    return x, q, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)


@kernel
def go_on(what, y, t, h, gyroscopic, tilted, work, motion, report):
    """Move, fly or leap from y, at the time t of a part of length h: (state, time it took, the guard that ended it)."""
    if what == IS_LOST:
        report[work.world, at.FALLBACKS] += 1.0
        step = min(motion.leap, h - t)
        note_leap(t + step, motion)
        return carry_on(y, step, tilted, work), step, NO_GUARD
    if what == FLIES:
        y, step, is_found = fly_to_wall(y, h - t, gyroscopic, tilted, work, motion, report)
        if not is_found:
            note_unresolved(report, work)
        return y, step, NO_GUARD
    return move(y, h - t, tilted, work, motion)


@kernel
def advance(y, h, friction, smooth, gyroscopic, tilted, pivots, work, motion, memory, report, log, counts, start):
    """State after h: events where they happen, smooth motion between them.

    Each turn asks what the body does (`impact_events` says so beforehand where it is known) and does that. A step whose
    end has to be looked at (`mode_acceptance`) has begun at `kept` and has the length `watched`.
    """
    begin_part(y, start, h, tilted, memory, work, motion)
    t, told, is_foretold, kept, watched = 0.0, NOTHING, False, y, 0.0
    for k in range(work.splits + 1):
        if k == work.splits:
            report[work.world, at.UNRESOLVED] += 1.0
            break
        if is_crowded(t, motion):
            told = IS_LOST
        what, is_answer = told, False
        if told == NOTHING:
            what, is_answer = find_what(
                y, is_foretold, watched, friction, smooth, tilted, pivots, work, motion, report
            )  # fmt: skip
        told = NOTHING
        if is_answer and what in (COLLIDES, IS_LOST):
            told, is_foretold = what, False
            continue
        if what == COLLIDES:
            y = collide(y, start + t, friction, smooth, tilted, pivots, work, motion, report, log, counts)
        elif what == IS_LOST:
            leap = min(motion.leap, h - t)
            y = jump(y, leap, start + t, friction, smooth, tilted, pivots, work, motion, report, log, counts)
        elif what == GOES_BACK:
            motion.trust = SHORTER * watched
            y, t, watched, is_foretold = kept, t - watched, 0.0, False
            set_clock(start + t, work)
            continue
        if watched > 0.0:
            motion.trust, watched = GROWTH * watched, 0.0
            if not t < h:
                break
        if what == COLLIDES:
            report[work.world, at.SPLITS] += 1.0
            motion.crowd -= motion.is_sequential  # those in turn have a bound of their own
            is_foretold = False
            continue
        log_changes(work, motion, log, counts, start + t)
        if what == RESTS:
            y = come_to_rest(y, start + t, tilted, work, motion, log, counts)
            break
        motion.is_resting, kept = 0, y
        y, step, guard = go_on(what, y, t, h, gyroscopic, tilted, work, motion, report)
        t += step
        set_clock(start + t, work)
        note_step(step, guard, motion)
        motion.left_out, motion.turns = 0.0, 0
        if guard == WATCH:
            watched = step
        elif not t < h:
            break
        elif guard == NO_STEP:
            told = IS_LOST
        is_foretold = guard in FORCES
    keep_contacts(memory, work.i, work, motion)
    return y


@kernel
def step_events(
    turns, taken, steps, substeps, h, state, params, shapes, gravity, wrench, contact, friction, smooth, restitution,
    gyroscopic, tilted, pivots, memory, report, scratch, motions, log, counts,
):  # fmt: skip
    """Advance the worlds that no other thread has taken by `steps` steps of `substeps` parts of h seconds each.

    Events go to `log` (rows, room, EVENT_SIZE), their number to `counts` (rows,); otherwise as `step.step_worlds`.
    """
    work, motion = scratch[0], motions[0]
    bodies = shapes.shape[0]
    world = begin(turns, taken)
    while True:
        world = next_world(world, turns, taken)
        if world < 0:
            break
        for c in range(at.REPORT_SIZE):
            report[world, c] = 0.0
        for b in range(bodies):
            i = world * bodies + b
            counts[i] = 0
            bind_body(world, i, shapes[b], params, gravity, wrench, friction, restitution, tilted, work)
            if not can_bear(work):
                note_fault(world, b, report)
                ev.note_change(log, counts, i, 0.0, ev.FAULT, -1)
                continue
            bind_fields(params, i, None, work)
            bind_laws(params, i, work)
            y = read_state(state, i)
            for k in range(steps * substeps):
                if contact is not None:
                    new = advance(
                        y, h, friction, smooth, gyroscopic, tilted, pivots, work, motion, memory, report, log, counts,
                        k * h,
                    )  # fmt: skip
                else:
                    motion.count = 0
                    set_clock(k * h, work)
                    new = fly_freely(y, h, gyroscopic, tilted, work, motion, report)
                if not is_finite(new):
                    note_fault(world, b, report)
                    ev.drop_events(i, 1, k * h, log, counts)
                    ev.note_change(log, counts, i, k * h, ev.FAULT, -1)
                    break
                y = new
            write_state(state, i, y)
            w = angular_velocity(y[1], y[3], work, tilted)
            state[i, at.ANGVEL], state[i, at.ANGVEL + 1], state[i, at.ANGVEL + 2] = w
