"""Springs between bodies that a step does not resolve: implicit loads of both ends at once (`implicit_loads`).

Also where the columns of such a spring stand, and the state of a body in the middle of a stage.
"""

from __future__ import annotations

from physics.kernels.compile.decorators import inlined, kernel
from physics.kernels.forces.field_loads import (
    all_loads,
    field_state,
    kicked,
    less,
    loads_held,
    more,
    put_all,
)
from physics.kernels.forces.force_field_dispatch import softened, total_linked_load, total_load, total_own_load
from physics.kernels.forces.force_field_state import minus, plus, times
from physics.kernels.forces.implicit_loads import answer_of, answer_to, axes_across, mobility_bound
from physics.kernels.forces.resolution_limits import note_rates
from physics.kernels.forces.spring import line_stiffness, stretch
from physics.kernels.math import quaternion as qt
from physics.kernels.state.body import principal_attitude, turning

# Columns: those of a spring, whose anchor is the other body's point now, and after them
ANCHOR = 3
VELOCITY = 9  # of the anchor, world frame [m/s]
OTHER = 12  # index of the other body, -1: the spring is not at this one
OTHER_POINT = 13  # in the other body's frame, from its centre of mass [m]
OTHER_MOBILITY = 16  # bound of the inverse mass of that point [1/kg]
SIZE = 17


@inlined
def middle(body):
    """(x, q, v, L) of a body in the middle of the stage."""
    m = body.middle
    return (m[0], m[1], m[2]), (m[3], m[4], m[5], m[6]), (m[7], m[8], m[9]), (m[10], m[11], m[12])


@inlined
def put_middle(body, y):
    """Write it."""
    x, q, v, L = y
    m = body.middle
    m[0], m[1], m[2] = x
    m[3], m[4], m[5], m[6] = q
    m[7], m[8], m[9] = v
    m[10], m[11], m[12] = L


@inlined
def state_of(body, later, tilted):
    """State that the fields of a body are told in its middle."""
    x, q, v, L = middle(body)
    return field_state(x, q, v, L, body.now + later, tilted, body)


@inlined
def _principal(body, tilted):
    """Principal axes of a body in its middle."""
    return qt.to_matrix(principal_attitude(middle(body)[1], body, tilted))


@inlined
def _own_loads(body, h, tilted):
    """Loads of a body that the implicit step over h of its own fields has, as if no spring tied it to others."""
    state = state_of(body, 0.5 * h, tilted)
    F, T = total_own_load(state, body.now + 0.5 * h, body)
    return softened(all_loads(F, T, body), h, _principal(body, tilted), state, body)


@inlined
def _hold_unsoftened_springs(body, h, tilted):
    """Let the springs to others act besides the body's own softened loads."""
    F, T = total_linked_load(state_of(body, 0.5 * h, tilted), body.now + 0.5 * h, body)
    a, torque = _own_loads(body, h, tilted)
    put_all((plus(a, times(1.0 / body.mass, F)), plus(torque, T)), body)


@inlined
def _soften_springs(body, h, tilted):
    """Soften by the body's own fields what springs to others, themselves softened by now, add to its own loads."""
    own = _own_loads(body, h, tilted)
    added, state = less(loads_held(body), own), state_of(body, 0.5 * h, tilted)
    put_all(more(own, softened(added, h, _principal(body, tilted), state, body)), body)


@kernel
def _soften_pair(k, one, other, h, tilted):
    """Soften the loads of two bodies by the spring in columns k over h: equal and opposite changes."""
    columns = one.columns
    state, p = state_of(one, 0.5 * h, tilted), columns[k : k + SIZE]
    arm, e, l = stretch(state, p)
    _, q, _, _ = middle(other)
    o = k + OTHER_POINT
    lever = qt.matvec(qt.to_matrix(q), (columns[o], columns[o + 1], columns[o + 2]))
    J, R = (one.J[0], one.J[1], one.J[2]), _principal(one, tilted)
    K, S = (other.J[0], other.J[1], other.J[2]), _principal(other, tilted)
    w = mobility_bound(arm, one.mass, J) + mobility_bound(lever, other.mass, K)
    n, along, across = line_stiffness(h, w, e, l, p)
    s, t = axes_across(n)
    first, second = loads_held(one), loads_held(other)
    u = minus(
        plus(first[0], qt.cross(turning(R, first[1], J), arm)),
        plus(second[0], qt.cross(turning(S, second[1], K), lever)),
    )
    wn = plus(answer_of(n, arm, R, one.mass, J), answer_of(n, lever, S, other.mass, K))
    ws = plus(answer_of(s, arm, R, one.mass, J), answer_of(s, lever, S, other.mass, K))
    wt = plus(answer_of(t, arm, R, one.mass, J), answer_of(t, lever, S, other.mass, K))
    f = answer_to(u, n, s, t, wn, ws, wt, along, across)
    put_all((minus(first[0], times(1.0 / one.mass, f)), minus(first[1], qt.cross(arm, f))), one)
    put_all((plus(second[0], times(1.0 / other.mass, f)), plus(second[1], qt.cross(lever, f))), other)


@inlined
def hold_implicit(first, count, h, tilted, bodies):
    """Let loads act as the implicit step over h has them: own fields, then springs between bodies, one after another.

    A field softens the loads of a spring after the spring has: of loads that a damper makes small, even a small share
    that is left to one of the two bodies would be large.
    """
    for b in range(bodies.shape[0]):
        _hold_unsoftened_springs(bodies[b], h, tilted)
    for b in range(bodies.shape[0]):
        for k in range(first, first + SIZE * count, SIZE):
            j = int(bodies[b].columns[k + OTHER])
            if j > b:  # each spring once
                _soften_pair(k, bodies[b], bodies[j], h, tilted)
    for b in range(bodies.shape[0]):
        _soften_springs(bodies[b], h, tilted)


@kernel
def note_all_rates(h, tilted, bodies):
    """Note for all bodies whether a stage of length h is too long for the explicit midpoint rule for one of them."""
    stiff = 0
    for b in range(bodies.shape[0]):
        body, state = bodies[b], state_of(bodies[b], 0.5 * h, tilted)
        x, q, v, L = middle(body)
        loads = total_load(state, body.now + 0.5 * h, body)
        note_rates(state, kicked(x, q, v, L, loads, h, h, tilted, body), h, body)
        stiff = max(stiff, bodies[b].is_stiff)
    for b in range(bodies.shape[0]):
        bodies[b].is_stiff = stiff
    return stiff == 1
