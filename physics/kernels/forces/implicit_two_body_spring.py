"""Soften the loads of stiff springs between two bodies, for both bodies at once (`implicit_loads`).

The module also names the columns of such a spring, and reads and writes the *middle* of a body: its state (x, q, v, L)
in the middle of a stage, at which all loads are evaluated.
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
from physics.kernels.state.fixed_body import is_fixed

# Columns of a spring between two bodies, in the parameters of each of them. Columns 0 to 8 are those of a spring to a
# fixed anchor (`spring`); the anchor is the other body's point now. These follow:
LINK_ANCHOR = 3
LINK_VELOCITY = 9  # velocity of the anchor, world frame [m/s]
LINK_OTHER = 12  # index of the other body; -1: the spring is not attached to this body
LINK_OTHER_POINT = 13  # anchor in the other body's frame, from its centre of mass [m]
LINK_OTHER_MOBILITY = 16  # bound of the inverse mass of the anchor [1/kg], by `mobility_bound`
LINK_SIZE = 17


@inlined
def read_middle(body):
    """Read the state (x, q, v, L) that a body has in the middle of the stage, `body.middle`."""
    m = body.middle
    return (m[0], m[1], m[2]), (m[3], m[4], m[5], m[6]), (m[7], m[8], m[9]), (m[10], m[11], m[12])


@inlined
def write_middle(body, y):
    """Store y = (x, q, v, L) as the state of a body in the middle of the stage, `body.middle`."""
    x, q, v, L = y
    m = body.middle
    m[0], m[1], m[2] = x
    m[3], m[4], m[5], m[6] = q
    m[7], m[8], m[9] = v
    m[10], m[11], m[12] = L


@inlined
def middle_field_state(body, later, offset_frame):
    """Make the `FieldState` of a body in the middle of the stage, at the time `body.now` + `later` [s]."""
    x, q, v, L = read_middle(body)
    return field_state(x, q, v, L, body.now + later, offset_frame, body)


@inlined
def _principal(body, offset_frame):
    """Rotation matrix of the principal axes of a body in the middle of the stage."""
    return qt.to_matrix(principal_attitude(read_middle(body)[1], body, offset_frame))


@inlined
def _own_loads(body, h, offset_frame):
    """Softened loads (acceleration, torque) of a body in a stage of length h, without springs to other bodies.

    They are the held loads and those of its own fields, softened by its own fields.
    """
    state = middle_field_state(body, 0.5 * h, offset_frame)
    F, T = total_own_load(state, body.now + 0.5 * h, body)
    return soften_loads(add_held_loads(F, T, body), h, _principal(body, offset_frame), state, body)


@inlined
def _hold_unsoftened_springs(body, h, offset_frame):
    """Let a body's own softened loads act, together with unsoftened loads of its springs to other bodies."""
    F, T = total_linked_load(middle_field_state(body, 0.5 * h, offset_frame), body.now + 0.5 * h, body)
    a, torque = _own_loads(body, h, offset_frame)
    apply_total_loads((plus(a, times(1.0 / body.mass, F)), plus(torque, T)), body)


@inlined
def _soften_springs(body, h, offset_frame):
    """Soften, by a body's own fields, the part of its acting loads that comes from springs to other bodies.

    `_soften_pair` must have softened this part by the springs before.
    """
    own = _own_loads(body, h, offset_frame)
    added, state = subtract_loads(acting_loads(body), own), middle_field_state(body, 0.5 * h, offset_frame)
    apply_total_loads(add_loads(own, soften_loads(added, h, _principal(body, offset_frame), state, body)), body)


@kernel
def _soften_pair(k, one, other, h, offset_frame):
    """Soften the acting loads of the bodies `one` and `other` by the spring between them, for a stage of length h.

    The spring's columns begin at k in `one.columns`. Both bodies get opposite changes of force at the spring's points.
    """
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
    """Let softened loads act on all bodies of a world, in a stiff stage of length h with springs between bodies.

    `count` springs have their columns from `first` on. Own fields soften the own loads first. Then each spring softens
    the loads at both of its ends, one spring after the other. Own fields soften the loads of springs last: a damper
    leaves little of its own load, so even a small share taken from one body before that would be relatively large.
    """
    records = bodies.body
    for b in range(records.shape[0]):
        if not is_fixed(b, bodies):
            _hold_unsoftened_springs(records[b], h, offset_frame)
    for b in range(records.shape[0]):
        for k in range(first, first + LINK_SIZE * count, LINK_SIZE):
            j = int(records[b].columns[k + LINK_OTHER])
            if j > b:  # each spring once
                _soften_pair(k, records[b], records[j], h, offset_frame)
    for b in range(records.shape[0]):
        if not is_fixed(b, bodies):
            _soften_springs(records[b], h, offset_frame)


@kernel
def note_world_rates(h, offset_frame, bodies):
    """Test whether a stage of length h is stiff for any body of a world; return it, and note it in all bodies.

    Stiff means too long for the explicit midpoint rule.
    """
    stiff, records = 0, bodies.body
    for b in range(records.shape[0]):
        if is_fixed(b, bodies):
            continue
        body, state = records[b], middle_field_state(records[b], 0.5 * h, offset_frame)
        x, q, v, L = read_middle(body)
        loads = total_load(state, body.now + 0.5 * h, body)
        note_field_rates(state, kicked_state(x, q, v, L, loads, h, h, offset_frame, body), h, body)
        stiff = max(stiff, records[b].is_stiff)
    for b in range(records.shape[0]):
        records[b].is_stiff = stiff
    return stiff == 1
