"""The event-driven step of every world: smooth motion between events, each located to rounding.

A body flies, collides, moves in contact or rests:

- *flies*: exact flight to the next wall (`air`);
- *collides*: impulses at all touching contacts at once, by the solver of the time-stepping scheme. A rebound that
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
from physics.kernels.compiler import inlined, kernel
from physics.kernels.contact import wall_normal
from physics.kernels.events import log as ev
from physics.kernels.events.air import fly_freely, fly_to_wall
from physics.kernels.events.forces import arm_and_rate, free_turning, load
from physics.kernels.events.guards import CONE, GAP, LOAD, NO_GUARD, NO_STEP, PUSH, SPEED, least_margin, look_around
from physics.kernels.events.motion import END, START
from physics.kernels.events.regime import (
    ASKS,
    ASKS_SLIDING,
    COLLIDES,
    FLIES,
    IS_LOST,
    RESTS,
    find_regime,
    pose_contact,
    read_resting,
)
from physics.kernels.events.smooth import (
    CUT,
    EASY,
    GROWTH,
    SHORTEST,
    cancel,
    get_state,
    put_state,
    start_step,
    try_step,
)
from physics.kernels.slide import SLIDE
from physics.kernels.solve import solve_contacts
from physics.kernels.stages import MEMORY_HEAD, note_solve

# The next regime is looked for so much later, in the time radius / (speed + √(radius acceleration)): what a guard
# foretold is then above rounding, and the body has hardly moved. FURTHER times as far when it was not.
AHEAD = 1.0e-5
FURTHER = 8.0
FARTHEST = 64.0

# More than CROWD events within CROWD_TIME look-aheads go round in circles, at the verge between two regimes. Then, as
# where no force is consistent, an impulse and a leap of LEAP look-aheads are made, to first order; the leaps grow while
# the crowd lasts, up to LONGEST, with PAUSE events between them.
CROWD = 24
CROWD_TIME = 0.1
LEAP = 1.0
LONGER = 4.0
LONGEST = 100.0
PAUSE = 6

# Gaps of this share of what they are the difference of are rounding; see `set_thresholds` for HOP.
ROUNDING = 1.0e-15
HOP = 4.0
SETTLED = 1.0e-6

# Contacts that touch within this share of the same time, and ten times the tolerance, do so at once: rounding would
# else make two impacts of that of an edge, with another outcome.
TOGETHER = 1.0e-10
TINY = 1.0e-300

# Smooth steps at most before the next regime is looked for.
STEPS = 10_000

# Trials of the time at which a guard ends a step.
LOCATIONS = 110

# Residual of a contact problem that is as good as none: rounding of forces that differ by five orders.
SOLVED = 1.0e-11

NOTHING = -1

# State of a body at a wall (`motion.state`).
AWAY, SLIPS, STICKS = range(3)


@inlined
def rebound(speed, normal, r, rate, w, alpha, work, motion):
    """Velocity asked of a contact that approaches with `speed`; what a bounce too short leaves out is noted.

    With the free acceleration b towards the wall a bounce at e times the speed takes t = 2 e speed / b, and all that
    follow it t e/(1 - e).
    """
    if not speed > motion.still:
        return 0.0
    goal = work.restitution * speed
    if goal > motion.still:
        return goal
    a, c, g = load(work.free_acceleration), qt.cross(alpha, r), qt.cross(w, rate)
    b = -(qt.dot(normal, a) + qt.dot(normal, c) + qt.dot(normal, g))
    if b > 0.0 and work.restitution < 1.0:
        motion.left_out = max(motion.left_out, 2.0 * goal / (b * (1.0 - work.restitution)))
    return 0.0


@kernel
def pose_collision(y, tilted, work, motion, report):
    """Write the contact problem of all contacts that touch, or would in no time, into `work`; their number."""
    put_state(motion, START, y)
    look_around(START, tilted, work, motion)
    R, _, w, alpha = free_turning(y, tilted, work)
    n = 0
    motion.left_out = 0.0
    for s in range(motion.is_active.shape[0]):
        rate = motion.gap_rate[START, s]
        if not motion.gap[START, s] <= max(motion.touch, -rate * motion.together) or n >= work.slot.shape[0]:
            continue
        normal = wall_normal(work.walls, s // work.features)
        r, r_rate = arm_and_rate(work.shape, load(work.dims), R, w, normal, s % work.features, tilted, work)
        goal = rebound(-rate, normal, r, r_rate, w, alpha, work, motion)
        pose_contact(n, s, r, (goal, 0.0, 0.0), work)
        n += 1
        report[work.world, at.PENETRATION] = max(report[work.world, at.PENETRATION], -motion.gap[START, s])
    work.mode = SLIDE
    return n


@kernel
def pose_jump(y, h, tilted, work, motion):
    """Write the contact problem of a first-order step over h into `work`: (contacts, velocity, angular momentum)."""
    put_state(motion, START, y)
    look_around(START, tilted, work, motion)
    R, _, w, _ = free_turning(y, tilted, work)
    count = 0
    for s in range(motion.is_active.shape[0]):
        gap = motion.gap[START, s]
        if not gap <= motion.touch - min(0.0, motion.gap_rate[START, s]) * h or count >= work.slot.shape[0]:
            continue
        n = wall_normal(work.walls, s // work.features)
        r, _ = arm_and_rate(work.shape, load(work.dims), R, w, n, s % work.features, tilted, work)
        pose_contact(count, s, r, (-max(gap, 0.0) / h, 0.0, 0.0), work)
        count += 1
    work.mode = SLIDE
    a, torque, v, L = work.free_acceleration, work.torque, y[2], y[3]
    return (
        count,
        (v[0] + h * a[0], v[1] + h * a[1], v[2] + h * a[2]),
        (L[0] + h * torque[0], L[1] + h * torque[1], L[2] + h * torque[2]),
    )


@kernel
def carry_on(y, h, tilted, work):
    """State after a moment h at constant velocities."""
    x, q, v, L = y
    w = angular_velocity(q, L, work, tilted)
    x = (x[0] + h * v[0], x[1] + h * v[1], x[2] + h * v[2])
    return x, qt.normalise(qt.multiply(qt.exponential((h * w[0], h * w[1], h * w[2])), q)), v, L


@kernel
def log_impulses(n, width, work, motion, log, counts, t):
    """One event per wall with the sum of its impulses, if that is above rounding."""
    least = work.mass * motion.noise
    for wall in range(work.walls.shape[0]):
        px = py = pz = 0.0
        for i in range(n):
            if work.slot[i] // work.features == wall:
                for c in range(width):
                    s = work.impulse[width * i + c]
                    px += s * work.walls[wall, 3 * c]
                    py += s * work.walls[wall, 3 * c + 1]
                    pz += s * work.walls[wall, 3 * c + 2]
        if px * px + py * py + pz * pz > least * least:
            ev.note_event(log, counts, work.i, t, ev.IMPACT, wall, (px, py, pz))


@kernel
def log_changes(work, motion, log, counts, t):
    """Events of the walls at which the body now does something else."""
    zero = (0.0, 0.0, 0.0)
    for wall in range(work.walls.shape[0]):
        state = AWAY
        for j in range(motion.count):
            if motion.slot[j] // work.features == wall:
                if motion.holds[j]:
                    state = STICKS
                elif state == AWAY:
                    state = SLIPS
        old = motion.state[wall]
        if state == old:
            continue
        motion.state[wall] = state
        if old == AWAY:
            ev.note_event(log, counts, work.i, t + motion.left_out, ev.TOUCH, wall, zero)
        elif state == AWAY:
            ev.note_event(log, counts, work.i, t, ev.RELEASE, wall, zero)
        else:
            ev.note_event(log, counts, work.i, t, ev.STICK if state == STICKS else ev.SLIP, wall, zero)


@kernel
def locate(h, margin, tilted, work, motion):
    """End the step where its smallest margin is zero (END): (its length, guard, contact or slot).

    False position with the Illinois rule, and a half after each trial that left more than half.
    """
    low, high, low_margin, high_margin = 0.0, h, 1.0e-3, margin
    guard, which = 0, -1
    side, width = 0, 4.0 * h
    for _ in range(LOCATIONS):
        t = low + (high - low) * low_margin / (low_margin - high_margin)
        if high - low > 0.5 * width or not low < t < high:
            t = 0.5 * (low + high)
        width = high - low
        try_step(t, tilted, work, motion)
        margin, g, w = least_margin(t, tilted, work, motion)
        if margin < 0.0:
            high, high_margin, guard, which = t, margin, g, w
            if side == 1:
                low_margin *= 0.5
            side = 1
        else:
            low, low_margin = t, margin
            if g == GAP and margin <= 1.0e-15:
                return t, g, w
            if side == -1:
                high_margin *= 0.5
            side = -1
        if high - low <= 1.0e-15 * h or (margin < 0.0 and margin > -1.0e-15):
            break
    if margin >= 0.0:
        try_step(high, tilted, work, motion)
        _, guard, which = least_margin(high, tilted, work, motion)
    return high, guard, which


@inlined
def has_stopped(guard, which, work, motion):
    """Whether the contact that ended a step all but stands still there: then that is the end, not before."""
    if guard != SPEED:
        return False
    n = wall_normal(work.walls, motion.slot[which] // work.features)
    u = motion.velocity
    un = u[which, 0] * n[0] + u[which, 1] * n[1] + u[which, 2] * n[2]
    t0, t1, t2 = u[which, 0] - un * n[0], u[which, 1] - un * n[1], u[which, 2] - un * n[2]
    return t0 * t0 + t1 * t1 + t2 * t2 <= motion.still * motion.still


@inlined
def body_speed(y, tilted, work):
    """Speed that no point of the body exceeds [m/s]."""
    v, w = y[2], angular_velocity(y[1], y[3], work, tilted)
    return math.sqrt(qt.dot(v, v)) + work.radius * math.sqrt(qt.dot(w, w))


@kernel
def move(y, left, tilted, work, motion):
    """Smooth motion of the regime for `left`, or until a guard ends it: (state, time, guard)."""
    had = body_speed(y, tilted, work)
    y = cancel(y, tilted, work, motion)
    if had > motion.still and body_speed(y, tilted, work) <= SETTLED * motion.still:
        return y, 0.0, SPEED  # the contacts have taken all of it: it may be at rest
    put_state(motion, START, y)
    look_around(START, tilted, work, motion)
    motion.step = left
    t = 0.0
    for _ in range(STEPS):
        h = start_step(left - t, tilted, work, motion)
        error, used = try_step(h, tilted, work, motion)
        if not error <= work.tolerance:
            if not h > SHORTEST * left:
                return get_state(motion, START), t, NO_STEP
            motion.step = CUT * h
            continue
        margin, guard, which = least_margin(h, tilted, work, motion)
        is_over = margin < 0.0
        if is_over and not has_stopped(guard, which, work, motion):
            h, guard, which = locate(h, margin, tilted, work, motion)
        t += h
        motion.step = GROWTH * h if used <= EASY else h
        y = cancel(get_state(motion, END), tilted, work, motion)
        if is_over:
            return y, t, guard
        put_state(motion, START, y)
        if not t < left:
            break
        for s in range(motion.is_active.shape[0]):
            motion.gap[START, s], motion.gap_rate[START, s] = motion.gap[END, s], motion.gap_rate[END, s]
    if t < left:
        return get_state(motion, START), t, NO_STEP
    return y, left, NO_GUARD


@kernel
def look_ahead(y, tilted, work, motion):
    """Where the regime would lead in a moment."""
    put_state(motion, START, y)
    motion.step = motion.ahead
    start_step(motion.ahead, tilted, work, motion)
    try_step(motion.ahead, tilted, work, motion)
    return cancel(get_state(motion, END), tilted, work, motion)


@kernel
def set_thresholds(y, tilted, work, motion):
    """What counts as no gap and no speed, and how far a regime is looked ahead.

    A contact is still when the speed would not lift it by HOP gaps that count as none: a bounce as low as that would
    gain from being set down on the wall what it loses in the impact.
    """
    x, speed = y[0], body_speed(y, tilted, work)
    motion.touch = max(work.slop, ROUNDING * (work.radius + math.sqrt(qt.dot(x, x))))
    motion.noise = 1.0e-13 * speed
    motion.still = math.sqrt(2.0 * HOP * work.acceleration * motion.touch) + motion.noise
    unit = work.radius / (speed + math.sqrt(work.radius * work.acceleration) + TINY)
    motion.ahead = AHEAD * unit
    motion.together = (TOGETHER + 10.0 * work.tolerance) * unit


@kernel
def keep_contacts(memory, i, work, motion):
    """What the body does at the walls, and its contact forces, for those who ask (`stages.store_warm_start`)."""
    slots = work.slot.shape[0]
    row = MEMORY_HEAD + slots
    for k in range(int(memory[i, 1])):
        for c in range(3):
            memory[i, row + 3 * int(memory[i, MEMORY_HEAD + k]) + c] = 0.0
    memory[i, 0], memory[i, 1] = 1.0, motion.count
    for j in range(motion.count):
        slot = motion.slot[j]
        memory[i, MEMORY_HEAD + j] = slot
        f = motion.force
        for c in range(3):
            k = 3 * c
            wall = slot // work.features
            memory[i, row + 3 * slot + c] = (
                f[j, 0] * work.walls[wall, k] + f[j, 1] * work.walls[wall, k + 1] + f[j, 2] * work.walls[wall, k + 2]
            )
    total = 0.0
    for wall in range(work.walls.shape[0] - 1, -1, -1):
        total = 3.0 * total + motion.state[wall]
    memory[i, 2] = 2.0 * total + motion.is_resting


@inlined
def recall_contacts(memory, i, work, motion):
    """What the body did at the end of the last step: whether it rested, and base 3 a digit per wall."""
    total = int(memory[i, 2])
    motion.is_resting = total % 2
    total //= 2
    for wall in range(work.walls.shape[0]):
        motion.state[wall] = total % 3
        total //= 3


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
    set_thresholds(y, tilted, work, motion)
    nearest = motion.ahead
    recall_contacts(memory, work.i, work, motion)
    world = work.world
    motion.left_out = 0.0
    seen, t = y, 0.0
    told = NOTHING  # what is to be done next, whatever the regime: stop a contact that will leave, or jump
    since, crowd, leap = 0.0, 0, LEAP * motion.ahead
    width = 3
    if friction is None:
        width = 1
    for k in range(work.splits + 1):
        if k == work.splits:
            report[world, at.UNRESOLVED] += 1.0
            break
        crowd += 1
        if t > since + CROWD_TIME * nearest:
            since, crowd = t, 0
        if crowd > CROWD:
            told = IS_LOST
        what, n, v, L = told, 0, y[2], y[3]
        if told == NOTHING:
            what, n, v, L = find_regime(seen, friction, tilted, work, motion)
        is_asked, is_sliding = what in (ASKS, ASKS_SLIDING), what == ASKS_SLIDING
        told = NOTHING
        if what == COLLIDES:
            n, v, L = pose_collision(y, tilted, work, motion, report), y[2], y[3]
        elif what == IS_LOST:
            n, v, L = pose_jump(y, min(leap, h - t), tilted, work, motion)
        if is_asked or what in (COLLIDES, IS_LOST):
            P = principal_axes(seen if is_asked else y, tilted, work)
            v, L, residual, sweeps, method = solve_contacts(n, friction, smooth, pivots, v, L, P, work)
            note_solve(report, world, residual, sweeps, method, max(work.tolerance, SOLVED))
        if is_asked:
            what = read_resting(n, seen, v, L, friction, is_sliding, tilted, work, motion)
            if what in (COLLIDES, IS_LOST):
                told, seen = what, y
                continue
        elif what in (COLLIDES, IS_LOST):
            y = y[0], y[1], v, L
            log_impulses(n, width, work, motion, log, counts, start + t)
        step = 0.0
        if what == COLLIDES:
            report[world, at.SPLITS] += 1.0
            seen = y
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
            y, step, _, ended = fly_to_wall(y, h - t, gyroscopic, tilted, work, motion)
            if not ended:
                report[world, at.UNRESOLVED] += 1.0
        else:
            y, step, guard = move(y, h - t, tilted, work, motion)
        t += step
        if guard in (PUSH, CONE, LOAD) and step < motion.ahead:
            motion.ahead = min(motion.ahead * FURTHER, FARTHEST * nearest)  # rounding hid what was foretold
        elif step > motion.ahead:
            motion.ahead = nearest
            leap = max(LEAP * nearest, leap / LONGER)
        motion.left_out = 0.0
        if not t < h:
            break
        seen = y
        if guard == NO_STEP:
            told = IS_LOST
        if guard in (PUSH, CONE, LOAD):
            seen = look_ahead(y, tilted, work, motion)
    keep_contacts(memory, work.i, work, motion)
    return y


@kernel
def step_events(
    first, last, steps, substeps, h, state, params, shapes, gravity, wrench, contact, friction, smooth, restitution,
    gyroscopic, tilted, pivots, memory, report, scratch, motions, log, counts,
):  # fmt: skip
    """Advance the worlds first <= world < last by `steps` steps of `substeps` parts of h seconds each.

    Events go to `log` (rows, room, EVENT_SIZE), their number to `counts` (rows,); otherwise as `step.step_worlds`.
    """
    work, motion = scratch[0], motions[0]
    bodies = shapes.shape[0]
    for world in range(first, last):
        for c in range(at.REPORT_SIZE):
            report[world, c] = 0.0
        for b in range(bodies):
            i = world * bodies + b
            counts[i] = 0
            bind_body(world, i, shapes[b], params, gravity, wrench, friction, restitution, tilted, work)
            y = read_state(state, i)
            for k in range(steps * substeps):
                if contact is not None:
                    new = advance(
                        y, h, friction, smooth, gyroscopic, tilted, pivots, work, motion, memory, report, log, counts,
                        k * h,
                    )  # fmt: skip
                else:
                    motion.count = 0
                    new = fly_freely(y, h, gyroscopic, tilted, work, motion)
                if not is_finite(new):
                    report[world, at.FAULTS] += 1.0
                    ev.note_event(log, counts, i, k * h, ev.FAULT, -1, (0.0, 0.0, 0.0))
                    break
                y = new
            write_state(state, i, y)
            w = angular_velocity(y[1], y[3], work, tilted)
            state[i, at.ANGVEL], state[i, at.ANGVEL + 1], state[i, at.ANGVEL + 2] = w
