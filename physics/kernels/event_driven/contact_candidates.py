"""Contacts that touch: candidates for acting, what they do, and their accelerations."""

from __future__ import annotations

import math

from physics.kernels.compile.decorators import inlined, kernel
from physics.kernels.event_driven.constraint_projection import cancel_normal_speeds
from physics.kernels.event_driven.contact_forces import (
    arm_and_rate,
    load,
    plus,
)
from physics.kernels.event_driven.extrapolated_midpoint import put_state
from physics.kernels.event_driven.guards import look_around
from physics.kernels.event_driven.workspace import START
from physics.kernels.half_space.contact_point import feature_of, wall_normal, wall_of
from physics.kernels.math import quaternion as qt

# What a body does; the last: nothing, since its last step went too far (`mode_acceptance`).
FLIES, COLLIDES, MOVES, RESTS, IS_LOST, ASKS, ASKS_SLIDING, GOES_BACK = range(8)

# What a candidate does.
OPEN, HELD, SLIDING = range(3)

# Approach of a contact that will leave that is none, in `motion.still`.
UNSEEN_APPROACH = 1.0e-2


@kernel
def find_candidates(y, tilted, work, motion):
    """Features that touch and do not leave, into `candidate`: (count, whether one approaches)."""
    put_state(motion, START, y)
    look_around(START, tilted, work, motion)
    count = motion.candidates = 0
    for s in range(motion.is_active.shape[0]):
        if motion.gap[START, s] <= motion.touch and count < motion.slot.shape[0]:
            rate = motion.gap_rate[START, s]
            if rate < -motion.still:
                return 0, True
            if rate <= motion.still:
                motion.candidate[count] = s
                count += 1
    motion.candidates = count
    return count, False


@kernel
def act(count, work, motion):
    """Let the candidates act that are not open, with the last forces for shares; mark their slots."""
    k = 0
    for s in range(motion.is_active.shape[0]):
        motion.is_active[s] = 0
    for i in range(count):
        if motion.kind[i] != OPEN and k < motion.slot.shape[0]:
            motion.slot[k] = motion.candidate[i]
            motion.is_active[motion.candidate[i]] = 1
            motion.holds[k] = 1 if motion.kind[i] == HELD else 0
            for c in range(3):
                motion.share[k, c] = motion.last[motion.candidate[i], c]
                motion.way[k, c] = motion.reference[k, c] = motion.candidate_way[i, c]
            k += 1
    motion.count = k


@inlined
def has_open(motion):
    """True if a candidate does not act."""
    for i in range(motion.candidates):
        if motion.kind[i] == OPEN:
            return True
    return False


@inlined
def has_speed(motion):
    """True if an acting candidate moves along its normal, or another one approaches, by more than rounding."""
    for i in range(motion.candidates):
        rate = motion.gap_rate[START, motion.candidate[i]]
        if rate < -motion.noise or (rate > motion.noise and motion.kind[i] != OPEN):
            return True
    return False


@kernel
def set_down(y, tilted, work, motion):
    """State without the normal velocities of all candidates that neither come nor go, whether they act or not.

    A body that lies on two contacts and rocks lower than counts would else come down on the one whenever it is set
    down on the other. Where those that act have no such velocity one that has just been let go keeps its own.
    """
    if not has_open(motion):
        return y
    put_state(motion, START, y)
    look_around(START, tilted, work, motion)
    if not has_speed(motion):
        return y
    motion.count = 0
    for i in range(motion.candidates):
        s = motion.candidate[i]
        if motion.gap[START, s] <= motion.touch and abs(motion.gap_rate[START, s]) <= motion.still:
            motion.slot[motion.count], motion.holds[motion.count] = s, 0
            motion.count += 1
    y = cancel_normal_speeds(y, tilted, work, motion)
    act(motion.candidates, work, motion)
    return y


@inlined
def contact_acceleration(i, y, R, w, a, alpha, tilted, work, motion):
    """Acceleration of candidate i: (normal part, tangential part)."""
    wall = wall_of(motion.candidate[i], work)
    n = wall_normal(work.walls, wall)
    r, rate = arm_and_rate(work.shape, load(work.dims), R, w, n, feature_of(motion.candidate[i], work), tilted, work)
    b = plus(plus(a, qt.cross(alpha, r)), qt.cross(w, rate))
    bn = qt.dot(n, b)
    return bn, (b[0] - bn * n[0], b[1] - bn * n[1], b[2] - bn * n[2])


@kernel
def sliding_now(i, y, R, w, tilted, work, motion):
    """True if candidate i slides; its direction into `candidate_way`."""
    wall = wall_of(motion.candidate[i], work)
    n = wall_normal(work.walls, wall)
    r, _ = arm_and_rate(work.shape, load(work.dims), R, w, n, feature_of(motion.candidate[i], work), tilted, work)
    u = plus(y[2], qt.cross(w, r))
    un = qt.dot(n, u)
    t = (u[0] - un * n[0], u[1] - un * n[1], u[2] - un * n[2])
    speed = math.sqrt(qt.dot(t, t))
    for c in range(3):
        motion.candidate_way[i, c] = 0.0
        if speed > motion.slow:
            motion.candidate_way[i, c] = t[c] / speed
    return speed > motion.slow


@inlined
def acceleration_scale(w, work):
    """Size of the accelerations of a body's contacts [m/s²]."""
    return work.acceleration + work.radius * qt.dot(w, w)


@inlined
def closes(count, motion):
    """True if a contact that will leave is still, by a little, on its way in."""
    least = -motion.noise - UNSEEN_APPROACH * motion.still
    for i in range(count):
        if motion.kind[i] == OPEN and motion.gap_rate[START, motion.candidate[i]] < least:
            return True
    return False
