"""Acceleration and torque of a step with fields: loads that are held, and when fields are evaluated.

Without fields `work.free_acceleration` and `work.torque` are what gravity and the wrench make them, for the whole
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
def bind_fields(params, i, scheme, work):
    """Store the fields' parameters of body i, and the step's held loads, in `work`.

    A textbook scheme (`scheme` not None) keeps its explicit loads at any step: it is there to show what they do.
    """
    for c in range(work.columns.shape[0]):
        work.columns[c] = params[i, at.PARAM_SIZE + c]
    for c in range(3):
        work.held_acceleration[c] = work.free_acceleration[c]
        work.held_torque[c] = work.torque[c]
    work.is_stiff = work.is_coarse = work.is_put_back = 0
    work.is_textbook = 0 if scheme is None else 1


@if_declared()
def set_clock(elapsed, work):
    """Set the time since the start of the call [s]."""
    work.now = work.call_start + elapsed


@if_declared()
def advance_clock(h, work):
    """Advance the time since the start of the call by [s]."""
    work.now += h


@if_declared()
def hold_loads(y, h, gyroscopic, offset_frame, work):
    """Hold the loads of the middle of a flight of length h that starts at y, now."""
    x, q, v, L = y
    half = 0.5 * h
    t = work.now + half
    q = drift_attitude(q, L, work, half, gyroscopic, offset_frame)
    x = plus(x, times(half, v))
    state = field_state(x, q, v, L, t, offset_frame, work)
    F, T = total_load(state, t, work)
    check_stage_resolution(y, (F, T), x, q, h, offset_frame, work)
    turn = note_field_rates(state, kicked_state(x, q, v, L, (F, T), h, h, offset_frame, work), h, work)
    if work.is_stiff == 1:
        apply_total_loads(
            soften_loads(add_held_loads(F, T, work), h, principal_axes_matrix(q, offset_frame, work), state, work), work
        )
        return
    for _ in range(MIDPOINT_ROUNDS):
        state = kicked_state(x, q, v, L, (F, T), half, half, offset_frame, work)
        before, (F, T) = (F, T), total_load(state, t, work)
        if work.is_textbook == 1 or not half * turn > EXPLICIT_TURN or (before[0] == F and before[1] == T):
            break
    apply_loads(F, T, work)


@if_declared()
def hold_contact_loads(y, h, gyroscopic, offset_frame, work):
    """Hold the loads of the middle of a stage in contact, with the velocities of its start.

    Where the stage is stiff, those that depend on velocities are softened as if there were no contact.
    """
    x, q, v, L = y
    half = 0.5 * h
    t = work.now + half
    q = drift_attitude(q, L, work, half, gyroscopic, offset_frame)
    x = plus(x, times(half, v))
    state = field_state(x, q, v, L, t, offset_frame, work)
    F, T = total_load(state, t, work)
    check_stage_resolution(y, (F, T), x, q, h, offset_frame, work)
    note_field_rates(state, kicked_state(x, q, v, L, (F, T), h, h, offset_frame, work), h, work)
    if work.is_stiff == 1:
        still = add_held_loads(*field_load(x, q, state.air, ZERO, t, offset_frame, work), work)
        slowed = soften_loads(
            subtract_loads(add_held_loads(F, T, work), still),
            h,
            principal_axes_matrix(q, offset_frame, work),
            state,
            work,
        )
        apply_total_loads(add_loads(still, slowed), work)
        return
    apply_loads(F, T, work)


@if_declared(False)
def hold_mean_loads(y, end, h, gyroscopic, offset_frame, work):
    """Hold the loads of the middle of a stage in contact from y to `end`; return whether they have changed.

    Contacts may have changed the motion, so stiffness is tested again. In a stiff stage the change is softened: with A'
    = A + (1 + M⁻¹ Z)⁻¹ (A(middle) - A) loads and motion agree, if the contacts push as before.
    """
    x, q, v, L = y
    half = 0.5 * h
    t = work.now + half
    q = drift_attitude(q, L, work, half, gyroscopic, offset_frame)
    x, v, L = plus(x, times(half, v)), times(0.5, plus(v, end[2])), times(0.5, plus(L, end[3]))
    state = field_state(x, q, v, L, t, offset_frame, work)
    F, T = total_load(state, t, work)
    a, torque = as_vector(work.free_acceleration), as_vector(work.torque)
    was_stiff = work.is_stiff
    note_field_rates(state, field_state(x, q, end[2], end[3], t, offset_frame, work), h, work)
    if was_stiff == 1:
        work.is_stiff = 1
    if work.is_stiff == 1:
        change = soften_loads(
            subtract_loads(add_held_loads(F, T, work), (a, torque)),
            h,
            principal_axes_matrix(q, offset_frame, work),
            state,
            work,
        )
        apply_total_loads(add_loads((a, torque), change), work)
    else:
        apply_loads(F, T, work)
    return a != as_vector(work.free_acceleration) or torque != as_vector(work.torque)


@if_declared()
def hold_softened_loads(y, h, gyroscopic, offset_frame, work):
    """Hold the loads of an implicit step over h from y, with or without contact."""
    x, q, v, L = y
    half = 0.5 * h
    t = work.now + half
    q = drift_attitude(q, L, work, half, gyroscopic, offset_frame)
    state = field_state(plus(x, times(half, v)), q, v, L, t, offset_frame, work)
    F, T = total_load(state, t, work)
    apply_total_loads(
        soften_loads(add_held_loads(F, T, work), h, principal_axes_matrix(q, offset_frame, work), state, work), work
    )


@if_declared()
def refresh_loads(y, later, offset_frame, work):
    """Let the loads at the state y act, `later` [s] than now."""
    x, q, v, L = y
    F, T = field_load(x, q, v, L, work.now + later, offset_frame, work)
    apply_loads(F, T, work)
    if F != ZERO or T != ZERO or as_vector(work.held_torque) != ZERO:
        work.is_felt = 1


@if_declared(False)
def has_fields(work):
    """True if the scene declares a field."""
    return True


@if_declared(0.0)
def time_now(work):
    """Present time [s]."""
    return work.now


@if_declared(0.0)
def reset_felt_flag(work):
    """Clear the flag of `has_felt_field`; return the present time [s]."""
    work.is_felt = 0
    return work.now


@if_declared()
def set_now(t, work):
    """Set the present time [s]."""
    work.now = t


@if_declared(True)
def has_felt_field(work):
    """True if a field, or a held torque, was nonzero anywhere since `reset_felt_flag`."""
    return work.is_felt == 1
