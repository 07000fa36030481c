"""Acceleration and torque of a step with fields in it: what is held, and the fields where the step needs them.

Without fields `work.free_acceleration` and `work.torque` are what gravity and the wrench make them, for the whole
call. With fields they are set anew:

- time stepping holds over a stage of length h the loads of its *middle* (`hold_loads`): place and attitude there are
  those of a free drift over h/2, velocities have half a kick of all loads. That is the Strang splitting of drift and
  kick, the kick by the midpoint rule: second order, leapfrog for a field of the position alone, exact where the field
  is zero, and what is in equilibrium stays there;
- in contact the velocity at the middle is that of the start, then, where the loads depend on it, the mean of start and
  end of a first trial (`hold_mean_loads`);
- the event-driven scheme asks for them at every state it looks at (`refresh_loads`).

None of this is in a kernel whose scene declares no field (`terms.if_declared`).
"""

from __future__ import annotations

import math

from physics.kernels import layout as at
from physics.kernels import quaternion as qt
from physics.kernels.body import angular_velocity, principal_attitude
from physics.kernels.compiler import inlined, kernel
from physics.kernels.fields.state import ZERO, FieldState, minus, plus, times
from physics.kernels.fields.stiffness import is_beyond, is_unresolved
from physics.kernels.fields.terms import (
    if_declared,
    if_unknown,
    softened,
    total_air,
    total_load,
    total_mean_load,
    total_rates,
    total_unknown,
)
from physics.kernels.flight import drift

# Evaluations of the midpoint rule beyond the first, and half a turn of the velocity [rad] up to which one will do: it
# gains z⁴/2 of the energy of what turns by 2 z. Fixed point rounds gain z^(2k + 2) after k: rounding, up to z = 1/4.
MIDPOINT_ROUNDS = 13
EXPLICIT_TURN = 1.0e-4

# A user's field is not resolved where its loads change by more than this until the middle of a step, times speed/step.
COARSE = 2.0


@inlined
def _vector(a):
    return (a[0], a[1], a[2])


@if_declared()
def bind_fields(params, i, work):
    """Take the fields' parameters of body i, and what the step holds, into `work`."""
    for c in range(work.columns.shape[0]):
        work.columns[c] = params[i, at.PARAM_SIZE + c]
    for c in range(3):
        work.held_acceleration[c] = work.free_acceleration[c]
        work.held_torque[c] = work.torque[c]
    work.is_stiff = work.is_coarse = 0


@if_declared()
def set_clock(elapsed, work):
    """Say that so much time has passed since the start of the call [s]."""
    work.now = work.call_start + elapsed


@if_declared()
def pass_time(h, work):
    """Say that so much time has passed since it was last said [s]."""
    work.now += h


@inlined
def field_state(x, q, v, L, t, tilted, work):
    """What the fields are told."""
    R = qt.to_matrix(q)
    w = angular_velocity(q, L, work, tilted)
    center = ZERO
    if tilted is not None:
        center = qt.matvec(R, _vector(work.center))
    still = FieldState(x, v, w, R, center, ZERO, work.mass, work.shape, _vector(work.dims))
    air = total_air(still, t, work)
    return FieldState(x, v, w, R, center, air, work.mass, work.shape, _vector(work.dims))


@inlined
def field_load(x, q, v, L, t, tilted, work):
    """(force, torque about the centre of mass) of all fields at a state and a time."""
    return total_load(field_state(x, q, v, L, t, tilted, work), t, work)


@inlined
def put_loads(force, torque, work):
    """Let them act, besides what is held; `work.acceleration` bounds what they do to any point of the body."""
    inv_mass, J = 1.0 / work.mass, work.J
    for c in range(3):
        work.free_acceleration[c] = work.held_acceleration[c] + inv_mass * force[c]
        work.torque[c] = work.held_torque[c] + torque[c]
    a, t = work.free_acceleration, work.torque
    work.acceleration = math.sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2])
    turning = max(J[0], J[1], J[2]) * math.sqrt(t[0] * t[0] + t[1] * t[1] + t[2] * t[2])
    work.acceleration += work.radius * turning


@inlined
def _axes(q, tilted, work):
    """Principal axes in the world."""
    return qt.to_matrix(principal_attitude(q, work, tilted))


@inlined
def all_loads(F, T, work):
    """Acceleration [m/s²] and torque [N m] of fields' loads and of what is held."""
    return plus(_vector(work.held_acceleration), times(1.0 / work.mass, F)), plus(_vector(work.held_torque), T)


@inlined
def put_all(loads, work):
    """Let them act."""
    a, T = loads
    F = times(work.mass, minus(a, _vector(work.held_acceleration)))
    put_loads(F, minus(T, _vector(work.held_torque)), work)


@inlined
def _less(b, a):
    """Difference of two pairs of acceleration and torque."""
    return minus(b[0], a[0]), minus(b[1], a[1])


@inlined
def _more(a, b):
    return plus(a[0], b[0]), plus(a[1], b[1])


@kernel
def note_rates(state, h, work):
    """Note whether a stage of length h is too long for the explicit midpoint rule, and for the fields at all."""
    rates = total_rates(state, h, work)
    work.rate = max(rates[0], rates[2])
    work.is_stiff = 1 if is_beyond(rates, h) else 0
    if is_unresolved(rates, h):
        work.is_coarse = 1
    return rates[2]


@inlined
def note_coarse(first, second, scale, work):
    """Note that loads (F, T) of fields which do not tell their rates have changed too much within a stage.

    `scale` [m/s²] is the change at which they count as not resolved.
    """
    F, T = minus(second[0], first[0]), minus(second[1], first[1])
    J = max(work.J[0], work.J[1], work.J[2])
    change = math.sqrt(qt.dot(F, F)) / work.mass + work.radius * J * math.sqrt(qt.dot(T, T))
    if change > scale:
        work.is_coarse = 1


@if_unknown()
def look_over_stage(y, middle, x, q, h, tilted, work):
    """Note whether what fields of a user's own do changes too much over a stage from y, `middle` at (x, q) with y's v, L.

    Under a stiffness of frequency Ω the loads change by Ω² h v/2 until the middle: h times that is more than 2 v where
    h Ω > 2. Half a kick of a damping λ changes the loads by λ h/2 of what they are: more than 1 where h λ > 2.
    """
    t = work.now
    v, L = y[2], y[3]
    start = total_unknown(field_state(y[0], y[1], v, L, t, tilted, work), t, work)
    moved = total_unknown(field_state(x, q, v, L, t, tilted, work), t, work)
    w = angular_velocity(q, L, work, tilted)
    speed = math.sqrt(qt.dot(v, v)) + work.radius * math.sqrt(qt.dot(w, w))
    note_coarse(start, moved, COARSE * speed / h, work)
    a, T = all_loads(middle[0], middle[1], work)
    v, L = plus(v, times(0.5 * h, a)), plus(L, times(0.5 * h, T))
    kicked = total_unknown(field_state(x, q, v, L, t, tilted, work), t, work)
    J = max(work.J[0], work.J[1], work.J[2])
    size = math.sqrt(qt.dot(a, a)) + work.radius * J * math.sqrt(qt.dot(T, T))
    note_coarse(moved, kicked, size, work)


@if_declared()
def hold_loads(y, h, gyroscopic, tilted, work):
    """Hold the loads of the middle of a flight of length h that starts at y, now."""
    x, q, v, L = y
    half = 0.5 * h
    t = work.now + half
    q = drift(q, L, work, half, gyroscopic, tilted)
    x = plus(x, times(half, v))
    state = field_state(x, q, v, L, t, tilted, work)
    F, T = total_load(state, t, work)
    look_over_stage(y, (F, T), x, q, h, tilted, work)
    turn = note_rates(state, h, work)
    if work.is_stiff == 1:
        put_all(softened(all_loads(F, T, work), h, _axes(q, tilted, work), state, work), work)
        return
    for k in range(MIDPOINT_ROUNDS):
        a, torque = all_loads(F, T, work)
        state = field_state(x, q, plus(v, times(half, a)), plus(L, times(half, torque)), t, tilted, work)
        before, (F, T) = (F, T), total_load(state, t, work)
        if not half * turn > EXPLICIT_TURN or (before[0] == F and before[1] == T):
            break
    put_loads(F, T, work)


@if_declared()
def hold_contact_loads(y, h, gyroscopic, tilted, work):
    """Hold the loads of the middle of a stage in contact, with the velocities of its start.

    Where the stage is stiff, those that depend on velocities are softened as if there were no contact.
    """
    x, q, v, L = y
    half = 0.5 * h
    t = work.now + half
    q = drift(q, L, work, half, gyroscopic, tilted)
    x = plus(x, times(half, v))
    state = field_state(x, q, v, L, t, tilted, work)
    F, T = total_load(state, t, work)
    look_over_stage(y, (F, T), x, q, h, tilted, work)
    note_rates(state, h, work)
    if work.is_stiff == 1:
        still = all_loads(*field_load(x, q, state.air, ZERO, t, tilted, work), work)
        slowed = softened(_less(all_loads(F, T, work), still), h, _axes(q, tilted, work), state, work)
        put_all(_more(still, slowed), work)
        return
    put_loads(F, T, work)


@if_declared(False)
def hold_mean_loads(y, end, h, gyroscopic, tilted, work):
    """Hold the loads of the middle of a stage in contact from y to `end`: whether they are others than before.

    Where the stage is stiff, the change is softened: with A' = A + (1 + M⁻¹ Z)⁻¹ (A(middle) - A) loads and motion agree, if
    the contacts push as they did.
    """
    x, q, v, L = y
    half = 0.5 * h
    t = work.now + half
    q = drift(q, L, work, half, gyroscopic, tilted)
    x, v, L = plus(x, times(half, v)), times(0.5, plus(v, end[2])), times(0.5, plus(L, end[3]))
    state = field_state(x, q, v, L, t, tilted, work)
    F, T = total_load(state, t, work)
    a, torque = _vector(work.free_acceleration), _vector(work.torque)
    if work.is_stiff == 1:
        change = softened(_less(all_loads(F, T, work), (a, torque)), h, _axes(q, tilted, work), state, work)
        put_all(_more((a, torque), change), work)
    else:
        put_loads(F, T, work)
    return a != _vector(work.free_acceleration) or torque != _vector(work.torque)


@if_declared()
def hold_softened_loads(y, h, gyroscopic, tilted, work):
    """Hold the loads of an implicit step over h from y, whatever touches."""
    x, q, v, L = y
    half = 0.5 * h
    t = work.now + half
    q = drift(q, L, work, half, gyroscopic, tilted)
    state = field_state(plus(x, times(half, v)), q, v, L, t, tilted, work)
    F, T = total_load(state, t, work)
    put_all(softened(all_loads(F, T, work), h, _axes(q, tilted, work), state, work), work)


@inlined
def loads_held(work):
    """Acceleration and torque that act."""
    return _vector(work.free_acceleration), _vector(work.torque)


@inlined
def size_of(loads, work):
    """Bound of what an acceleration and a torque do to any point of the body [m/s²]."""
    a, T = loads
    J = max(work.J[0], work.J[1], work.J[2])
    return math.sqrt(qt.dot(a, a)) + work.radius * J * math.sqrt(qt.dot(T, T))


@inlined
def change_to_agree(y, end, loads, h, gyroscopic, tilted, work):
    """What `loads` lack to agree with a flight over h from y to `end`, softened as `stiffness` has it."""
    t, half = work.now + 0.5 * h, 0.5 * h
    v, L = times(0.5, plus(y[2], end[2])), times(0.5, plus(y[3], end[3]))
    x, q = times(0.5, plus(y[0], end[0])), drift(y[1], y[3], work, half, gyroscopic, tilted)
    middle = field_state(x, q, v, L, t, tilted, work)
    first = field_state(y[0], y[1], v, L, t, tilted, work)
    last = field_state(end[0], end[1], v, L, t, tilted, work)
    F, T = total_mean_load((middle, first, last), t, work)
    return softened(_less(all_loads(F, T, work), loads), h, _axes(q, tilted, work), middle, work)


@if_declared(False)
def is_stiff(work):
    """Whether the loads that are held are those of an implicit step."""
    return work.is_stiff == 1


@if_declared()
def note_report(is_moved, report, work):
    """Count a body that has moved in fields which some stage of the call did not resolve."""
    if work.is_coarse == 1 and is_moved:
        report[work.world, at.COARSE] += 1.0


@if_declared()
def refresh_loads(y, later, tilted, work):
    """Let the loads at the state y act, `later` [s] than now."""
    x, q, v, L = y
    F, T = field_load(x, q, v, L, work.now + later, tilted, work)
    put_loads(F, T, work)
    if F != ZERO or T != ZERO or _vector(work.held_torque) != ZERO:
        work.is_felt = 1


@if_declared(False)
def has_fields(work):
    """Whether the scene declares a field."""
    return True


@if_declared(0.0)
def time_now(work):
    """The time now [s]."""
    return work.now


@if_declared(0.0)
def start_feeling(work):
    """Forget what was felt; the time now [s]."""
    work.is_felt = 0
    return work.now


@if_declared()
def set_now(t, work):
    """Say what time it is [s]."""
    work.now = t


@if_declared(True)
def was_felt(work):
    """Whether a field, or a held torque, was not zero anywhere since `start_feeling`."""
    return work.is_felt == 1
