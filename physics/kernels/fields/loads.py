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
from physics.kernels.body import angular_velocity
from physics.kernels.compiler import inlined
from physics.kernels.fields.state import ZERO, FieldState, plus, times
from physics.kernels.fields.terms import if_declared, total_air, total_load
from physics.kernels.flight import drift


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


@if_declared()
def hold_loads(y, h, gyroscopic, tilted, work):
    """Hold the loads of the middle of a flight of length h that starts at y, now."""
    x, q, v, L = y
    half = 0.5 * h
    t = work.now + half
    q = drift(q, L, work, half, gyroscopic, tilted)
    x = plus(x, times(half, v))
    F, T = field_load(x, q, v, L, t, tilted, work)
    v = plus(v, times(half, plus(_vector(work.held_acceleration), times(1.0 / work.mass, F))))
    L = plus(L, times(half, plus(_vector(work.held_torque), T)))
    F, T = field_load(x, q, v, L, t, tilted, work)
    put_loads(F, T, work)


@if_declared()
def hold_contact_loads(y, h, gyroscopic, tilted, work):
    """Hold the loads of the middle of a stage in contact, with the velocities of its start."""
    x, q, v, L = y
    half = 0.5 * h
    q = drift(q, L, work, half, gyroscopic, tilted)
    F, T = field_load(plus(x, times(half, v)), q, v, L, work.now + half, tilted, work)
    put_loads(F, T, work)


@if_declared(False)
def hold_mean_loads(y, end, h, gyroscopic, tilted, work):
    """Hold the loads of the middle of a stage in contact from y to `end`: whether they are others than before."""
    x, q, v, L = y
    half = 0.5 * h
    q = drift(q, L, work, half, gyroscopic, tilted)
    x, v, L = plus(x, times(half, v)), times(0.5, plus(v, end[2])), times(0.5, plus(L, end[3]))
    F, T = field_load(x, q, v, L, work.now + half, tilted, work)
    a, torque = _vector(work.free_acceleration), _vector(work.torque)
    put_loads(F, T, work)
    return a != _vector(work.free_acceleration) or torque != _vector(work.torque)


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
