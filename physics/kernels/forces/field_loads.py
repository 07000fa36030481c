"""Loads of all fields at a state, added to the loads that are held over the step."""

from __future__ import annotations

import math

from physics.compiler.decorators import inlined
from physics.kernels.forces.force_field_dispatch import (
    total_air,
    total_load,
)
from physics.kernels.forces.force_field_state import ZERO, FieldState
from physics.kernels.math import quaternion as qt
from physics.kernels.math.vector import as_vector, minus, plus, times
from physics.kernels.state.body import angular_velocity, principal_attitude


@inlined
def field_state(x, q, v, L, t, offset_frame, body):
    """State of a body as its fields read it."""
    R = qt.to_matrix(q)
    w = angular_velocity(q, L, body, offset_frame)
    center = ZERO
    if offset_frame is not None:
        center = qt.matvec(R, as_vector(body.center))
    still = FieldState(x, v, w, R, center, ZERO, body.mass, body.shape, as_vector(body.dims))
    air = total_air(still, t, body)
    return FieldState(x, v, w, R, center, air, body.mass, body.shape, as_vector(body.dims))


@inlined
def kicked_state(x, q, v, L, loads, kick, later, offset_frame, body):
    """State for the fields, `later` [s] than now, after loads (F, T) and the held ones have acted for `kick` [s]."""
    a, torque = add_held_loads(loads[0], loads[1], body)
    return field_state(
        x, q, plus(v, times(kick, a)), plus(L, times(kick, torque)), body.now + later, offset_frame, body
    )


@inlined
def field_load(x, q, v, L, t, offset_frame, body):
    """(force, torque about the centre of mass) of all fields at a state and a time."""
    return total_load(field_state(x, q, v, L, t, offset_frame, body), t, body)


@inlined
def apply_loads(force, torque, body):
    """Let loads act beside the held ones; `body.acceleration` bounds the acceleration of any point of the body."""
    inv_mass, J = 1.0 / body.mass, body.J
    for c in range(3):
        body.free_acceleration[c] = body.held_acceleration[c] + inv_mass * force[c]
        body.torque[c] = body.held_torque[c] + torque[c]
    a, t = body.free_acceleration, body.torque
    body.acceleration = math.sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2])
    turning = max(J[0], J[1], J[2]) * math.sqrt(t[0] * t[0] + t[1] * t[1] + t[2] * t[2])
    body.acceleration += body.radius * turning


@inlined
def principal_axes_matrix(q, offset_frame, body):
    """Principal axes in the world."""
    return qt.to_matrix(principal_attitude(q, body, offset_frame))


@inlined
def add_held_loads(F, T, body):
    """Acceleration [m/s²] and torque [N m] of fields' loads plus the held ones."""
    return plus(as_vector(body.held_acceleration), times(1.0 / body.mass, F)), plus(as_vector(body.held_torque), T)


@inlined
def apply_total_loads(loads, body):
    """Let total loads act."""
    a, T = loads
    F = times(body.mass, minus(a, as_vector(body.held_acceleration)))
    apply_loads(F, minus(T, as_vector(body.held_torque)), body)


@inlined
def subtract_loads(b, a):
    """Difference of two pairs of acceleration and torque."""
    return minus(b[0], a[0]), minus(b[1], a[1])


@inlined
def add_loads(a, b):
    """Sum of two pairs of acceleration and torque."""
    return plus(a[0], b[0]), plus(a[1], b[1])


@inlined
def acting_loads(body):
    """Acceleration and torque that act."""
    return as_vector(body.free_acceleration), as_vector(body.torque)


@inlined
def load_bound(loads, body):
    """Bound of the acceleration of any point of the body under an acceleration and a torque [m/s²]."""
    a, T = loads
    J = max(body.J[0], body.J[1], body.J[2])
    return math.sqrt(qt.dot(a, a)) + body.radius * J * math.sqrt(qt.dot(T, T))
