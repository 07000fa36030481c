"""Evaluate the loads of all fields at a state of a body, and let them act together with the held loads.

*Held* loads are those of gravity and wrench, which are constant over a step. The loads that act on the body are its
`free_acceleration` and `torque`. Two forms of a load occur: (F, T), force [N] and torque [N m], and (a, T), with the
acceleration a [m/s²] instead of the force.
"""

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
    """Make the `FieldState` of a body with the state (x, q, v, L) at the time t [s]."""
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
    """Make the `FieldState` of a body whose velocities were changed by loads for the time `kick` [s].

    The pose is that of x and q. The fields' loads (F, T) and the held loads act on v and L. The fields are evaluated at
    the time `body.now` + `later` [s].
    """
    a, torque = add_held_loads(loads[0], loads[1], body)
    return field_state(
        x, q, plus(v, times(kick, a)), plus(L, times(kick, torque)), body.now + later, offset_frame, body
    )


@inlined
def field_load(x, q, v, L, t, offset_frame, body):
    """Force [N] and torque about the centre of mass [N m] of all fields together, at a state and a time t [s]."""
    return total_load(field_state(x, q, v, L, t, offset_frame, body), t, body)


@inlined
def apply_loads(force, torque, body):
    """Let a force [N] and a torque [N m] of fields act on a body, together with the held loads.

    Written are `body.free_acceleration`, `body.torque`, and `body.acceleration`, a bound of the acceleration of any
    point of the body.
    """
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
    """Rotation matrix from the principal axes of a body to the world, from its quaternion q."""
    return qt.to_matrix(principal_attitude(q, body, offset_frame))


@inlined
def add_held_loads(F, T, body):
    """Acceleration [m/s²] and torque [N m] of a force F and a torque T of fields, with the held loads added."""
    return plus(as_vector(body.held_acceleration), times(1.0 / body.mass, F)), plus(as_vector(body.held_torque), T)


@inlined
def apply_total_loads(loads, body):
    """Let the loads (a, T), which include the held loads, act on a body."""
    a, T = loads
    F = times(body.mass, minus(a, as_vector(body.held_acceleration)))
    apply_loads(F, minus(T, as_vector(body.held_torque)), body)


@inlined
def subtract_loads(b, a):
    """Difference b - a of two loads, each a pair (acceleration, torque)."""
    return minus(b[0], a[0]), minus(b[1], a[1])


@inlined
def add_loads(a, b):
    """Sum of two loads, each a pair (acceleration, torque)."""
    return plus(a[0], b[0]), plus(a[1], b[1])


@inlined
def acting_loads(body):
    """Acceleration [m/s²] and torque [N m] that act on a body now, held loads included."""
    return as_vector(body.free_acceleration), as_vector(body.torque)


@inlined
def load_bound(loads, body):
    """Upper bound of the acceleration of any point of a body under the loads (a, T) [m/s²]."""
    a, T = loads
    J = max(body.J[0], body.J[1], body.J[2])
    return math.sqrt(qt.dot(a, a)) + body.radius * J * math.sqrt(qt.dot(T, T))
