"""Spring and damper between two bodies: for each body a spring to an anchor that moves with the other.

The point of the other body and its velocity are numbers among the spring's columns, written (`place_anchors`) before
the loads of either body are evaluated. Both ends see the same two points and velocities, so that their forces are
equal and opposite to the last bit; and since the loads of a stage are those of its middle, where they act along the
line of the two points, momentum and angular momentum of the two together are kept to rounding.
"""

from __future__ import annotations

from physics.compiler.decorators import backend, by_type, inlined, kernel
from physics.kernels.flight.free_flight import drift_attitude
from physics.kernels.forces.field_loads import apply_loads, field_load
from physics.kernels.forces.force_field_dispatch import LOAD, iterate_terms
from physics.kernels.forces.force_field_state import ZERO, velocity_at
from physics.kernels.forces.implicit_loads import arm_frequency_squared, mobility_bound, soften_arm
from physics.kernels.forces.implicit_two_body_spring import (
    LINK_ANCHOR,
    LINK_OTHER,
    LINK_OTHER_MOBILITY,
    LINK_OTHER_POINT,
    LINK_SIZE,
    LINK_VELOCITY,
    hold_implicit_loads,
    note_world_rates,
    read_middle,
    write_middle,
)
from physics.kernels.forces.spring import (
    SPRING_DAMPING,
    SPRING_LENGTH,
    SPRING_STIFFNESS,
    spring_damper_load,
    spring_vector,
)
from physics.kernels.math import quaternion as qt
from physics.kernels.math.union_find import unite_sets
from physics.kernels.math.vector import minus, plus, times
from physics.kernels.state import layout as at
from physics.kernels.state.body import angular_velocity, read_state


@inlined
def linked_spring(state, p, t):
    """(force, torque) of a spring to another body."""
    if p[LINK_OTHER] < 0.0 or (p[SPRING_STIFFNESS] == 0.0 and p[SPRING_DAMPING] == 0.0):
        return ZERO, ZERO
    arm, e, l = spring_vector(state, p)
    u = minus(velocity_at(state, arm), (p[LINK_VELOCITY], p[LINK_VELOCITY + 1], p[LINK_VELOCITY + 2]))
    return spring_damper_load(arm, e, l, u, p)


@inlined
def linked_spring_rates(state, p, J, h):
    """Rates of `implicit_loads`, of the two ends against each other."""
    if p[LINK_OTHER] < 0.0:
        return ZERO
    force, _ = linked_spring(state, p, 0.0)
    arm, _, _ = spring_vector(state, p)
    w = mobility_bound(arm, state.mass, J) + p[LINK_OTHER_MOBILITY]
    return (p[SPRING_DAMPING] * w, p[SPRING_STIFFNESS] * w + arm_frequency_squared(force, arm, J), 0.0)


@inlined
def soften_linked_arm(loads, h, R, state, p, J):
    """Torque of `implicit_loads` under the force at its arm; the other loads are softened for both ends at once."""
    if p[LINK_OTHER] < 0.0:
        return loads
    force, _ = linked_spring(state, p, 0.0)
    arm, _, _ = spring_vector(state, p)
    return soften_arm(loads, h, force, arm, R, J)


@inlined
def linked_spring_energy(state, p, t):
    """Half of ½ k (l - l0)² [J]; the other body has the other half."""
    if p[LINK_OTHER] < 0.0:
        return 0.0
    _, _, l = spring_vector(state, p)
    return 0.25 * p[SPRING_STIFFNESS] * (l - p[SPRING_LENGTH]) * (l - p[SPRING_LENGTH])


def _first_columns(record) -> list[int]:
    """First column of each spring between bodies in a body's record, or in the type of one."""
    return [first for term, first, _ in iterate_terms(record, LOAD) if term.function is linked_spring]


def _if_linked(where, otherwise):
    """Make a kernel of a function of the springs' first column and number; without springs it returns `otherwise`.

    `where` gives the record of a body, or its type, from the function's arguments.
    """

    def decorate(function):
        compiled = kernel(function)

        def chosen(*arguments):
            columns = _first_columns(where(arguments))
            if not columns:
                return lambda *arguments: otherwise
            first, count = columns[0], len(columns)
            return lambda *arguments: compiled(first, count, *arguments)

        return by_type(chosen, function)

    return decorate


def _record(bodies):
    """Record of a body in a group with `body` (`multibody.data.arrays.Bodies`), or its type in the group's type."""
    body = backend.member(bodies, "body")
    return body[0] if len(getattr(body, "shape", ())) else body.dtype


@inlined
def _put_anchor(first, columns, x, R, v, w, mobility):
    """Write point, velocity and mobility of the other body, in the given state, into the columns of a spring."""
    o = first + LINK_OTHER_POINT
    r = qt.matvec(R, (columns[o], columns[o + 1], columns[o + 2]))
    place, speed = plus(x, r), plus(v, qt.cross(w, r))
    for c in range(3):
        columns[first + LINK_ANCHOR + c] = place[c]
        columns[first + LINK_VELOCITY + c] = speed[c]
    columns[first + LINK_OTHER_MOBILITY] = mobility


@inlined
def _put_anchors(first, count, offset_frame, records):
    """Place the anchors of all springs by the bodies' `read_middle`."""
    for b in range(records.shape[0]):
        columns = records[b].columns
        for k in range(first, first + LINK_SIZE * count, LINK_SIZE):
            if columns[k + LINK_OTHER] >= 0.0:
                other = records[int(columns[k + LINK_OTHER])]
                x, q, v, L = read_middle(other)
                w = angular_velocity(q, L, other, offset_frame)
                o = k + LINK_OTHER_POINT
                mobility = mobility_bound((columns[o], columns[o + 1], columns[o + 2]), other.mass, other.J)
                _put_anchor(k, columns, x, qt.to_matrix(q), v, w, mobility)


@_if_linked(lambda arguments: _record(arguments[-1]), False)
def hold_linked_loads(first, count, h, gyroscopic, offset_frame, bodies):
    """Do `held_loads.hold_loads` for bodies tied by springs, all at once. False, and no change, without springs.

    A body in contact keeps the velocities of the start of the stage, as in `held_loads.hold_contact_loads`.
    """
    records, half = bodies.body, 0.5 * h
    for b in range(records.shape[0]):
        x, q, v, L = read_state(bodies.state, b)
        q = drift_attitude(q, L, records[b], half, gyroscopic, offset_frame)
        write_middle(records[b], (plus(x, times(half, v)), q, v, L))
    _put_anchors(first, count, offset_frame, records)
    if note_world_rates(h, offset_frame, records):
        hold_implicit_loads(first, count, h, offset_frame, records)
        return True
    for b in range(records.shape[0]):
        if bodies.touched[b] == 0:
            _kick(records[b], half, offset_frame)
    _put_anchors(first, count, offset_frame, records)
    for b in range(records.shape[0]):
        x, q, v, L = read_middle(records[b])
        F, T = field_load(x, q, v, L, records[b].now + half, offset_frame, records[b])
        apply_loads(F, T, records[b])
    return True


@_if_linked(lambda arguments: _record(arguments[-1]), None)
def place_anchors(first, count, offset_frame, bodies):
    """Place the anchors of all springs by the bodies' `read_middle`."""
    _put_anchors(first, count, offset_frame, bodies.body)


@_if_linked(lambda arguments: _record(arguments[-1]), None)
def place_anchors_now(first, count, offset_frame, bodies):
    """Place the anchors of all springs at the bodies' present states."""
    for b in range(bodies.body.shape[0]):
        write_middle(bodies.body[b], read_state(bodies.state, b))
    _put_anchors(first, count, offset_frame, bodies.body)


@_if_linked(lambda arguments: _record(arguments[-1]), None)
def unite_linked_bodies(first, count, parent, bodies):
    """Join the islands of bodies tied by a spring, in the table from each body to the first of its island."""
    for b in range(bodies.body.shape[0]):
        columns = bodies.body[b].columns
        for k in range(first, first + LINK_SIZE * count, LINK_SIZE):
            if columns[k + LINK_OTHER] >= 0.0:
                unite_sets(b, int(columns[k + LINK_OTHER]), parent)


@inlined
def _kick(body, half, offset_frame):
    """Give the middle of a body half a stage's kick of all loads."""
    x, q, v, L = read_middle(body)
    F, T = field_load(x, q, v, L, body.now + half, offset_frame, body)
    a, held = body.held_acceleration, body.held_torque
    v = plus(v, times(half, plus((a[0], a[1], a[2]), times(1.0 / body.mass, F))))
    L = plus(L, times(half, plus((held[0], held[1], held[2]), T)))
    write_middle(body, (x, q, v, L))


@_if_linked(lambda arguments: arguments[-1], None)
def place_anchors_of_body(first, count, i, state, bodies, body):
    """Place the anchors of body i's springs at the present states of the other bodies of its world."""
    for k in range(first, first + LINK_SIZE * count, LINK_SIZE):
        if body.columns[k + LINK_OTHER] >= 0.0:
            j = i - i % bodies + int(body.columns[k + LINK_OTHER])
            x, q, v, _ = read_state(state, j)
            w = (state[j, at.ANGVEL], state[j, at.ANGVEL + 1], state[j, at.ANGVEL + 2])
            _put_anchor(k, body.columns, x, qt.to_matrix(q), v, w, 0.0)
