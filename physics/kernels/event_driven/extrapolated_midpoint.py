"""Smooth motion in one regime: the midpoint rule, extrapolated to any order.

One step of length h is made by Gragg's midpoint rule with 2, 4, 6, ... parts; its error is a series in the square
of the parts' length, so that each further number of parts raises the order by two (Bulirsch and Stoer). Two
successive orders that agree end the step; if 16 does not do, it is cut. Constant forces need two rules.

Hairer, Nørsett and Wanner, *Solving Ordinary Differential Equations I*, II.9, for the rule, its smoothing step and
the table.
"""

from __future__ import annotations

import math

from physics.kernels.compile.decorators import inlined, kernel
from physics.kernels.event_driven.contact_forces import free_turning, place, vector
from physics.kernels.event_driven.force_system import regime_forces
from physics.kernels.event_driven.slip_onset import (
    contact_rate,
    creeps,
    has_one_slide,
    sliding_velocity,
    stiffness_across,
)
from physics.kernels.event_driven.workspace import END, LAST, NOW, ORDERS, SIZE, START, L, Q, V, X
from physics.kernels.forces.held_loads import has_fields, refresh_loads
from physics.kernels.half_space.contact_point import wall_normal, wall_of
from physics.kernels.math import quaternion as qt
from physics.kernels.state.layout import SPHERE

# A step is cut to this share when the extrapolation does not settle, and no further than to SHORTEST of the time
# requested.
CUT = 0.25
SHORTEST = 1.0e-12

# The next step is this many times as long when at most EASY rules were needed.
GROWTH = 4.0
EASY = 4

# Sliding turns when its acceleration is off its direction by this share, and then a step is so long at most, in times
# |u|/|a|. Where it is straight but for less than that it turns just before it stops: there a step goes so far.
BENT = 1.0e-4
TURNED = 0.5
STRAIGHT = 1.0e-14
SHORT_OF_STOP = 0.75

# The direction of a slip follows what acts within the time |u|/K, K the acceleration that friction gives across it for
# each radian. No step is longer than STIFF of these: beyond it is not stable, by less than the tolerance of a speed.
STIFF = 1.5

# In contact an extrapolation goes on to FINER of the tolerance, and no further than to rounding, FINEST: the time at
# which a force or a slip is used up may be off by many times as much as the state.
FINER = 1.0e-2
FINEST = 1.0e-13

# Rules after which it shows whether an extrapolation will settle: when its errors, falling twice as fast as they did
# last, would not.
TOLD = 3

# A body with corners turns by at most this in a step, so that the gaps at its ends and their rates show whether
# a corner dipped into a wall between them [rad].
TURN_AT_MOST = 0.25


@inlined
def get_state(motion, row):
    """(x, q, v, L) of a row of `y`."""
    y = motion.y
    return (
        (y[row, X], y[row, X + 1], y[row, X + 2]),
        (y[row, Q], y[row, Q + 1], y[row, Q + 2], y[row, Q + 3]),
        (y[row, V], y[row, V + 1], y[row, V + 2]),
        (y[row, L], y[row, L + 1], y[row, L + 2]),
    )


@inlined
def put_state(motion, row, state):
    """Write (x, q, v, L) to a row of `y`."""
    x, q, v, m = state
    y = motion.y
    y[row, X], y[row, X + 1], y[row, X + 2] = x
    y[row, Q], y[row, Q + 1], y[row, Q + 2], y[row, Q + 3] = q
    y[row, V], y[row, V + 1], y[row, V + 2] = v
    y[row, L], y[row, L + 1], y[row, L + 2] = m


@kernel
def find_rate(row, later, tilted, work, motion):
    """Rate of change of a row of `y`, `later` [s] than START, into `rate`, its contacts' forces into the unknowns."""
    state = get_state(motion, row)
    refresh_loads(state, later, tilted, work)
    q, v = state[1], state[2]
    F, T, w, _, _ = regime_forces(state, tilted, work, motion)
    inv_mass = 1.0 / work.mass
    turn = qt.multiply((0.0, w[0], w[1], w[2]), q)
    rate = motion.rate
    for c in range(3):
        rate[X + c] = v[c]
        rate[V + c] = work.free_acceleration[c] + inv_mass * F[c]
        rate[L + c] = work.torque[c] + T[c]
    rate[Q], rate[Q + 1], rate[Q + 2], rate[Q + 3] = 0.5 * turn[0], 0.5 * turn[1], 0.5 * turn[2], 0.5 * turn[3]


@kernel
def set_scale(h, work, motion):
    """Sizes against which the errors of a step are held, its start made ready by `start_step`."""
    x, _, v, _ = get_state(motion, START)
    speed = math.sqrt(qt.dot(v, v)) + work.radius * motion.spin + work.acceleration * h
    place_size = work.radius + max(abs(x[0]), max(abs(x[1]), abs(x[2])))
    for c in range(3):
        motion.scale[X + c] = place_size
        motion.scale[V + c] = speed
        motion.scale[L + c] = speed * work.mass * work.radius
    for c in range(4):
        motion.scale[Q + c] = 1.0


@kernel
def _midpoint_rule(parts, h, tilted, work, motion):
    """One rule with `parts` parts from START, smoothed, into row END."""
    y, rate = motion.y, motion.rate
    s = h / parts
    for c in range(SIZE):
        y[LAST, c] = y[START, c]
        y[NOW, c] = y[START, c] + s * motion.first_rate[c]
    for k in range(1, parts):
        find_rate(NOW, k * s, tilted, work, motion)
        for c in range(SIZE):
            old = y[LAST, c]
            y[LAST, c] = y[NOW, c]
            y[NOW, c] = old + 2.0 * s * rate[c]
    find_rate(NOW, h, tilted, work, motion)
    for c in range(SIZE):
        y[END, c] = 0.5 * (y[NOW, c] + y[LAST, c] + s * rate[c])


@kernel
def try_step(h, tilted, work, motion):
    """Row END from row START, h later (`first_rate` known): (relative error, rules used)."""
    table, y = motion.table, motion.y
    goal = work.tolerance
    aim = max(FINER * goal, min(goal, FINEST)) if motion.count > 0 else goal
    set_scale(h, work, motion)
    error = math.inf
    used = ORDERS
    for k in range(ORDERS):
        _midpoint_rule(2 * (k + 1), h, tilted, work, motion)
        before = error
        error = total = 0.0
        for c in range(SIZE):
            new, change = y[END, c], math.inf
            for j in range(1, k + 1):
                ratio = (k + 1.0) / (k + 1.0 - j)
                old = table[j - 1, c]
                change = (new - old) / (ratio * ratio - 1.0)
                table[j - 1, c] = new
                new += change
            table[k, c] = new
            y[END, c] = new
            total += new
            if motion.scale[c] > 0.0:
                error = max(error, abs(change) / motion.scale[c])
        if not math.isfinite(total):
            return math.inf, ORDERS
        if error <= aim:
            used = k + 1
            break
        if k >= TOLD and error * (error / before) ** (2 * (ORDERS - 1 - k)) > (aim if error <= goal else goal):
            break
    x, q, v, m = get_state(motion, END)
    put_state(motion, END, (x, qt.normalise(q), v, m))
    return error, used


@kernel
def start_step(left, tilted, work, motion):
    """Make row START ready for `try_step`; how long the step should be at most.

    No longer than the time `left`, what the last step's ease suggests, a turn of TURN_AT_MOST, the time at which a
    contact that is slowed as it is now stops sliding, and, flying through a field, the time in which the body crosses
    its radius, so that no wall is reached and left again unseen.
    """
    state = get_state(motion, START)
    R, P, w, alpha = free_turning(state, tilted, work)
    for j in range(motion.count):
        for c in range(3):
            motion.reference[j, c] = motion.way[j, c]
    place(state, R, w, alpha, tilted, work, motion)
    for j in range(motion.count):
        t, speed = sliding_velocity(j, work, motion)
        motion.is_starting[j] = 1 if speed <= motion.slow else 0
        if speed > motion.slow:
            for c in range(3):
                motion.reference[j, c] = t[c] / speed
    motion.turning = motion.stiffness = 0.0
    _set_first_rate(tilted, work, motion)
    turn = motion.spin = math.sqrt(qt.dot(w, w))
    if has_one_slide(work, motion):
        _begin_slide(P, tilted, work, motion)
    motion.weight = work.mass * (work.acceleration + work.radius * turn * turn)
    h = min(left, motion.step)
    if work.shape != SPHERE and h * turn > TURN_AT_MOST:
        h = TURN_AT_MOST / turn
    if motion.count == 0 and has_fields(work):
        h = min(h, work.radius / (math.sqrt(qt.dot(state[2], state[2])) + math.sqrt(work.radius * work.acceleration)))
    return _until_stop(h, P, w, work, motion)


@inlined
def _set_first_rate(tilted, work, motion):
    """`first_rate`: that of START."""
    find_rate(START, 0.0, tilted, work, motion)
    for c in range(SIZE):
        motion.first_rate[c] = motion.rate[c]


@kernel
def _begin_slide(P, tilted, work, motion):
    """Prepare the only contact, which slides, at START; one that creeps has the direction of `slip_onset`."""
    motion.stiffness = stiffness_across(P, work, motion)
    _, motion.first_speed = sliding_velocity(0, work, motion)
    motion.growth = qt.dot(contact_rate(0, P, work, motion), vector(motion.reference, 0))
    if motion.growth >= 0.0 and creeps(motion.growth, motion.first_speed, work, motion):
        motion.is_starting[0] = 1
        _set_first_rate(tilted, work, motion)
    if motion.is_starting[0]:
        _set_turning(tilted, work, motion)
        _set_first_rate(tilted, work, motion)


@inlined
def _set_turning(tilted, work, motion):
    """`turning` of the only contact, by a look a moment ahead."""
    d = vector(motion.way, 0)
    for c in range(SIZE):
        motion.y[NOW, c] = motion.y[START, c] + motion.nearest * motion.first_rate[c]
    find_rate(NOW, motion.nearest, tilted, work, motion)
    n = wall_normal(work.walls, wall_of(motion.slot[0], work))
    motion.turning = qt.dot(qt.cross(n, d), vector(motion.way, 0)) / motion.nearest


@inlined
def _until_stop(h, P, w, work, motion):
    """h, or less: until the first contact stops sliding if it is slowed as at the start, or has turned its sliding.

    The direction of a velocity u + a t is analytic up to the time |u|/|a| (where a complex t makes it vanish), and no
    step much longer than that is of any high order.
    """
    for j in range(motion.count):
        if motion.holds[j] or motion.is_starting[j] or not work.mu > 0.0:
            continue
        d = vector(motion.reference, j)
        _, speed = sliding_velocity(j, work, motion)
        change = contact_rate(j, P, work, motion)
        along, size = qt.dot(d, change), math.sqrt(qt.dot(change, change))
        bend = size - abs(along)
        if along < 0.0 and -along * h > speed:
            h = -speed / along
            if bend > STRAIGHT * size:
                h *= SHORT_OF_STOP
        if bend > BENT * size:
            h = min(h, TURNED * speed / size)
        if bend > STRAIGHT * size and motion.stiffness > 0.0:  # 0 of more contacts than one
            h = min(h, STIFF * speed / motion.stiffness)
    return h
