"""Acceleration and torque of a step with fields: loads that are held, and when fields are evaluated.

Without fields `body.free_acceleration` and `body.torque` are what gravity and the wrench make them, for the whole
call. With fields they are set anew:

- time stepping holds over a stage of length h the loads of its *middle* (`hold_loads`): place and attitude there are
  those of a free drift over h/2, velocities have half a kick of all loads. That is the Strang splitting of drift and
  kick, the kick by the midpoint rule: second order, leapfrog for a field of the position alone, exact where the field
  is zero, and what is in equilibrium stays there;
- in contact the velocity at the middle is that of the start, then, where the loads depend on it, the mean of start and
  end of a first trial (`hold_mean_loads`);
- the event-driven scheme asks for them at every state it looks at (`refresh_loads`).

None of this is in a kernel whose scene declares no field (`force_field_dispatch.if_declared`).
"""

from __future__ import annotations

from physics.kernels.flight.free_flight import drift_attitude
from physics.kernels.forces.field_loads import (
    add_held_loads,
    add_loads,
    apply_loads,
    apply_total_loads,
    field_load,
    field_state,
    kicked_state,
    principal_axes_matrix,
    subtract_loads,
)
from physics.kernels.forces.force_field_dispatch import (
    if_declared,
    soften_loads,
    total_load,
)
from physics.kernels.forces.force_field_state import ZERO
from physics.kernels.forces.resolution_limits import check_stage_resolution, note_field_rates
from physics.kernels.math.vector import as_vector, plus, times
from physics.kernels.state import layout as at

# Evaluations of the midpoint rule beyond the first, and half a turn of the velocity [rad] up to which one will do: it
# gains z⁴/2 of the energy of what turns by 2 z. Fixed point rounds gain z^(2k + 2) after k: rounding, up to z = 1/4.
MIDPOINT_ROUNDS = 13
EXPLICIT_TURN = 1.0e-4


@if_declared()
def bind_fields(params, i, scheme, body):
    """Store the fields' parameters of body i, and the step's held loads, in `body`.

    A textbook scheme (`scheme` not None) keeps its explicit loads at any step: it is there to show what they do.
    """
    for c in range(body.columns.shape[0]):
        body.columns[c] = params[i, at.PARAM_SIZE + c]
    for c in range(3):
        body.held_acceleration[c] = body.free_acceleration[c]
        body.held_torque[c] = body.torque[c]
    body.is_stiff = body.is_coarse = body.is_put_back = 0
    body.is_textbook = 0 if scheme is None else 1


@if_declared()
def set_clock(elapsed, body):
    """Set the time since the start of the call [s]."""
    body.now = body.call_start + elapsed


@if_declared()
def advance_clock(h, body):
    """Advance the time since the start of the call by [s]."""
    body.now += h


@if_declared()
def hold_loads(y, h, gyroscopic, offset_frame, body):
    """Hold the loads of the middle of a flight of length h that starts at y, now."""
    x, q, v, L = y
    half = 0.5 * h
    t = body.now + half
    q = drift_attitude(q, L, body, half, gyroscopic, offset_frame)
    x = plus(x, times(half, v))
    state = field_state(x, q, v, L, t, offset_frame, body)
    F, T = total_load(state, t, body)
    check_stage_resolution(y, (F, T), x, q, h, offset_frame, body)
    turn = note_field_rates(state, kicked_state(x, q, v, L, (F, T), h, h, offset_frame, body), h, body)
    if body.is_stiff == 1:
        apply_total_loads(
            soften_loads(add_held_loads(F, T, body), h, principal_axes_matrix(q, offset_frame, body), state, body), body
        )
        return
    for _ in range(MIDPOINT_ROUNDS):
        state = kicked_state(x, q, v, L, (F, T), half, half, offset_frame, body)
        before, (F, T) = (F, T), total_load(state, t, body)
        if body.is_textbook == 1 or not half * turn > EXPLICIT_TURN or (before[0] == F and before[1] == T):
            break
    apply_loads(F, T, body)


@if_declared()
def hold_contact_loads(y, h, gyroscopic, offset_frame, body):
    """Hold the loads of the middle of a stage in contact, with the velocities of its start.

    Where the stage is stiff, those that depend on velocities are softened as if there were no contact.
    """
    x, q, v, L = y
    half = 0.5 * h
    t = body.now + half
    q = drift_attitude(q, L, body, half, gyroscopic, offset_frame)
    x = plus(x, times(half, v))
    state = field_state(x, q, v, L, t, offset_frame, body)
    F, T = total_load(state, t, body)
    check_stage_resolution(y, (F, T), x, q, h, offset_frame, body)
    note_field_rates(state, kicked_state(x, q, v, L, (F, T), h, h, offset_frame, body), h, body)
    if body.is_stiff == 1:
        still = add_held_loads(*field_load(x, q, state.air, ZERO, t, offset_frame, body), body)
        slowed = soften_loads(
            subtract_loads(add_held_loads(F, T, body), still),
            h,
            principal_axes_matrix(q, offset_frame, body),
            state,
            body,
        )
        apply_total_loads(add_loads(still, slowed), body)
        return
    apply_loads(F, T, body)


@if_declared(False)
def hold_mean_loads(y, end, h, gyroscopic, offset_frame, body):
    """Hold the loads of the middle of a stage in contact from y to `end`; return whether they have changed.

    Contacts may have changed the motion, so stiffness is tested again. In a stiff stage the change is softened: with A'
    = A + (1 + M⁻¹ Z)⁻¹ (A(middle) - A) loads and motion agree, if the contacts push as before.
    """
    x, q, v, L = y
    half = 0.5 * h
    t = body.now + half
    q = drift_attitude(q, L, body, half, gyroscopic, offset_frame)
    x, v, L = plus(x, times(half, v)), times(0.5, plus(v, end[2])), times(0.5, plus(L, end[3]))
    state = field_state(x, q, v, L, t, offset_frame, body)
    F, T = total_load(state, t, body)
    a, torque = as_vector(body.free_acceleration), as_vector(body.torque)
    was_stiff = body.is_stiff
    note_field_rates(state, field_state(x, q, end[2], end[3], t, offset_frame, body), h, body)
    if was_stiff == 1:
        body.is_stiff = 1
    if body.is_stiff == 1:
        change = soften_loads(
            subtract_loads(add_held_loads(F, T, body), (a, torque)),
            h,
            principal_axes_matrix(q, offset_frame, body),
            state,
            body,
        )
        apply_total_loads(add_loads((a, torque), change), body)
    else:
        apply_loads(F, T, body)
    return a != as_vector(body.free_acceleration) or torque != as_vector(body.torque)


@if_declared()
def hold_softened_loads(y, h, gyroscopic, offset_frame, body):
    """Hold the loads of an implicit step over h from y, with or without contact."""
    x, q, v, L = y
    half = 0.5 * h
    t = body.now + half
    q = drift_attitude(q, L, body, half, gyroscopic, offset_frame)
    state = field_state(plus(x, times(half, v)), q, v, L, t, offset_frame, body)
    F, T = total_load(state, t, body)
    apply_total_loads(
        soften_loads(add_held_loads(F, T, body), h, principal_axes_matrix(q, offset_frame, body), state, body), body
    )


@if_declared()
def refresh_loads(y, later, offset_frame, body):
    """Let the loads at the state y act, `later` [s] than now."""
    x, q, v, L = y
    F, T = field_load(x, q, v, L, body.now + later, offset_frame, body)
    apply_loads(F, T, body)
    if F != ZERO or T != ZERO or as_vector(body.held_torque) != ZERO:
        body.is_felt = 1


@if_declared(False)
def has_fields(body):
    """True if the scene declares a field."""
    return True


@if_declared(0.0)
def time_now(body):
    """Present time [s]."""
    return body.now


@if_declared(0.0)
def reset_felt_flag(body):
    """Clear the flag of `has_felt_field`; return the present time [s]."""
    body.is_felt = 0
    return body.now


@if_declared()
def set_now(t, body):
    """Set the present time [s]."""
    body.now = t


@if_declared(True)
def has_felt_field(body):
    """True if a field, or a held torque, was nonzero anywhere since `reset_felt_flag`."""
    return body.is_felt == 1
