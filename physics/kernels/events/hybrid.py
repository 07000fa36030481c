"""The event-driven step of every world: smooth motion between events, each located to rounding.

A body flies, collides, moves in contact or rests:

- *flies*: exact flight to the next wall (`air`);
- *collides*: impulses at all touching contacts at once, or at one after the other, by the solver of the time-stepping
  scheme. A rebound that
  would be over within a threshold of time is not made: the rest of such a sequence of bounces, t/(1 - e) long for a
  first bounce of length t, is left out and stated with the event that ends it;
- *moves*: extrapolated smooth motion with the forces of the regime (`smooth`, `forces`) until a guard (`guards`) ends
  it; then the next regime is looked for a moment ahead (`regime`), where what the guard has foretold has happened;
- *rests*: nothing changes until the load does.

Where no regime is consistent (Painlevé) the velocities jump: the impulse of an inelastic collision, looked for a
moment ahead.

Baraff, *Coping with friction for non-penetrating rigid body simulation*, SIGGRAPH 1991, for impulses where forces
have no solution.
"""

from __future__ import annotations

import math

from physics.kernels import layout as at
from physics.kernels import quaternion as qt
from physics.kernels.body import angular_velocity, bind_body, is_finite, principal_attitude, read_state, write_state
from physics.kernels.compiler import kernel
from physics.kernels.events import log as ev
from physics.kernels.events.air import fly_freely, fly_to_wall
from physics.kernels.events.candidates import ASKS, ASKS_SLIDING, COLLIDES, FLIES, GOES_BACK, IS_LOST, RESTS
from physics.kernels.events.collide import (
    SOLVED,
    aim_collision,
    carry_on,
    log_impulses,
    or_plastic,
    pose_collision,
    pose_jump,
    within_energy,
)
from physics.kernels.events.guards import FORCES, NO_GUARD, NO_STEP, WATCH
from physics.kernels.events.move import body_speed, look_ahead, move
from physics.kernels.events.regime import find_regime
from physics.kernels.events.resting import read_resting
from physics.kernels.events.smooth import (
    cancel,
)
from physics.kernels.events.state import keep_contacts, log_changes, recall_contacts
from physics.kernels.events.trust import GROWTH, NONE, SHORTER, distrust, judge, name_of_regime
from physics.kernels.fields.loads import bind_fields, refresh_loads, set_clock
from physics.kernels.laws import bind_laws
from physics.kernels.resist import without_gain
from physics.kernels.solve import solve_contacts
from physics.kernels.stages import note_solve
from physics.kernels.turns import begin, next_world

# The next regime is looked for so much later, in the time radius / (speed + √(radius acceleration)): what a guard
# foretold is then above rounding, and the body has hardly moved. FURTHER times as far when it was not.
AHEAD = 1.0e-5
FURTHER = 8.0
FARTHEST = 64.0

# More than CROWD events within one look-ahead go round in circles, at the verge between two regimes. Then, as
# where no force is consistent, an impulse and a leap of LEAP look-aheads are made, to first order; the leaps grow while
# the crowd lasts, up to LONGEST, with PAUSE events between them.
CROWD = 24
LEAP = 1.0
LONGER = 4.0
LONGEST = 100.0
PAUSE = 6

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
def set_thresholds(y, tilted, work, motion):
    """What counts as no gap and no speed, and how far a regime is looked ahead; problems are solved to rounding.

    A contact is still when the speed would not lift it by HOP gaps that count as none: a bounce as low as that would
    gain from being set down on the wall what it loses in the impact.
    """
    work.still = work.unseen = 0.0
    x, speed = y[0], body_speed(y, tilted, work)
    motion.touch = max(work.slop, ROUNDING * (work.radius + math.sqrt(qt.dot(x, x))))
    motion.noise = 1.0e-13 * speed
    motion.still = math.sqrt(2.0 * HOP * work.acceleration * motion.touch) + motion.noise
    motion.slow = SLOW * motion.still + motion.noise
    unit = work.radius / (speed + math.sqrt(work.radius * work.acceleration) + TINY)
    motion.ahead = AHEAD * unit
    motion.together = (TOGETHER + 10.0 * work.tolerance) * unit


@kernel
def principal_axes(y, tilted, work):
    """Rotation matrix of the principal axes at y."""
    return qt.to_matrix(principal_attitude(y[1], work, tilted))


@kernel
def advance(y, h, friction, smooth, gyroscopic, tilted, pivots, work, motion, memory, report, log, counts, start):
    """State after h: events where they happen, smooth motion between them.

    A contact problem is posed by what the body does, solved in this one place, and read back. `seen` is where the
    regime is looked for: at y, or a moment ahead of it when a guard has ended the last one.
    """
    set_clock(start, work)
    refresh_loads(y, 0.0, tilted, work)
    set_thresholds(y, tilted, work, motion)
    nearest = motion.ahead
    recall_contacts(memory, work.i, work, motion)
    world = work.world
    motion.left_out, motion.turns = 0.0, 0
    seen, later, t = y, 0.0, 0.0
    told = NOTHING  # what is to be done next, whatever the regime: stop a contact that will leave, or jump
    since, crowd, leap = 0.0, 0, LEAP * motion.ahead
    kept, watched = y, 0.0  # where the last step began whose end has to be looked at, and its length
    motion.unheeded, ended = NONE, NONE  # the regime that a guard of force has ended
    width = 3
    if friction is None:
        width = 1
    for k in range(work.splits + 1):
        if k == work.splits:
            report[world, at.UNRESOLVED] += 1.0
            break
        crowd += 1
        if t > since + nearest:
            since, crowd = t, 0
        if crowd > CROWD:
            told = IS_LOST
        what, n, v, L = told, 0, y[2], y[3]
        if told == NOTHING:
            refresh_loads(seen, later, tilted, work)
            what, n, v, L = find_regime(seen, friction, tilted, work, motion)
            what = judge(what, watched, nearest, y, tilted, work, motion)
        is_asked, is_sliding = what in (ASKS, ASKS_SLIDING), what == ASKS_SLIDING
        told = NOTHING
        if what in (COLLIDES, IS_LOST):
            refresh_loads(y, 0.0, tilted, work)
        if what == COLLIDES:
            n, v, L = pose_collision(y, tilted, work, motion, report), y[2], y[3]
            aim_collision(n, y, tilted, motion, work)
        elif what == IS_LOST:
            n, v, L = pose_jump(y, min(leap, h - t), tilted, work, motion)
        if n > 0 and (is_asked or what in (COLLIDES, IS_LOST)):  # a leap may find nothing in reach
            P = principal_axes(seen if is_asked else y, tilted, work)
            solved = solve_contacts(n, friction, smooth, pivots, v, L, P, work)
            if what == COLLIDES:
                solved = or_plastic(n, friction, smooth, pivots, v, L, solved, P, work, report)
                solved = without_gain(n, friction, smooth, pivots, v, L, solved, P, work)
                if friction is not None and work.restitution > 0.0:
                    solved = within_energy(
                        n, y, friction, smooth, tilted, pivots, solved, P, work, motion, report
                    )  # fmt: skip
            v, L, residual, sweeps, method = solved
            note_solve(report, world, residual, sweeps, method, max(work.tolerance, SOLVED))
        if is_asked:
            what = read_resting(n, seen, v, L, friction, is_sliding, tilted, work, motion)
            what = judge(what, watched, nearest, y, tilted, work, motion)
            if what in (COLLIDES, IS_LOST):
                told, seen, later = what, y, 0.0
                continue
        elif what in (COLLIDES, IS_LOST):
            y = y[0], y[1], v, L
            log_impulses(n, width, work, motion, log, counts, start + t)
        step = 0.0
        if what == GOES_BACK:
            motion.trust = SHORTER * watched
            y, t, watched = kept, t - watched, 0.0
            seen, later = y, 0.0
            set_clock(start + t, work)
            continue
        if watched > 0.0:
            motion.trust, watched = GROWTH * watched, 0.0
            if not t < h:
                break
        if what == COLLIDES:
            report[world, at.SPLITS] += 1.0
            crowd -= motion.is_sequential  # those in turn have a bound of their own
            seen, later = y, 0.0
            continue
        log_changes(work, motion, log, counts, start + t)
        if what == RESTS:
            if not motion.is_resting:
                ev.note_event(log, counts, work.i, start + t + motion.left_out, ev.REST, -1, (0.0, 0.0, 0.0))
                y = cancel(y, tilted, work, motion)
                y = y[0], y[1], (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
            motion.is_resting = 1
            break
        motion.is_resting = 0
        guard = NO_GUARD
        if what == IS_LOST:
            report[world, at.FALLBACKS] += 1.0
            step = min(leap, h - t)
            y = carry_on(y, step, tilted, work)
            leap = min(LONGER * leap, LONGEST * nearest)
            since, crowd = t + step, CROWD - PAUSE
        elif what == FLIES:
            y, step, is_found = fly_to_wall(y, h - t, gyroscopic, tilted, work, motion)
            if not is_found:
                report[world, at.UNRESOLVED] += 1.0
        else:
            kept = y
            y, step, guard = move(y, h - t, tilted, work, motion)
            if guard == WATCH:
                watched = step
        t += step
        set_clock(start + t, work)
        if guard in FORCES and (step < motion.ahead or name_of_regime(motion) == ended):
            if not motion.ahead < FARTHEST * nearest:
                distrust(nearest, motion)
            motion.ahead = min(motion.ahead * FURTHER, FARTHEST * nearest)  # what was foretold has not been found
        elif step > motion.ahead:
            motion.ahead = nearest
            leap = max(LEAP * nearest, leap / LONGER)
        ended = name_of_regime(motion) if guard in FORCES else NONE
        motion.left_out, motion.turns = 0.0, 0
        if not t < h and guard != WATCH:
            break
        seen, later = y, 0.0
        if guard == NO_STEP:
            told = IS_LOST
        if guard in FORCES:
            seen, later = look_ahead(y, tilted, work, motion), motion.ahead
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
            bind_fields(params, i, work)
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
                    new = fly_freely(y, h, gyroscopic, tilted, work, motion)
                if not is_finite(new):
                    report[world, at.FAULTS] += 1.0
                    ev.note_event(log, counts, i, k * h, ev.FAULT, -1, (0.0, 0.0, 0.0))
                    break
                y = new
            write_state(state, i, y)
            w = angular_velocity(y[1], y[3], work, tilted)
            state[i, at.ANGVEL], state[i, at.ANGVEL + 1], state[i, at.ANGVEL + 2] = w
