"""Extrapolated midpoint rule, to a tolerance, for all bodies of a world that springs tie together and touch nothing.

A step is made by Gragg's midpoint rule with 2, 4, 6, ... parts. Neville's table extrapolates the results in the square
of the parts' length. When two successive values of the table agree to the tolerance, the step is done; if none do, it
is made shorter. `event_driven.smooth_segment` does the same for one body in contact.

Reference: E. Hairer, S. P. Nørsett, G. Wanner, *Solving Ordinary Differential Equations I*, 2nd ed., 1993, II.9.
"""

from __future__ import annotations

import math

from physics.compiler.decorators import inlined, kernel
from physics.kernels.forces.field_loads import field_load
from physics.kernels.forces.implicit_two_body_spring import read_middle, write_middle
from physics.kernels.forces.two_body_spring import place_anchors
from physics.kernels.math import quaternion as qt
from physics.kernels.state import layout as at
from physics.kernels.state.body import angular_velocity, read_state, write_state

# Largest number of midpoint rules, with 2, 4, 6, ... parts: eight of them give order 16.
_MAX_RULES = 8
LINKED_STATE_SIZE = 13  # numbers of a state: x, q, v, L

# Planes of `room`, each with a state of every body: one for each row of Neville's table, then the state before the
# present part, the present state, and its rate.
PLANE_BEFORE, PLANE_HERE, PLANE_RATE = _MAX_RULES, _MAX_RULES + 1, _MAX_RULES + 2
PLANE_COUNT = _MAX_RULES + 3

# A step is cut to this share if the rules do not agree. The next step is longer by the second factor if _EASY_RULES
# rules or fewer were enough.
_STEP_CUT = 0.25
_STEP_GROWTH = 2.0
_EASY_RULES = 5


@kernel
def _put_rate(t, offset_frame, linked):
    """Compute the rates of change of all bodies' states, at the time t [s].

    The states are in the plane PLANE_HERE of `linked.room`; the rates go to the plane PLANE_RATE.
    """
    room, bodies = linked.room, linked.body
    for b in range(bodies.shape[0]):
        s = room[PLANE_HERE, b]
        size = math.sqrt(s[3] * s[3] + s[4] * s[4] + s[5] * s[5] + s[6] * s[6])
        q = (s[3] / size, s[4] / size, s[5] / size, s[6] / size)
        write_middle(bodies[b], ((s[0], s[1], s[2]), q, (s[7], s[8], s[9]), (s[10], s[11], s[12])))
    place_anchors(offset_frame, linked)
    for b in range(bodies.shape[0]):
        x, q, v, L = read_middle(bodies[b])
        F, T = field_load(x, q, v, L, t, offset_frame, bodies[b])
        w = angular_velocity(q, L, bodies[b], offset_frame)
        s, rate, a, held = room[PLANE_HERE, b], room[PLANE_RATE, b], bodies[b].held_acceleration, bodies[b].held_torque
        turn = qt.multiply((0.0, 0.5 * w[0], 0.5 * w[1], 0.5 * w[2]), (s[3], s[4], s[5], s[6]))
        for c in range(4):
            rate[3 + c] = turn[c]
        for c in range(3):
            rate[c] = v[c]
            rate[7 + c] = a[c] + F[c] / bodies[b].mass
            rate[10 + c] = held[c] + T[c]


@inlined
def _put_start(linked):
    """Copy the states of the bodies, `linked.state`, into the planes PLANE_BEFORE and PLANE_HERE of `linked.room`."""
    for b in range(linked.state.shape[0]):
        x, q, v, L = read_state(linked.state, b)
        for plane in (PLANE_BEFORE, PLANE_HERE):
            s = linked.room[plane, b]
            s[0], s[1], s[2] = x
            s[3], s[4], s[5], s[6] = q
            s[7], s[8], s[9] = v
            s[10], s[11], s[12] = L


@kernel
def _midpoint(parts, h, t, row, offset_frame, linked):
    """Advance all bodies over h from the time t [s] by Gragg's midpoint rule, into row `row` of Neville's table.

    `parts` is the even number of parts of the rule.
    """
    room, s = linked.room, h / parts
    _put_start(linked)
    for k in range(parts):
        _put_rate(t + k * s, offset_frame, linked)
        for b in range(linked.state.shape[0]):
            for c in range(LINKED_STATE_SIZE):
                here = room[PLANE_HERE, b, c]
                if k == 0:
                    room[PLANE_HERE, b, c] = here + s * room[PLANE_RATE, b, c]
                else:
                    room[PLANE_HERE, b, c] = room[PLANE_BEFORE, b, c] + 2.0 * s * room[PLANE_RATE, b, c]
                room[PLANE_BEFORE, b, c] = here
    _put_rate(t + h, offset_frame, linked)
    for b in range(linked.state.shape[0]):
        for c in range(LINKED_STATE_SIZE):
            room[row, b, c] = 0.5 * (room[PLANE_BEFORE, b, c] + room[PLANE_HERE, b, c] + s * room[PLANE_RATE, b, c])


@kernel
def _extrapolate(row, h, linked):
    """Extrapolate with a new rule in row `row` of Neville's table; row 0 then has the best value. Return its error.

    Row j has the table's value of rule j and column row - j. The error is the largest change of row 0, relative: of
    positions to speed times h, of velocities to the speed, of angular momenta to speed times mass and radius, of
    quaternions to 1. The speed is that of the body plus its bounding radius over h.
    """
    room, worst = linked.room, 0.0
    for b in range(linked.state.shape[0]):
        body = linked.body[b]
        v = (room[PLANE_HERE, b, 7], room[PLANE_HERE, b, 8], room[PLANE_HERE, b, 9])
        speed = math.sqrt(qt.dot(v, v)) + body.radius / h
        turning = speed * body.mass * body.radius
        for c in range(LINKED_STATE_SIZE):
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
def extrapolate_linked(h, offset_frame, linked):
    """Advance all bodies of `linked` (a `LinkedWorld`) by h [s], to its tolerance.

    Returns False if `linked.most` steps were not enough; the bodies have then advanced by less than h.
    """
    start, t, step = linked.body[0].now, 0.0, h
    for _ in range(linked.most):
        step = min(step, h - t)
        rules, error = 0, math.inf
        while rules < _MAX_RULES and not error <= linked.tolerance:
            _midpoint(2 * (rules + 1), step, start + t, rules, offset_frame, linked)
            if rules > 0:
                error = _extrapolate(rules, step, linked)
            rules += 1
        if not error <= linked.tolerance:
            step *= _STEP_CUT
            continue
        for b in range(linked.state.shape[0]):
            s = linked.room[0, b]
            q = qt.normalise((s[3], s[4], s[5], s[6]))
            write_state(linked.state, b, ((s[0], s[1], s[2]), q, (s[7], s[8], s[9]), (s[10], s[11], s[12])))
        t += step
        if not t < h:
            return True
        if rules <= _EASY_RULES:
            step *= _STEP_GROWTH
    return False


@kernel
def step_linked_segment(world, h, offset_frame, report, linked):
    """Advance all bodies of a world by h [s] to the tolerance (`extrapolate_linked`); report it if that fails."""
    if not extrapolate_linked(h, offset_frame, linked):
        report[world, at.UNRESOLVED] += 1.0
