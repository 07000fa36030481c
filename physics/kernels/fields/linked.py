"""Spring and damper between two bodies: to each of them a spring to an anchor that moves with the other.

The point of the other body and its velocity are numbers among the spring's columns, written (`put_anchors`) before
the loads of either body are asked for. Both ends see the same two points and velocities, so that their forces are
equal and opposite to the last bit; and since the loads of a stage are those of its middle, where they act along the
line of the two points, momentum and angular momentum of the two together are kept to rounding.
"""

from __future__ import annotations

from numba.extending import overload

from physics.kernels import layout as at
from physics.kernels import quaternion as qt
from physics.kernels.body import angular_velocity, principal_attitude, read_state, turning
from physics.kernels.compiler import CHOSEN, inlined, kernel
from physics.kernels.fields.loads import all_loads, field_load, field_state, note_rates, put_all, put_loads
from physics.kernels.fields.spring import DAMPING, LENGTH, STIFFNESS, line_stiffness, stretch
from physics.kernels.fields.state import ZERO, acting_at, minus, plus, times, velocity_at
from physics.kernels.fields.stiffness import answer_of, answer_to, arm_square, axes_across, mobility_bound, soften_arm
from physics.kernels.fields.terms import LOAD, instances, softened, total_load
from physics.kernels.flight import drift
from physics.kernels.many.islands import join

# Columns: those of a spring, whose anchor is the other body's point now, and after them
ANCHOR = 3
VELOCITY = 9  # of the anchor, world frame [m/s]
OTHER = 12  # index of the other body, -1: the spring is not at this one
OTHER_POINT = 13  # in the other body's frame, from its centre of mass [m]
OTHER_MOBILITY = 16  # bound of the inverse mass of that point [1/kg]
SIZE = 17


@inlined
def linked_spring(state, p, t):
    """(force, torque) of a spring to another body."""
    if p[OTHER] < 0.0 or (p[STIFFNESS] == 0.0 and p[DAMPING] == 0.0):
        return ZERO, ZERO
    arm, e, l = stretch(state, p)
    u = minus(velocity_at(state, arm), (p[VELOCITY], p[VELOCITY + 1], p[VELOCITY + 2]))
    if l == 0.0:
        return acting_at(arm, times(-p[DAMPING], u))
    s = p[STIFFNESS] * (l - p[LENGTH]) + p[DAMPING] * qt.dot(u, e) / l
    return acting_at(arm, times(-s / l, e))


@inlined
def linked_spring_rates(state, p, J, h):
    """Rates of `stiffness`, of the two ends against each other."""
    if p[OTHER] < 0.0:
        return ZERO
    force, _ = linked_spring(state, p, 0.0)
    arm, _, _ = stretch(state, p)
    w = mobility_bound(arm, state.mass, J) + p[OTHER_MOBILITY]
    return (p[DAMPING] * w, p[STIFFNESS] * w + arm_square(force, arm, J), 0.0)


@inlined
def soften_linked_arm(loads, h, R, state, p, J):
    """Torque as `stiffness` has it under the force at its arm; the rest is for both ends at once (`hold_linked_loads`)."""
    if p[OTHER] < 0.0:
        return loads
    force, _ = linked_spring(state, p, 0.0)
    arm, _, _ = stretch(state, p)
    return soften_arm(loads, h, force, arm, R, J)


@inlined
def linked_spring_energy(state, p, t):
    """Half of ½ k (l - l0)² [J]: the other half is the other body's."""
    if p[OTHER] < 0.0:
        return 0.0
    _, _, l = stretch(state, p)
    return 0.25 * p[STIFFNESS] * (l - p[LENGTH]) * (l - p[LENGTH])


def _first_columns(record) -> list[int]:
    """First column of each spring between bodies in a record of a body, or in the type of one."""
    return [first for term, first, _ in instances(record, LOAD) if term.function is linked_spring]


def _if_linked(where, otherwise):
    """Make a function a kernel that is told first column and number of the springs, else returns `otherwise`.

    `where` gives the record of a body, or its type, from the function's arguments.
    """

    def decorate(function):
        compiled = kernel(function)

        def chosen(arguments, callee):
            columns = _first_columns(where(arguments))
            if not columns:
                return lambda *arguments: otherwise
            first, count = columns[0], len(columns)
            return lambda *arguments: callee(first, count, *arguments)

        def stub(*arguments):
            return chosen(arguments, function)(*arguments)

        @overload(stub, jit_options=CHOSEN, strict=False)
        def choose(*types):
            return chosen(types, compiled)

        stub.__doc__ = function.__doc__
        return stub

    return decorate


def _record(world):
    """Record of a body in a `Many` or `Linked`, or its type in the type of one."""
    if hasattr(world, "bodies"):
        return world.bodies[0]
    return world.types[world.fields.index("bodies")].dtype


@inlined
def _put_anchor(first, columns, x, R, v, w, mobility):
    """Write point and velocity of the other body, whose state this is, and its mobility, into the columns of a spring."""
    o = first + OTHER_POINT
    r = qt.matvec(R, (columns[o], columns[o + 1], columns[o + 2]))
    place, speed = plus(x, r), plus(v, qt.cross(w, r))
    for c in range(3):
        columns[first + ANCHOR + c] = place[c]
        columns[first + VELOCITY + c] = speed[c]
    columns[first + OTHER_MOBILITY] = mobility


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
def _put_anchors(first, count, tilted, bodies):
    """Put the anchors of all springs where the bodies' `middle` says."""
    for b in range(bodies.shape[0]):
        columns = bodies[b].columns
        for k in range(first, first + SIZE * count, SIZE):
            if columns[k + OTHER] >= 0.0:
                other = bodies[int(columns[k + OTHER])]
                x, q, v, L = middle(other)
                w = angular_velocity(q, L, other, tilted)
                o = k + OTHER_POINT
                mobility = mobility_bound((columns[o], columns[o + 1], columns[o + 2]), other.mass, other.J)
                _put_anchor(k, columns, x, qt.to_matrix(q), v, w, mobility)


@inlined
def _state_of(body, later, tilted):
    """State that the fields of a body are told in its middle."""
    x, q, v, L = middle(body)
    return field_state(x, q, v, L, body.now + later, tilted, body)


@inlined
def _principal(body, tilted):
    """Principal axes of a body in its middle."""
    return qt.to_matrix(principal_attitude(middle(body)[1], body, tilted))


@inlined
def _soften_own(body, h, tilted):
    """Let the loads of a body act that the implicit step over h of its own fields has, with those of its springs as given.

    A body may be held by others alone: its springs to them follow (`_soften_pair`).
    """
    state = _state_of(body, 0.5 * h, tilted)
    F, T = total_load(state, body.now + 0.5 * h, body)
    put_all(softened(all_loads(F, T, body), h, _principal(body, tilted), state, body), body)


@inlined
def _loads_now(body):
    """Acceleration and torque that act on a body."""
    a, T = body.free_acceleration, body.torque
    return (a[0], a[1], a[2]), (T[0], T[1], T[2])


@kernel
def _soften_pair(k, one, other, h, tilted):
    """Loads of two bodies as the implicit step over h of the spring in columns k has them: equal and opposite changes."""
    columns = one.columns
    state, p = _state_of(one, 0.5 * h, tilted), columns[k : k + SIZE]
    arm, e, l = stretch(state, p)
    x, q, _, _ = middle(other)
    o = k + OTHER_POINT
    lever = qt.matvec(qt.to_matrix(q), (columns[o], columns[o + 1], columns[o + 2]))
    J, R = (one.J[0], one.J[1], one.J[2]), _principal(one, tilted)
    K, S = (other.J[0], other.J[1], other.J[2]), _principal(other, tilted)
    w = mobility_bound(arm, one.mass, J) + mobility_bound(lever, other.mass, K)
    n, along, across = line_stiffness(h, w, e, l, p)
    s, t = axes_across(n)
    first, second = _loads_now(one), _loads_now(other)
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
def _soften_pairs(first, count, h, tilted, bodies):
    """Loads as the implicit step over h of all springs between bodies has them, one spring after the other."""
    for b in range(bodies.shape[0]):
        for k in range(first, first + SIZE * count, SIZE):
            j = int(bodies[b].columns[k + OTHER])
            if j > b:  # each spring once
                _soften_pair(k, bodies[b], bodies[j], h, tilted)


@kernel
def _note_all_rates(h, tilted, bodies):
    """Note for all bodies whether a stage of length h is too long for the explicit midpoint rule: whether it is for one."""
    stiff = 0
    for b in range(bodies.shape[0]):
        note_rates(_state_of(bodies[b], 0.5 * h, tilted), h, bodies[b])
        stiff = max(stiff, bodies[b].is_stiff)
    for b in range(bodies.shape[0]):
        bodies[b].is_stiff = stiff
    return stiff == 1


@_if_linked(lambda arguments: _record(arguments[-1]), False)
def hold_linked_loads(first, count, h, gyroscopic, tilted, world):
    """`loads.hold_loads` for bodies that springs tie together: all at once. False, and nothing done, without those.

    A body in contact keeps the velocities of the start of the stage, as in `loads.hold_contact_loads`.
    """
    bodies, half = world.bodies, 0.5 * h
    for b in range(bodies.shape[0]):
        x, q, v, L = read_state(world.now, b)
        q = drift(q, L, bodies[b], half, gyroscopic, tilted)
        put_middle(bodies[b], (plus(x, times(half, v)), q, v, L))
    _put_anchors(first, count, tilted, bodies)
    if _note_all_rates(h, tilted, bodies):
        for b in range(bodies.shape[0]):
            _soften_own(bodies[b], h, tilted)
        _soften_pairs(first, count, h, tilted, bodies)
        return True
    for b in range(bodies.shape[0]):
        if world.touched[b] == 0:
            _kick(bodies[b], half, tilted)
    _put_anchors(first, count, tilted, bodies)
    for b in range(bodies.shape[0]):
        x, q, v, L = middle(bodies[b])
        F, T = field_load(x, q, v, L, bodies[b].now + half, tilted, bodies[b])
        put_loads(F, T, bodies[b])
    return True


@_if_linked(lambda arguments: _record(arguments[-1]), None)
def place_anchors(first, count, tilted, world):
    """Put the anchors of all springs where the bodies' `middle` says."""
    _put_anchors(first, count, tilted, world.bodies)


@_if_linked(lambda arguments: _record(arguments[-1]), None)
def place_anchors_now(first, count, tilted, world):
    """Put the anchors of all springs where the bodies are now."""
    for b in range(world.bodies.shape[0]):
        put_middle(world.bodies[b], read_state(world.now, b))
    _put_anchors(first, count, tilted, world.bodies)


@_if_linked(lambda arguments: _record(arguments[-1]), None)
def join_linked(first, count, parent, world):
    """Make one island of any two bodies that a spring ties together, in what leads to the first body of each."""
    for b in range(world.bodies.shape[0]):
        columns = world.bodies[b].columns
        for k in range(first, first + SIZE * count, SIZE):
            if columns[k + OTHER] >= 0.0:
                join(b, int(columns[k + OTHER]), parent)


@inlined
def _kick(body, half, tilted):
    """Give the middle of a body half a stage's kick of all loads."""
    x, q, v, L = middle(body)
    F, T = field_load(x, q, v, L, body.now + half, tilted, body)
    a, held = body.held_acceleration, body.held_torque
    v = plus(v, times(half, plus((a[0], a[1], a[2]), times(1.0 / body.mass, F))))
    L = plus(L, times(half, plus((held[0], held[1], held[2]), T)))
    put_middle(body, (x, q, v, L))


@_if_linked(lambda arguments: arguments[-1], None)
def look_for_anchors(first, count, i, state, bodies, work):
    """Put the anchors of body i's springs where the other bodies of its world are now."""
    for k in range(first, first + SIZE * count, SIZE):
        if work.columns[k + OTHER] >= 0.0:
            j = i - i % bodies + int(work.columns[k + OTHER])
            x, q, v, _ = read_state(state, j)
            w = (state[j, at.ANGVEL], state[j, at.ANGVEL + 1], state[j, at.ANGVEL + 2])
            _put_anchor(k, work.columns, x, qt.to_matrix(q), v, w, 0.0)
