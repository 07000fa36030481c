"""Motion of one body without contact over a time h: parabola and exact rotation, or a textbook scheme."""

from __future__ import annotations

from physics.compiler.decorators import if_given, inlined
from physics.kernels.flight import integrators
from physics.kernels.flight.free_rotation import free_rotation, isotropic_rotation
from physics.kernels.math.vector import as_vector
from physics.kernels.state.body import body_attitude, principal_attitude


@inlined
def drift_attitude(q, L, body, h, gyroscopic, offset_frame):
    """Attitude, as a quaternion, of a body that turns freely from q over the time h [s], exact to rounding.

    Its angular momentum L is constant. The switch `gyroscopic` is None if all moments of inertia are equal.
    """
    if L[0] == 0.0 and L[1] == 0.0 and L[2] == 0.0:
        return q
    if gyroscopic is None:
        return isotropic_rotation(q, L, body.J[0], h)
    principal = principal_attitude(q, body, offset_frame)
    return body_attitude(free_rotation(principal, L, as_vector(body.J), body.series, h), body, offset_frame)


@inlined
def fly(y, body, h, gyroscopic, offset_frame):
    """State (x, q, v, L) after a flight of h [s] from y under constant acceleration and torque.

    These are `body.free_acceleration` and `body.torque`. The parabola is exact. The rotation is exact, too, without
    torque. With torque it is the Strang splitting of second order: half a free rotation, the angular impulse, half a
    free rotation.
    """
    x, q, v, L = y
    a, torque = body.free_acceleration, body.torque
    half = 0.5 * h * h
    x = (
        x[0] + h * v[0] + half * a[0],
        x[1] + h * v[1] + half * a[1],
        x[2] + h * v[2] + half * a[2],
    )
    v = (v[0] + h * a[0], v[1] + h * a[1], v[2] + h * a[2])
    if torque[0] == 0.0 and torque[1] == 0.0 and torque[2] == 0.0:
        return x, drift_attitude(q, L, body, h, gyroscopic, offset_frame), v, L
    q = drift_attitude(q, L, body, 0.5 * h, gyroscopic, offset_frame)
    L = (L[0] + h * torque[0], L[1] + h * torque[1], L[2] + h * torque[2])
    return x, drift_attitude(q, L, body, 0.5 * h, gyroscopic, offset_frame), v, L


def _fly_exactly(y, h, flight, body):
    return fly(y, body, h, flight.gyroscopic, flight.offset_frame)


@if_given("flight.scheme", _fly_exactly)
def integrate_flight(y, h, flight, body):
    """State (x, q, v, L) after a flight of h [s] from y: by a textbook scheme if `flight.scheme` is on, else by `fly`.

    `flight` is a `FlightSwitches`. Its scheme is a code of `physics.kernels.flight.integrators`.
    """
    x, q, v, L = y
    q = principal_attitude(q, body, flight.offset_frame)
    zero = (0.0, 0.0, 0.0)
    load = integrators.Load(zero, as_vector(body.torque), as_vector(body.free_acceleration))
    inertia = integrators.Inertia(1.0, as_vector(body.J))
    x, q, v, L = integrators.step(flight.scheme, (x, q, v, L), load, inertia, h)
    return x, body_attitude(q, body, flight.offset_frame), v, L
