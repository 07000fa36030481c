"""Implicit loads of both ends at once of springs between bodies that a step does not resolve (`implicit_loads`).

Also where the columns of such a spring stand, and the state of a body in the middle of a stage.
"""

from __future__ import annotations

from physics.compiler.decorators import inlined, kernel
from physics.kernels.forces.field_loads import (
    acting_loads,
    add_held_loads,
    add_loads,
    apply_total_loads,
    field_state,
    kicked_state,
    subtract_loads,
)
from physics.kernels.forces.force_field_dispatch import soften_loads, total_linked_load, total_load, total_own_load
from physics.kernels.forces.implicit_loads import axes_across, implicit_point_force, mobility_bound, point_mobility
from physics.kernels.forces.resolution_limits import note_field_rates
from physics.kernels.forces.spring import implicit_spring_stiffness, spring_vector
from physics.kernels.math import quaternion as qt
from physics.kernels.math.vector import minus, plus, times
from physics.kernels.state.body import apply_inv_inertia, principal_attitude

# Columns: those of a spring, whose anchor is the other body's point now, and after them
LINK_ANCHOR = 3
LINK_VELOCITY = 9  # of the anchor, world frame [m/s]
LINK_OTHER = 12  # index of the other body, -1: the spring is not at this one
LINK_OTHER_POINT = 13  # in the other body's frame, from its centre of mass [m]
LINK_OTHER_MOBILITY = 16  # bound of the inverse mass of that point [1/kg]
LINK_SIZE = 17


@inlined
def read_middle(body):
    """(x, q, v, L) of a body in the middle of the stage."""
    m = body.middle
    return (m[0], m[1], m[2]), (m[3], m[4], m[5], m[6]), (m[7], m[8], m[9]), (m[10], m[11], m[12])


@inlined
def write_middle(body, y):
    """Write (x, q, v, L) of a body in the middle of the stage."""
    x, q, v, L = y
    m = body.middle
    m[0], m[1], m[2] = x
    m[3], m[4], m[5], m[6] = q
    m[7], m[8], m[9] = v
    m[10], m[11], m[12] = L


@inlined
def middle_field_state(body, later, offset_frame):
    """State for the fields of a body in its middle."""
    x, q, v, L = read_middle(body)
    return field_state(x, q, v, L, body.now + later, offset_frame, body)


@inlined
def _principal(body, offset_frame):
    """Principal axes of a body in its middle."""
    return qt.to_matrix(principal_attitude(read_middle(body)[1], body, offset_frame))


@inlined
def _own_loads(body, h, offset_frame):
    """Loads of a body by the implicit step over h of its own fields, without springs to other bodies."""
    state = middle_field_state(body, 0.5 * h, offset_frame)
    F, T = total_own_load(state, body.now + 0.5 * h, body)
    return soften_loads(add_held_loads(F, T, body), h, _principal(body, offset_frame), state, body)


@inlined
def _hold_unsoftened_springs(body, h, offset_frame):
    """Add the loads of springs to other bodies to the body's own softened loads."""
    F, T = total_linked_load(middle_field_state(body, 0.5 * h, offset_frame), body.now + 0.5 * h, body)
    a, torque = _own_loads(body, h, offset_frame)
    apply_total_loads((plus(a, times(1.0 / body.mass, F)), plus(torque, T)), body)


@inlined
def _soften_springs(body, h, offset_frame):
    """Soften, by the body's own fields, the loads that already softened springs add to its own loads."""
    own = _own_loads(body, h, offset_frame)
    added, state = subtract_loads(acting_loads(body), own), middle_field_state(body, 0.5 * h, offset_frame)
    apply_total_loads(add_loads(own, soften_loads(added, h, _principal(body, offset_frame), state, body)), body)


@kernel
def _soften_pair(k, one, other, h, offset_frame):
    """Soften the loads of two bodies by the spring in columns k over h: equal and opposite changes."""
    columns = one.columns
    state, p = middle_field_state(one, 0.5 * h, offset_frame), columns[k : k + LINK_SIZE]
    arm, e, l = spring_vector(state, p)
    _, q, _, _ = read_middle(other)
    o = k + LINK_OTHER_POINT
    lever = qt.matvec(qt.to_matrix(q), (columns[o], columns[o + 1], columns[o + 2]))
    J, R = (one.J[0], one.J[1], one.J[2]), _principal(one, offset_frame)
    K, S = (other.J[0], other.J[1], other.J[2]), _principal(other, offset_frame)
    w = mobility_bound(arm, one.mass, J) + mobility_bound(lever, other.mass, K)
    n, along, across = implicit_spring_stiffness(h, w, e, l, p)
    s, t = axes_across(n)
    first, second = acting_loads(one), acting_loads(other)
    u = minus(
        plus(first[0], qt.cross(apply_inv_inertia(R, first[1], J), arm)),
        plus(second[0], qt.cross(apply_inv_inertia(S, second[1], K), lever)),
    )
    wn = plus(point_mobility(n, arm, R, one.mass, J), point_mobility(n, lever, S, other.mass, K))
    ws = plus(point_mobility(s, arm, R, one.mass, J), point_mobility(s, lever, S, other.mass, K))
    wt = plus(point_mobility(t, arm, R, one.mass, J), point_mobility(t, lever, S, other.mass, K))
    f = implicit_point_force(u, n, s, t, wn, ws, wt, along, across)
    apply_total_loads((minus(first[0], times(1.0 / one.mass, f)), minus(first[1], qt.cross(arm, f))), one)
    apply_total_loads((plus(second[0], times(1.0 / other.mass, f)), plus(second[1], qt.cross(lever, f))), other)


@inlined
def hold_implicit_loads(first, count, h, offset_frame, bodies):
    """Let loads act by the implicit step over h: own fields, then springs between bodies, one after another.

    A field softens the loads of a spring after the spring itself has. A damper leaves little of its load, so even a
    small share taken from one of the two bodies before that would be large.
    """
    for b in range(bodies.shape[0]):
        _hold_unsoftened_springs(bodies[b], h, offset_frame)
    for b in range(bodies.shape[0]):
        for k in range(first, first + LINK_SIZE * count, LINK_SIZE):
            j = int(bodies[b].columns[k + LINK_OTHER])
            if j > b:  # each spring once
                _soften_pair(k, bodies[b], bodies[j], h, offset_frame)
    for b in range(bodies.shape[0]):
        _soften_springs(bodies[b], h, offset_frame)


@kernel
def note_world_rates(h, offset_frame, bodies):
    """Note for all bodies whether a stage of length h is too long for the explicit midpoint rule for any of them."""
    stiff = 0
    for b in range(bodies.shape[0]):
        body, state = bodies[b], middle_field_state(bodies[b], 0.5 * h, offset_frame)
        x, q, v, L = read_middle(body)
        loads = total_load(state, body.now + 0.5 * h, body)
        note_field_rates(state, kicked_state(x, q, v, L, loads, h, h, offset_frame, body), h, body)
        stiff = max(stiff, bodies[b].is_stiff)
    for b in range(bodies.shape[0]):
        bodies[b].is_stiff = stiff
    return stiff == 1
