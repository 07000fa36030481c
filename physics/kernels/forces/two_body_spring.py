"""Spring and damper between two bodies: for each body a spring to an anchor, which is a point of the other body.

The place and the velocity of the anchor are among the columns of the spring. They are written (`place_anchors`) before
the loads of either body are evaluated. Both bodies use the same two points and velocities, so their forces are equal
and opposite to the last bit. The loads of a stage are those of its middle, and act along the line between the two
points there. So the momentum and angular momentum of the two bodies together are kept to rounding.
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
from physics.kernels.state.fixed_body import is_fixed


@inlined
def linked_spring(state, p, t):
    """Force and torque on a body by a spring to another body, from its `FieldState` and the parameters p.

    Both are zero if the spring is not attached to the body.
    """
    if p[LINK_OTHER] < 0.0 or (p[SPRING_STIFFNESS] == 0.0 and p[SPRING_DAMPING] == 0.0):
        return ZERO, ZERO
    arm, e, l = spring_vector(state, p)
    u = minus(velocity_at(state, arm), (p[LINK_VELOCITY], p[LINK_VELOCITY + 1], p[LINK_VELOCITY + 2]))
    return spring_damper_load(arm, e, l, u, p)


@inlined
def linked_spring_rates(state, p, J, h):
    """Rates (λ, Ω², γ) of a spring between two bodies, of the motion of its two ends relative to each other.

    They are damping, squared frequency and turning (`implicit_loads`).
    """
    if p[LINK_OTHER] < 0.0:
        return ZERO
    force, _ = linked_spring(state, p, 0.0)
    arm, _, _ = spring_vector(state, p)
    w = mobility_bound(arm, state.mass, J) + p[LINK_OTHER_MOBILITY]
    return (p[SPRING_DAMPING] * w, p[SPRING_STIFFNESS] * w + arm_frequency_squared(force, arm, J), 0.0)


@inlined
def soften_linked_arm(loads, h, R, state, p, J):
    """Soften the torque of the loads (acceleration, torque): the spring's force at its arm makes the body swing.

    Along and across the spring, loads are softened for both bodies at once (`implicit_two_body_spring`).
    """
    if p[LINK_OTHER] < 0.0:
        return loads
    force, _ = linked_spring(state, p, 0.0)
    arm, _, _ = spring_vector(state, p)
    return soften_arm(loads, h, force, arm, R, J)


@inlined
def linked_spring_energy(state, p, t):
    """Share of one body in the potential energy of a spring between two bodies: half of ½ k (l - l0)² [J]."""
    if p[LINK_OTHER] < 0.0:
        return 0.0
    _, _, l = spring_vector(state, p)
    return 0.25 * p[SPRING_STIFFNESS] * (l - p[SPRING_LENGTH]) * (l - p[SPRING_LENGTH])


def _first_columns(record) -> list[int]:
    """First column of each spring between two bodies; `record` is a body's record, or the type of such a record."""
    return [first for term, first, _ in iterate_terms(record, LOAD) if term.function is linked_spring]


def _if_linked(where, otherwise):
    """Decorate a kernel that is called only in scenes with springs between bodies; elsewhere it returns `otherwise`.

    Callers leave out the function's first two arguments, the springs' first column and their number. `where` takes the
    other arguments as a tuple, and returns the record of a body, or its type.
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
    """Record of one body from a group of arguments with the member `body`; for the group's type, the record's type.

    Such a group is `LinkedWorld` or `multibody.data.arrays.Bodies`.
    """
    body = backend.member(bodies, "body")
    return body[0] if len(getattr(body, "shape", ())) else body.dtype


@inlined
def _put_anchor(first, columns, x, R, v, w, mobility):
    """Write place, velocity and mobility of a spring's anchor into the spring's columns, which begin at `first`.

    The other body, whose point the anchor is, has position x, rotation matrix R, velocity v and angular velocity w.
    """
    o = first + LINK_OTHER_POINT
    r = qt.matvec(R, (columns[o], columns[o + 1], columns[o + 2]))
    place, speed = plus(x, r), plus(v, qt.cross(w, r))
    for c in range(3):
        columns[first + LINK_ANCHOR + c] = place[c]
        columns[first + LINK_VELOCITY + c] = speed[c]
    columns[first + LINK_OTHER_MOBILITY] = mobility


@inlined
def _put_anchors(first, count, offset_frame, records):
    """Write the anchors of `count` springs of each body, from the states of the bodies in the middle of the stage.

    The springs' columns begin at `first`.
    """
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
    """Let the loads of the middle of a stage of length h act on all bodies of a world that has springs between bodies.

    Returns True; without such springs it changes nothing and returns False. A body in contact (`bodies.touched`) has
    the velocities of the start of the stage in its middle, as in `held_loads.hold_contact_loads`.
    """
    records, half = bodies.body, 0.5 * h
    for b in range(records.shape[0]):
        if is_fixed(b, bodies):
            continue
        x, q, v, L = read_state(bodies.state, b)
        q = drift_attitude(q, L, records[b], half, gyroscopic, offset_frame)
        write_middle(records[b], (plus(x, times(half, v)), q, v, L))
    _put_anchors(first, count, offset_frame, records)
    if note_world_rates(h, offset_frame, bodies):
        hold_implicit_loads(first, count, h, offset_frame, bodies)
        return True
    for b in range(records.shape[0]):
        if bodies.touched[b] == 0 and not is_fixed(b, bodies):
            _kick(records[b], half, offset_frame)
    _put_anchors(first, count, offset_frame, records)
    for b in range(records.shape[0]):
        if is_fixed(b, bodies):
            continue
        x, q, v, L = read_middle(records[b])
        F, T = field_load(x, q, v, L, records[b].now + half, offset_frame, records[b])
        apply_loads(F, T, records[b])
    return True


@_if_linked(lambda arguments: _record(arguments[-1]), None)
def place_anchors(first, count, offset_frame, bodies):
    """Write the anchors of all springs between bodies, from the states of the bodies in the middle of the stage."""
    _put_anchors(first, count, offset_frame, bodies.body)


@_if_linked(lambda arguments: _record(arguments[-1]), None)
def place_anchors_now(first, count, offset_frame, bodies):
    """Write the anchors of all springs between bodies, from the bodies' present states."""
    for b in range(bodies.body.shape[0]):
        write_middle(bodies.body[b], read_state(bodies.state, b))
    _put_anchors(first, count, offset_frame, bodies.body)


@_if_linked(lambda arguments: _record(arguments[-1]), None)
def unite_linked_bodies(first, count, parent, bodies):
    """Join the sets of any two bodies that a spring ties, in the union-find array `parent` (`union_find`)."""
    for b in range(bodies.body.shape[0]):
        columns = bodies.body[b].columns
        for k in range(first, first + LINK_SIZE * count, LINK_SIZE):
            if columns[k + LINK_OTHER] >= 0.0:
                unite_sets(b, int(columns[k + LINK_OTHER]), parent)


@inlined
def _kick(body, half, offset_frame):
    """Let all loads act on the velocities of a body in the middle of the stage for the time `half` [s]."""
    x, q, v, L = read_middle(body)
    F, T = field_load(x, q, v, L, body.now + half, offset_frame, body)
    a, held = body.held_acceleration, body.held_torque
    v = plus(v, times(half, plus((a[0], a[1], a[2]), times(1.0 / body.mass, F))))
    L = plus(L, times(half, plus((held[0], held[1], held[2]), T)))
    write_middle(body, (x, q, v, L))


@_if_linked(lambda arguments: arguments[-1], None)
def place_anchors_of_body(first, count, i, state, bodies, body):
    """Write the anchors of the springs of the body in row i, from the present states of the other bodies of its world.

    `bodies` is the number of bodies in each world, `body` the record of body i.
    """
    for k in range(first, first + LINK_SIZE * count, LINK_SIZE):
        if body.columns[k + LINK_OTHER] >= 0.0:
            j = i - i % bodies + int(body.columns[k + LINK_OTHER])
            x, q, v, _ = read_state(state, j)
            w = (state[j, at.ANGVEL], state[j, at.ANGVEL + 1], state[j, at.ANGVEL + 2])
            _put_anchor(k, body.columns, x, qt.to_matrix(q), v, w, 0.0)
