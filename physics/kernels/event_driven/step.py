"""Event-driven scheme, one body at walls: smooth motion between events, each located to rounding.

A substep goes from event to event through these parts, until its time is used up. y = (x, q, v, L) is the state, M its
mass and inertia, f the load, J the Jacobian of the contacts, u their velocities, p their impulses, λ their forces.

1. Hold loads         f = f(y, t), anew at every state of the integration                  `held_loads.refresh_loads`
2. Find contacts      the contact mode: contacts that touch, and which stick and slide     `classify_mode`
3. Resolve impacts    M Δ(v, ω) = Jᵀ p, u_n⁺ >= -e u_n⁻ ⟂ p_n >= 0, |p_t| <= μ p_n         `resolve_impacts`
4. Limit the stage    the first t at which a guard (gap, push, cone, speed) is zero        `guards`, `time_of_impact`
5. Integrate          in the air the exact flow to the next wall                           `fly_to_wall`
                      in contact M v̇ = f + Jᵀ λ with u̇_n = 0, u̇_t = 0 or λ_t = -μ λ_n d,   `integrate_segment`
                      extrapolated to the tolerance
6. Correct positions  y is projected onto g_n = 0, u_n = 0 of the contacts                 `project_state`
7. Rest               the body stays where it is until its load changes                    `come_to_rest`
8. Sleep              a body whose motion stays below a threshold is left out              `settles_down`

A rebound below a threshold of speed is not made. It would begin a sequence of bounces, t/(1 - e) long for a first
bounce of length t. This sequence is left out, and its time is added to that of the event that ends it. If no contact
mode is consistent (Painlevé's paradox), the velocities jump, by the impulse of an inelastic collision. The body then
moves on for a moment with these velocities (a leap).

The arguments of the kernels: y is the state of the body, `scratch` its workspace (`time_stepping.workspace`), `motion`
the scratch memory of this scheme (`event_driven.workspace.Motion`).

References
----------
.. [1] D. Baraff, *Coping with friction for non-penetrating rigid body simulation*, SIGGRAPH 1991, for impulses where
   forces have no solution.
"""

from __future__ import annotations

import math

from physics.compiler.decorators import if_given, inlined, kernel
from physics.kernels.contact_law.materials import bind_materials
from physics.kernels.contact_solver.holding import hold_at_rest
from physics.kernels.contact_solver.solve import solve_contacts
from physics.kernels.event_driven.acceleration_problem import read_resting_mode
from physics.kernels.event_driven.chatter_control import (
    adapt_look_ahead,
    is_chattering,
    lengthen_leap,
    reset_chatter_control,
)
from physics.kernels.event_driven.constraint_projection import project_state
from physics.kernels.event_driven.contact_candidates import (
    MODE_FLIGHT,
    MODE_IMPACT,
    MODE_INCONSISTENT,
    MODE_REST,
    MODE_ROLLBACK,
    MODE_UNDECIDED,
    MODE_UNDECIDED_SLIDING,
)
from physics.kernels.event_driven.contact_mode import find_contact_mode
from physics.kernels.event_driven.falling_asleep import settles_down
from physics.kernels.event_driven.guards import FORCE_GUARDS, GUARD_NONE, GUARD_STEP_FAILED, GUARD_WATCH
from physics.kernels.event_driven.impact import (
    drift_at_velocity,
    principal_rotation,
    report_impact_solve,
    resolve_impacts,
    resolve_inconsistency,
)
from physics.kernels.event_driven.mode_acceptance import TRUST_GROWTH, TRUST_SHRINK, accept_step
from physics.kernels.event_driven.mode_transitions import load_contact_modes, log_mode_changes, store_contact_modes
from physics.kernels.event_driven.smooth_segment import body_speed_bound, integrate_segment, predict_state
from physics.kernels.event_driven.time_of_impact import count_unresolved_flight, fly_freely, fly_to_wall
from physics.kernels.event_driven.workspace import Motion, Workspaces
from physics.kernels.forces.held_loads import bind_fields, refresh_loads, set_clock
from physics.kernels.math import quaternion as qt
from physics.kernels.parallel.work_stealing import for_each_world
from physics.kernels.state import layout as at
from physics.kernels.state.body import (
    angular_velocity,
    bind_body,
    clear_report,
    has_finite_loads,
    is_finite,
    read_state,
    report_fault,
    write_state,
)
from physics.kernels.state.contact_law_dispatch import bind_laws
from physics.kernels.state.sleeping import remains_asleep, without_velocities
from physics.kernels.time_stepping import event_log as ev

# Gaps below this share of the coordinates that they are differences of are rounding. For the second constant see
# `set_event_thresholds`.
_ROUNDING = 1.0e-15
_UNSEEN_HOP_GAPS = 4.0

# Contacts that touch within this time, plus ten tolerances, touch at once, in units of the time in which the body moves
# by its radius. Otherwise rounding would make two impacts of the impact of an edge, with a different result.
_SIMULTANEOUS_SHARE = 1.0e-10
_TINY = 1.0e-300

# Sliding ends at this share of the rest speed, below which a contact does not count as leaving.
_SLIP_STOP_SHARE = 1.0e-2

_NO_FORCED_MODE = -1


@kernel
def set_event_thresholds(y, h, offset_frame, scratch, motion):
    """Set the thresholds of the event-driven scheme for a substep of length h from y, and reset the chatter control.

    `thresholds.touch_gap`, the gap that counts as zero, covers the rounding of any place that the body may reach within
    h. `thresholds.rest_speed`, the speed that counts as zero, lifts a contact by less than `_UNSEEN_HOP_GAPS` such
    gaps. In a lower bounce the energy error of setting the body down on the wall would be as large as the loss of the
    impact.
    Limits of the contact solver's residual are set to 0, so that problems are solved to rounding.
    """
    body = scratch.body
    thresholds = motion.thresholds
    scratch.stage.residual_limit = scratch.stage.target_error_limit = 0.0
    x, speed = y[0], body_speed_bound(y, offset_frame, body)
    thresholds.touch_gap = max(body.slop, _ROUNDING * (body.radius + math.sqrt(qt.dot(x, x)) + h * speed))
    thresholds.rounding_speed = 1.0e-13 * speed
    hop = 2.0 * _UNSEEN_HOP_GAPS * body.acceleration * thresholds.touch_gap
    thresholds.rest_speed = math.sqrt(hop) + thresholds.rounding_speed
    thresholds.slip_stop_speed = _SLIP_STOP_SHARE * thresholds.rest_speed + thresholds.rounding_speed
    unit = body.radius / (speed + math.sqrt(body.radius * body.acceleration) + _TINY)
    reset_chatter_control(unit, motion.pace)
    thresholds.simultaneity_time = (_SIMULTANEOUS_SHARE + 10.0 * scratch.settings.tolerance) * unit


@inlined
def begin_event_substep(y, start, h, offset_frame, memory, scratch, motion):
    """Prepare a substep of length h [s] from y, which begins `start` [s] after the start of the call.

    Sets clock, loads and thresholds, and loads the contact mode at the end of the last step from `memory`.
    """
    body = scratch.body
    set_clock(start, body)
    refresh_loads(y, 0.0, offset_frame, body)
    set_event_thresholds(y, h, offset_frame, scratch, motion)
    motion.pace.assured_time = 0.0
    load_contact_modes(memory, body.i, scratch, motion)
    motion.pace.skipped_bounce_time, motion.pace.sequential_impacts = 0.0, 0


def _may_slide(contact, n, free, solved, scratch):
    return solved


@if_given("contact.friction", _may_slide)
def _hold_if_possible(contact, n, free, solved, scratch):
    """Acceleration and moment of a body whose n contacts are at rest: zero if it can stay at rest, else `solved`.

    `free` are those without contact forces.
    """
    a, moment = solved
    if qt.dot(a, a) + qt.dot(moment, moment) > 0.0 and hold_at_rest(n, free[0], free[1], scratch):
        return (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    return a, moment


@kernel
def classify_mode(y, is_foretold, watched, contact, offset_frame, scratch, motion, report):
    """Find the contact mode of the body from y on: (MODE_ code, whether a contact problem was solved for it).

    If a force guard foretold the end of the last mode (`is_foretold`), the mode is searched at a state predicted a
    moment later. `watched` is the length of the last step if it has yet to be accepted (`mode_acceptance`), else 0.
    Only a mode from a contact problem may be MODE_REST.
    """
    seen, later = y, 0.0
    if is_foretold:
        seen, later = predict_state(y, offset_frame, scratch, motion), motion.pace.look_ahead
    motion.pace.assured_time = later
    refresh_loads(seen, later, offset_frame, scratch.body)
    what, n, v, L = find_contact_mode(seen, contact.friction, offset_frame, scratch, motion)
    what = accept_step(what, watched, y, offset_frame, scratch, motion)
    if what not in (MODE_UNDECIDED, MODE_UNDECIDED_SLIDING):
        return what, False
    if n > 0:
        P, free = principal_rotation(seen, offset_frame, scratch.body), (v, L)
        solved = solve_contacts(n, contact, v, L, P, scratch)
        report_impact_solve(solved, report, scratch)
        v, L = solved[0], solved[1]
        if what == MODE_UNDECIDED:
            v, L = _hold_if_possible(contact, n, free, (v, L), scratch)
    what = read_resting_mode(
        n, seen, v, L, contact.friction, what == MODE_UNDECIDED_SLIDING, offset_frame, scratch, motion
    )
    return accept_step(what, watched, y, offset_frame, scratch, motion), True


@kernel
def come_to_rest(y, t, offset_frame, scratch, motion, log, counts):
    """State of a body that rests from the time t on: projected onto its contacts, without velocities; log the event."""
    if motion.smooth.is_resting:
        return y
    motion.smooth.is_resting = 1
    ev.note_mode_change(log, counts, scratch.body.i, t + motion.pace.skipped_bounce_time, ev.KIND_REST, -1)
    x, q, _, _ = project_state(y, offset_frame, scratch, motion)
    return x, q, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)


@kernel
def integrate_mode(what, y, t, h, flight, scratch, motion, report):
    """Move the body from y in the contact mode `what`: (new state, duration [s], guard that ended the motion).

    In flight it flies to the next wall, in an inconsistent mode it makes a leap, otherwise it moves smoothly in
    contact. t is the time in the substep, whose length is h [s].
    """
    body = scratch.body
    if what == MODE_INCONSISTENT:
        report[body.world, at.FALLBACKS] += 1.0
        step = min(motion.pace.next_leap, h - t)
        lengthen_leap(t + step, motion.pace)
        return drift_at_velocity(y, step, flight.offset_frame, body), step, GUARD_NONE
    if what == MODE_FLIGHT:
        y, step, is_found = fly_to_wall(y, h - t, flight.gyroscopic, flight.offset_frame, scratch, motion, report)
        if not is_found:
            count_unresolved_flight(report, body)
        return y, step, GUARD_NONE
    return integrate_segment(y, h - t, flight.offset_frame, scratch, motion)


@kernel
def advance(y, h, contact, flight, scratch, motion, records, start):
    """State after a substep of h [s] from y, which begins `start` [s] after the start of the call.

    Each round of the loop finds the contact mode (`forced_mode`, if it is known already), and moves the body in it. A
    step that has yet to be accepted (`mode_acceptance`) began at `rollback_state`, and has the length `watched`.
    """
    body = scratch.body
    pace = motion.pace
    begin_event_substep(y, start, h, flight.offset_frame, records.memory, scratch, motion)
    t, forced_mode, is_foretold, rollback_state, watched = 0.0, _NO_FORCED_MODE, False, y, 0.0
    for k in range(scratch.settings.splits + 1):
        if k == scratch.settings.splits:
            records.report[body.world, at.UNRESOLVED] += 1.0
            break
        if is_chattering(t, pace):
            forced_mode = MODE_INCONSISTENT
        mode, is_answer = forced_mode, False
        if forced_mode == _NO_FORCED_MODE:
            mode, is_answer = classify_mode(
                y, is_foretold, watched, contact, flight.offset_frame, scratch, motion, records.report
            )
        forced_mode = _NO_FORCED_MODE
        if is_answer and mode in (MODE_IMPACT, MODE_INCONSISTENT):
            forced_mode, is_foretold = mode, False
            continue
        if mode == MODE_IMPACT:
            y = resolve_impacts(y, start + t, contact, flight.offset_frame, scratch, motion, records)
        elif mode == MODE_INCONSISTENT:
            leap = min(pace.next_leap, h - t)
            y = resolve_inconsistency(y, leap, start + t, contact, flight.offset_frame, scratch, motion, records)
        elif mode == MODE_ROLLBACK:
            pace.watched_length = TRUST_SHRINK * watched
            y, t, watched, is_foretold = rollback_state, t - watched, 0.0, False
            set_clock(start + t, body)
            continue
        if watched > 0.0:
            pace.watched_length, watched = TRUST_GROWTH * watched, 0.0
            if not t < h:
                break
        if mode == MODE_IMPACT:
            records.report[body.world, at.SPLITS] += 1.0
            pace.chatter_count -= motion.thresholds.is_sequential  # sequential impacts have a limit of their own
            is_foretold = False
            continue
        log_mode_changes(scratch, motion, records.log, records.counts, start + t)
        if mode == MODE_REST:
            y = come_to_rest(y, start + t, flight.offset_frame, scratch, motion, records.log, records.counts)
            break
        motion.smooth.is_resting, rollback_state = 0, y
        y, step, guard = integrate_mode(mode, y, t, h, flight, scratch, motion, records.report)
        t += step
        set_clock(start + t, body)
        adapt_look_ahead(step, guard, motion)
        pace.skipped_bounce_time, pace.sequential_impacts = 0.0, 0
        if guard == GUARD_WATCH:
            watched = step
        elif not t < h:
            break
        elif guard == GUARD_STEP_FAILED:
            forced_mode = MODE_INCONSISTENT
        is_foretold = guard in FORCE_GUARDS
    store_contact_modes(records.memory, body.i, scratch, motion)
    return y


def _fly_substep(y, h, contact, flight, scratch, motion, records, start):
    motion.contacts.count = 0
    set_clock(start, scratch.body)
    return fly_freely(y, h, flight.gyroscopic, flight.offset_frame, scratch, motion, records.report)


@if_given("contact.acts", _fly_substep)
def _take_substep(y, h, contact, flight, scratch, motion, records, start):
    """State after a substep of h [s] from y, which begins `start` [s] after the start of the call.

    In scenes without contact the body flies.
    """
    return advance(y, h, contact, flight, scratch, motion, records, start)


@inlined
def advance_world(world, grid, bodies, contact, restitution, flight, sleep, records, workspaces):
    """Advance each body of a world by `grid.steps` steps, from event to event; write states, report and events.

    Events go to `records.log`, their number to `records.counts`. A body whose new state is not finite keeps the old
    one, and the report counts a fault. Sleeping bodies are left out; `sleep` is None where the scene does not declare
    sleep. The groups of arguments are those of `physics.kernels.state.groups`.
    """
    scratch, motion = workspaces.scratch, workspaces.motion
    body = scratch.body
    h, count = grid.h, bodies.shapes.shape[0]
    clear_report(world, records.report)
    for b in range(count):
        i = world * count + b
        records.counts[i] = 0
        if sleep is not None and remains_asleep(i, bodies.wrench, sleep):
            continue
        bind_body(world, i, bodies.shapes[b], bodies, contact.friction, restitution, flight.offset_frame, body)
        if not has_finite_loads(body):
            report_fault(world, b, records.report)
            ev.note_mode_change(records.log, records.counts, i, 0.0, ev.KIND_FAULT, -1)
            continue
        bind_fields(bodies.params, i, None, body)
        bind_laws(bodies.params, i, bodies.params.shape[1], body)
        bind_materials(bodies.params, i, body)
        y = read_state(bodies.state, i)
        for k in range(grid.steps * grid.substeps):
            new = _take_substep(y, h, contact, flight, scratch, motion, records, k * h)
            if not is_finite(new):
                report_fault(world, b, records.report)
                ev.drop_events(i, 1, k * h, records.log, records.counts)
                ev.note_mode_change(records.log, records.counts, i, k * h, ev.KIND_FAULT, -1)
                break
            y = new
            if sleep is not None and settles_down(i, y, h, sleep, flight.offset_frame, scratch, motion):
                y = without_velocities(y)
                break
        write_state(bodies.state, i, y)
        w = angular_velocity(y[1], y[3], body, flight.offset_frame)
        bodies.state[i, at.ANGVEL], bodies.state[i, at.ANGVEL + 1], bodies.state[i, at.ANGVEL + 2] = w


_advance_worlds = for_each_world(advance_world)


@kernel
def step_events(queue, grid, bodies, contact, restitution, flight, sleep, records, workspaces):
    """Advance all worlds that the calling thread can take from `queue`, from event to event (`advance_world`).

    `workspaces` are those of the thread, a `Workspaces` with arrays of one record.
    """
    motions = workspaces.motion
    motion = Motion(
        motions.thresholds[0],
        motions.pace[0],
        motions.contacts[0],
        motions.unknowns[0],
        motions.candidates[0],
        motions.smooth[0],
    )
    inner = Workspaces(workspaces.scratch[0], motion)
    _advance_worlds(queue, (grid, bodies, contact, restitution, flight, sleep, records, inner))
