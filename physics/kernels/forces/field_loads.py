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
def field_state(x, q, v, L, t, offset_frame, work):
    """State of a body as its fields read it."""
    R = qt.to_matrix(q)
    w = angular_velocity(q, L, work, offset_frame)
    center = ZERO
    if offset_frame is not None:
        center = qt.matvec(R, as_vector(work.center))
    still = FieldState(x, v, w, R, center, ZERO, work.mass, work.shape, as_vector(work.dims))
    air = total_air(still, t, work)
    return FieldState(x, v, w, R, center, air, work.mass, work.shape, as_vector(work.dims))


@inlined
def kicked_state(x, q, v, L, loads, kick, later, offset_frame, work):
    """State for the fields, `later` [s] than now, after loads (F, T) and the held ones have acted for `kick` [s]."""
    a, torque = add_held_loads(loads[0], loads[1], work)
    return field_state(
        x, q, plus(v, times(kick, a)), plus(L, times(kick, torque)), work.now + later, offset_frame, work
    )


@inlined
def field_load(x, q, v, L, t, offset_frame, work):
    """(force, torque about the centre of mass) of all fields at a state and a time."""
    return total_load(field_state(x, q, v, L, t, offset_frame, work), t, work)


@inlined
def apply_loads(force, torque, work):
    """Let loads act beside the held ones; `work.acceleration` bounds the acceleration of any point of the body."""
    inv_mass, J = 1.0 / work.mass, work.J
    for c in range(3):
        work.free_acceleration[c] = work.held_acceleration[c] + inv_mass * force[c]
        work.torque[c] = work.held_torque[c] + torque[c]
    a, t = work.free_acceleration, work.torque
    work.acceleration = math.sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2])
    turning = max(J[0], J[1], J[2]) * math.sqrt(t[0] * t[0] + t[1] * t[1] + t[2] * t[2])
    work.acceleration += work.radius * turning


@inlined
def principal_axes_matrix(q, offset_frame, work):
    """Principal axes in the world."""
    return qt.to_matrix(principal_attitude(q, work, offset_frame))


@inlined
def add_held_loads(F, T, work):
    """Acceleration [m/s²] and torque [N m] of fields' loads plus the held ones."""
    return plus(as_vector(work.held_acceleration), times(1.0 / work.mass, F)), plus(as_vector(work.held_torque), T)


@inlined
def apply_total_loads(loads, work):
    """Let total loads act."""
    a, T = loads
    F = times(work.mass, minus(a, as_vector(work.held_acceleration)))
    apply_loads(F, minus(T, as_vector(work.held_torque)), work)


@inlined
def subtract_loads(b, a):
    """Difference of two pairs of acceleration and torque."""
    return minus(b[0], a[0]), minus(b[1], a[1])


@inlined
def add_loads(a, b):
    """Sum of two pairs of acceleration and torque."""
    return plus(a[0], b[0]), plus(a[1], b[1])


@inlined
def acting_loads(work):
    """Acceleration and torque that act."""
    return as_vector(work.free_acceleration), as_vector(work.torque)


@inlined
def load_bound(loads, work):
    """Bound of the acceleration of any point of the body under an acceleration and a torque [m/s²]."""
    a, T = loads
    J = max(work.J[0], work.J[1], work.J[2])
    return math.sqrt(qt.dot(a, a)) + work.radius * J * math.sqrt(qt.dot(T, T))
