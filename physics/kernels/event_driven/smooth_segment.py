"""Smooth motion of a regime up to the guard that ends it, and a look at what comes next."""

from __future__ import annotations

import math

from physics.kernels.compile.decorators import inlined, kernel
from physics.kernels.event_driven.constraint_projection import cancel
from physics.kernels.event_driven.contact_candidates import set_down
from physics.kernels.event_driven.contact_forces import free_turning, keep_forces, vector
from physics.kernels.event_driven.extrapolated_midpoint import (
    CUT,
    EASY,
    GROWTH,
    SHORTEST,
    find_rate,
    get_state,
    put_state,
    start_step,
    try_step,
)
from physics.kernels.event_driven.force_minima import find_dip, note_margins
from physics.kernels.event_driven.guards import (
    FORCES,
    GAP,
    MARGIN,
    NO_GUARD,
    NO_STEP,
    SPEED,
    WATCH,
    least_force_at_start,
    least_margin,
    look_around,
)
from physics.kernels.event_driven.mode_acceptance import is_heeded
from physics.kernels.event_driven.slip_onset import contact_rate, outruns, sliding_velocity
from physics.kernels.event_driven.workspace import END, SIZE, START
from physics.kernels.forces.held_loads import pass_time, refresh_loads
from physics.kernels.math import quaternion as qt
from physics.kernels.state.body import angular_velocity

# Smooth steps at most before the next regime is looked for.
STEPS = 10_000

# Trials of the time at which a guard ends a step, those after which what is left must have been halved, and margins
# that are none: of a gap and of all others.
LOCATIONS = 110
PATIENCE = 3
MET = (1.0e-15, 1.0e-13)

# A body whose contacts, when set right, take its speed down to this share of `motion.still` may be at rest.
SETTLED = 1.0e-6


@inlined
def towards_gap(t, margin, guard, which, work, motion):
    """Newton's step for the time at which the gap that was missed at END, t after START, is closed; -1 without one."""
    if guard != GAP or not motion.gap_rate[END, which] < 0.0:
        return -1.0
    return t - margin * work.radius / motion.gap_rate[END, which]


@kernel
def locate(h, margin, guard, which, heeds, tilted, work, motion):
    """End the step where its smallest margin is zero (END): (its length, guard, contact or slot).

    Newton's steps for a gap. Else false position with the Illinois rule, and a half where PATIENCE trials have not
    halved what is left. NO_STEP where a shorter step fails that was to be smooth: the margin changes its sign at a pole
    (Painlevé), which the whole step did not see.

    A force that was there at the start ends where it is zero, not where it is missed by more than rounding.
    """
    low, high, low_margin, high_margin = 0.0, h, -margin, margin
    slack = MARGIN
    if guard in FORCES:
        least = least_force_at_start(tilted, work, motion)
        if least > MARGIN:
            slack, low_margin, high_margin = 0.0, least, margin - MARGIN
    side, width, stale = 0, h, 0
    newton = towards_gap(h, margin, guard, which, work, motion)
    for _ in range(LOCATIONS):
        t = newton
        if not low < t < high:
            t = low + (high - low) * low_margin / (low_margin - high_margin)
            if stale >= PATIENCE or not low < t < high:
                t = 0.5 * (low + high)
        error, _ = try_step(t, tilted, work, motion)
        if not error <= work.tolerance:
            return t, NO_STEP, which
        margin, g, w = least_margin(t, heeds, slack, tilted, work, motion)
        newton = -1.0
        if margin < 0.0:
            high, high_margin, guard, which = t, margin, g, w
            newton = towards_gap(t, margin, g, w, work, motion)
            if side == 1:
                low_margin *= 0.5
            side = 1
        else:
            low, low_margin = t, margin
            if g == GAP and margin <= MET[0]:
                return t, g, w
            if side == -1:
                high_margin *= 0.5
            side = -1
        stale += 1
        if high - low <= 0.5 * width:
            width, stale = high - low, 0
        if high - low <= 1.0e-15 * h or (margin < 0.0 and margin > -(MET[0] if g == GAP else MET[1])):
            break
    if margin >= 0.0:
        try_step(high, tilted, work, motion)
        _, guard, which = least_margin(high, heeds, slack, tilted, work, motion)
    return high, guard, which


@inlined
def has_stopped(guard, which, work, motion):
    """True if the contact that ended a step nearly stands still there: then that is the end, not before."""
    if guard != SPEED:
        return False
    return sliding_velocity(which, work, motion)[1] <= motion.slow


@kernel
def finish_stop(which, left, heeds, tilted, work, motion):
    """Let contact `which`, which slides at END as slowly as counts as none, do so until it stands still: the time [s].

    Its direction stays what it is. Not where something else would end within that time, or it began to slide only now.
    """
    if motion.is_starting[which]:
        return 0.0
    slip, speed = sliding_velocity(which, work, motion)
    if not motion.noise < speed <= 2.0 * motion.slow:
        return 0.0
    before = get_state(motion, START)
    end = get_state(motion, END)
    for c in range(3):
        motion.reference[which, c] = slip[c] / speed
    put_state(motion, START, end)
    find_rate(START, 0.0, tilted, work, motion)
    for c in range(SIZE):
        motion.first_rate[c] = motion.rate[c]
    _, P, _, _ = free_turning(end, tilted, work)
    along = qt.dot(contact_rate(which, P, work, motion), vector(motion.reference, which))
    if along < 0.0:
        h = min(left, -speed / along)
        error, _ = try_step(h, tilted, work, motion)
        margin, guard, _ = least_margin(h, heeds, MARGIN, tilted, work, motion)
        if error <= work.tolerance and (margin >= 0.0 or guard == SPEED):
            pass_time(h, work)
            return h
    put_state(motion, START, before)
    put_state(motion, END, end)
    least_margin(0.0, heeds, MARGIN, tilted, work, motion)  # forces and gaps are those of END again
    return 0.0


@inlined
def body_speed(y, tilted, work):
    """Speed that no point of the body exceeds [m/s]."""
    v, w = y[2], angular_velocity(y[1], y[3], work, tilted)
    return math.sqrt(qt.dot(v, v)) + work.radius * math.sqrt(qt.dot(w, w))


@kernel
def move(y, left, tilted, work, motion):
    """Smooth motion of the regime for `left`, or until a guard ends it: (state, time, guard).

    Where the guards of force are not heeded one step, no longer than `motion.trust`: its guard is WATCH at least.
    """
    heeds = is_heeded(motion)
    had = body_speed(y, tilted, work)
    y = cancel(set_down(y, tilted, work, motion), tilted, work, motion)
    if had > motion.still and body_speed(y, tilted, work) <= SETTLED * motion.still:
        return y, 0.0, SPEED  # the contacts have taken all of it: it may be at rest
    put_state(motion, START, y)
    look_around(START, tilted, work, motion)
    motion.step = left if heeds else motion.trust
    t, h = 0.0, start_step(left, tilted, work, motion)
    note_margins(START, work, motion)
    for _ in range(STEPS):
        error, used = try_step(h, tilted, work, motion)
        is_over, guard = False, NO_STEP
        if error <= work.tolerance:
            margin, guard, which = least_margin(h, heeds, MARGIN, tilted, work, motion)
            is_over = margin < 0.0
            if outruns(h, work, motion):
                guard = NO_STEP
            elif is_over and not has_stopped(guard, which, work, motion):
                h, guard, which = locate(h, margin, guard, which, heeds, tilted, work, motion)
        if guard != NO_STEP and heeds:
            dip = find_dip(h, used, tilted, work, motion)
            if dip < h:
                h = dip
                refresh_loads(get_state(motion, START), 0.0, tilted, work)
                continue
        if guard == NO_STEP:
            if not h > SHORTEST * left:
                return get_state(motion, START), t, NO_STEP
            # Not `start_step` again: it would go by the directions of sliding (`way`) that the trial ended with.
            h *= CUT
            refresh_loads(get_state(motion, START), 0.0, tilted, work)  # the scale of the errors is that of the start
            continue
        t += h
        pass_time(h, work)
        if is_over and guard == SPEED:
            t += finish_stop(which, left - t, heeds, tilted, work, motion)
        motion.step = GROWTH * h if used <= EASY else h
        keep_forces(work, motion)
        y = cancel(get_state(motion, END), tilted, work, motion)
        if is_over:
            return y, t, guard
        if not heeds:
            for c in range(SIZE):
                motion.end_rate[c] = motion.rate[c]
            return y, t, WATCH
        put_state(motion, START, y)
        if not t < left:
            break
        for s in range(motion.is_active.shape[0]):
            motion.gap[START, s], motion.gap_rate[START, s] = motion.gap[END, s], motion.gap_rate[END, s]
        h = start_step(left - t, tilted, work, motion)
        note_margins(START, work, motion)
    if t < left:
        return get_state(motion, START), t, NO_STEP
    return y, left, NO_GUARD


@kernel
def look_ahead(y, tilted, work, motion):
    """State to which the regime would lead in a moment."""
    put_state(motion, START, y)
    motion.step = motion.ahead
    start_step(motion.ahead, tilted, work, motion)
    try_step(motion.ahead, tilted, work, motion)
    return cancel(get_state(motion, END), tilted, work, motion)
