"""Motion of bodies that springs tie together, to a tolerance: the extrapolated midpoint rule for all of them at once.

As `events.smooth` does for one body (Gragg's rule with 2, 4, 6, ... parts, Neville's table in the squares of the parts'
length; two neighbours that agree end the step), but there is nothing to touch: a step is cut for its error alone.

Reference: E. Hairer, S. P. Nørsett, G. Wanner, *Solving Ordinary Differential Equations I*, 2nd ed., 1993, II.9.
"""

from __future__ import annotations

import math

from physics.kernels.compile.decorators import inlined, kernel
from physics.kernels.forces.field_loads import field_load
from physics.kernels.forces.two_body_spring import middle, place_anchors, put_middle
from physics.kernels.math import quaternion as qt
from physics.kernels.state import layout as at
from physics.kernels.state.body import angular_velocity, read_state, write_state

# Rules of 2, 4, 6, ... parts: order 16 with eight.
RULES = 8
SIZE = 13  # numbers of a state: x, q, v, L

# Planes of `room`: the table, one per rule, then two states and a rate.
BEFORE, HERE, RATE = RULES, RULES + 1, RULES + 2
PLANES = RULES + 3

# A step is cut to this share where the rules do not agree; the next one is this much longer where EASY of them did.
CUT = 0.25
GROWTH = 2.0
EASY = 5


@kernel
def _put_rate(t, tilted, linked):
    """Rates of all bodies in the state `HERE` at time t [s] into `RATE`."""
    room, bodies = linked.room, linked.bodies
    for b in range(bodies.shape[0]):
        s = room[HERE, b]
        size = math.sqrt(s[3] * s[3] + s[4] * s[4] + s[5] * s[5] + s[6] * s[6])
        q = (s[3] / size, s[4] / size, s[5] / size, s[6] / size)
        put_middle(bodies[b], ((s[0], s[1], s[2]), q, (s[7], s[8], s[9]), (s[10], s[11], s[12])))
    place_anchors(tilted, linked)
    for b in range(bodies.shape[0]):
        x, q, v, L = middle(bodies[b])
        F, T = field_load(x, q, v, L, t, tilted, bodies[b])
        w = angular_velocity(q, L, bodies[b], tilted)
        s, rate, a, held = room[HERE, b], room[RATE, b], bodies[b].held_acceleration, bodies[b].held_torque
        turn = qt.multiply((0.0, 0.5 * w[0], 0.5 * w[1], 0.5 * w[2]), (s[3], s[4], s[5], s[6]))
        for c in range(4):
            rate[3 + c] = turn[c]
        for c in range(3):
            rate[c] = v[c]
            rate[7 + c] = a[c] + F[c] / bodies[b].mass
            rate[10 + c] = held[c] + T[c]


@inlined
def _put_start(linked):
    """The states of the bodies into `BEFORE` and `HERE`."""
    for b in range(linked.now.shape[0]):
        x, q, v, L = read_state(linked.now, b)
        for plane in (BEFORE, HERE):
            s = linked.room[plane, b]
            s[0], s[1], s[2] = x
            s[3], s[4], s[5], s[6] = q
            s[7], s[8], s[9] = v
            s[10], s[11], s[12] = L


@kernel
def _midpoint(parts, h, t, row, tilted, linked):
    """Gragg's rule of so many parts, an even number, over h from time t into row `row` of the table."""
    room, s = linked.room, h / parts
    _put_start(linked)
    for k in range(parts):
        _put_rate(t + k * s, tilted, linked)
        for b in range(linked.now.shape[0]):
            for c in range(SIZE):
                here = room[HERE, b, c]
                if k == 0:
                    room[HERE, b, c] = here + s * room[RATE, b, c]
                else:
                    room[HERE, b, c] = room[BEFORE, b, c] + 2.0 * s * room[RATE, b, c]
                room[BEFORE, b, c] = here
    _put_rate(t + h, tilted, linked)
    for b in range(linked.now.shape[0]):
        for c in range(SIZE):
            room[row, b, c] = 0.5 * (room[BEFORE, b, c] + room[HERE, b, c] + s * room[RATE, b, c])


@kernel
def _extrapolate(row, h, linked):
    """Neville's table with one more rule: its best value stands in row 0 then, with that value's error.

    Row j holds T of rule j and column row - j. The error is relative to size, or speed and what the step makes of it.
    """
    room, worst = linked.room, 0.0
    for b in range(linked.now.shape[0]):
        body = linked.bodies[b]
        v = (room[HERE, b, 7], room[HERE, b, 8], room[HERE, b, 9])
        speed = math.sqrt(qt.dot(v, v)) + body.radius / h
        turning = speed * body.mass * body.radius
        for c in range(SIZE):
            last = room[0, b, c]
            for j in range(row - 1, -1, -1):
                ratio = (row + 1.0) / (j + 1.0)
                room[j, b, c] = room[j + 1, b, c] + (room[j + 1, b, c] - room[j, b, c]) / (ratio * ratio - 1.0)
            scale = 1.0
            if c < 3:
                scale = speed * h
            elif c >= 10:
                scale = turning
            elif c >= 7:
                scale = speed
            worst = max(worst, abs(room[0, b, c] - last) / scale)
    return worst


@kernel
def move_linked(h, tilted, linked):
    """All bodies after h, to the tolerance; whether it got there in the steps allowed."""
    start, t, step = linked.bodies[0].now, 0.0, h
    for _ in range(linked.most):
        step = min(step, h - t)
        rules, error = 0, math.inf
        while rules < RULES and not error <= linked.tolerance:
            _midpoint(2 * (rules + 1), step, start + t, rules, tilted, linked)
            if rules > 0:
                error = _extrapolate(rules, step, linked)
            rules += 1
        if not error <= linked.tolerance:
            step *= CUT
            continue
        for b in range(linked.now.shape[0]):
            s = linked.room[0, b]
            q = qt.normalise((s[3], s[4], s[5], s[6]))
            write_state(linked.now, b, ((s[0], s[1], s[2]), q, (s[7], s[8], s[9]), (s[10], s[11], s[12])))
        t += step
        if not t < h:
            return True
        if rules <= EASY:
            step *= GROWTH
    return False


@kernel
def step_smooth(world, h, tilted, report, linked):
    """`move_linked`, with what it could not do in the report."""
    if not move_linked(h, tilted, linked):
        report[world, at.UNRESOLVED] += 1.0
