"""Set the acceleration and torque that act on a body in a stage, in scenes with force fields.

Without fields `body.free_acceleration` and `body.torque` come from gravity and wrench, and stay the same for the whole
call. With fields they are set anew for each stage:

- Time stepping holds the loads of the middle of a stage of length h, constant over the stage (`hold_loads`). The pose
  in the middle is that of a free drift over h/2, and the velocities have half a kick of all loads. This is the Strang
  splitting of drift and kick, with the midpoint rule for the kick. It is of second order, leapfrog for a field that
  depends on the position alone, and exact where the field is zero. An equilibrium stays one.
- In contact the velocity in the middle is taken as that of the start (`hold_contact_loads`). Where the loads depend on
  the velocity, the stage is made again with the mean of start and end (`hold_mean_loads`).
- The event-driven scheme sets the loads at each state that it evaluates (`refresh_loads`).

The arguments gyroscopic and offset_frame are those of `FlightSwitches`. All of this is left out of kernels whose scene
declares no field (`force_field_dispatch.if_declared`).
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

# Largest number of iterations of the midpoint rule, and half of the angle by which loads turn the velocity in a stage
# [rad], up to which one iteration suffices. Let the angle be 2 z. One iteration changes the energy by its share z⁴/2,
# k fixed-point iterations by z^(2k + 2): that is rounding, up to z = 1/4.
MIDPOINT_ROUNDS = 13
EXPLICIT_TURN = 1.0e-4


@if_declared()
def bind_fields(params, i, scheme, body):
    """Copy the fields' parameters of body i from `params`, and the loads of gravity and wrench, into its record `body`.

    A textbook scheme (`scheme` is its code, else None) uses explicit loads at any step, since it is there for
    comparison.
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
    """Set the present time of a body to `elapsed` [s] after the start of the call."""
    body.now = body.call_start + elapsed


@if_declared()
def advance_clock(h, body):
    """Advance the present time of a body by h [s]."""
    body.now += h


@if_declared()
def hold_loads(y, h, gyroscopic, offset_frame, body):
    """Let the loads of the middle of a flight act on a body over the whole flight, of length h [s] from the state y.

    Rates of the fields are noted, too. If the stage is stiff, the loads are softened (`implicit_loads`).
    """
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
    """Let the loads of the middle of a stage in contact act over the whole stage, of length h [s] from the state y.

    They are evaluated with the velocities of the start. If the stage is stiff, the part of the loads that depends on
    velocities is softened (`implicit_loads`), as if there were no contact.
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
    """Let loads at the mean velocities of a stage in contact act, after a trial of it; return whether they changed.

    The trial took the state from y to `end` in h [s]. Contacts may have changed the motion, so stiffness is tested
    again. In a stiff stage only the softened change of the loads is added: with A' = A + (1 + M⁻¹ Z)⁻¹ (A(middle) - A)
    loads and motion agree, if the contacts push as before.
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
    """Let softened loads act over a stage of h [s] from the state y: the loads at the middle of the stage."""
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
    """Let the loads at the state y and the time `body.now` + `later` [s] act; note whether any of them is nonzero."""
    x, q, v, L = y
    F, T = field_load(x, q, v, L, body.now + later, offset_frame, body)
    apply_loads(F, T, body)
    if F != ZERO or T != ZERO or as_vector(body.held_torque) != ZERO:
        body.is_felt = 1


def _start_of_clock(clock, body):
    return clock[0]


@if_declared(_start_of_clock)
def call_start(clock, body):
    """Time of the world at the start of the call [s]: of the body's fields, or `clock[0]` in scenes without fields."""
    return body.call_start


@if_declared(False)
def has_fields(body):
    """True if the scene declares a force field."""
    return True


@if_declared(0.0)
def time_now(body):
    """Present time of a body [s]; 0 in scenes without fields."""
    return body.now


@if_declared(0.0)
def reset_felt_flag(body):
    """Clear the flag that `has_felt_field` reads; return the present time of the body [s]."""
    body.is_felt = 0
    return body.now


@if_declared()
def set_now(t, body):
    """Set the present time of a body to t [s]."""
    body.now = t


@if_declared(True)
def has_felt_field(body):
    """True if a field or a held torque was nonzero in any `refresh_loads` of the body since `reset_felt_flag`."""
    return body.is_felt == 1
