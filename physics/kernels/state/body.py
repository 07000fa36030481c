"""Read, write and check the state of a body, and fill the record of its parameters and loads for a step.

A state is y = (x, q, v, L): position of the centre of mass [m], attitude as a unit quaternion, velocity [m/s] and
angular momentum [kg m²/s], all in the world frame. `body` is the record of one body (`workspace.body_fields`).
"""

from __future__ import annotations

import math

from physics.compiler.decorators import if_given, inlined, kernel
from physics.kernels.math import quaternion as qt
from physics.kernels.math.vector import row_vector
from physics.kernels.state import layout as at
from physics.kernels.state.layout import METHOD_PIVOTING, SERIES_SIZE


def _no_gravity(world, bodies):
    return (0.0, 0.0, 0.0)


@if_given("bodies.gravity", _no_gravity)
def _gravity_of(world, bodies):
    """Gravity of a world, world frame [m/s²]; zero where the scene has none."""
    return row_vector(bodies.gravity, world, 0)


@inlined
def bind_body(world, i, shape, bodies, friction, restitution, offset_frame, body):
    """Write the parameters of the body in row i, and its loads by gravity and wrench, into the record `body`.

    The switches friction, restitution and offset_frame are None if the scene does not have them, `bodies.gravity` as
    well. offset_frame is None if the principal axes of every body are its body axes, and its geometric centre is its
    centre of mass.
    """
    inv_mass, radius = bodies.params[i, at.INV_MASS], bodies.params[i, at.RADIUS]
    gravity = _gravity_of(world, bodies)
    body.i, body.world, body.shape = i, world, shape
    body.mass, body.radius, body.slop = 1.0 / inv_mass, radius, body.relative_slop * radius
    for c in range(3):
        body.J[c] = bodies.params[i, at.INV_INERTIA + c]
        body.dims[c] = bodies.params[i, at.DIMENSIONS + c]
        body.free_acceleration[c] = gravity[c] + inv_mass * bodies.wrench[i, c]
        body.torque[c] = bodies.wrench[i, 3 + c]
    for c in range(SERIES_SIZE):
        body.series[c] = bodies.params[i, at.SERIES + c]
    body.mu = body.restitution = 0.0
    if friction is not None:
        body.mu = bodies.params[i, at.FRICTION]
    if restitution is not None:
        body.restitution = bodies.params[i, at.RESTITUTION]
    if offset_frame is not None:
        for c in range(4):
            body.principal[c] = bodies.params[i, at.PRINCIPAL + c]
        for c in range(3):
            body.center[c] = bodies.params[i, at.CENTER + c]
    a, t, J = body.free_acceleration, body.torque, body.J
    body.acceleration = math.sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2])
    turning = max(J[0], J[1], J[2]) * math.sqrt(t[0] * t[0] + t[1] * t[1] + t[2] * t[2])
    body.acceleration += radius * turning


@inlined
def read_state(state, i):
    """Read y = (x, q, v, L) from row i: position, attitude, velocity, angular momentum."""
    return (
        (state[i, at.POS], state[i, at.POS + 1], state[i, at.POS + 2]),
        (state[i, at.QUAT], state[i, at.QUAT + 1], state[i, at.QUAT + 2], state[i, at.QUAT + 3]),
        (state[i, at.LINVEL], state[i, at.LINVEL + 1], state[i, at.LINVEL + 2]),
        (state[i, at.ANGMOM], state[i, at.ANGMOM + 1], state[i, at.ANGMOM + 2]),
    )


@inlined
def write_state(state, i, y):
    """Store y = (x, q, v, L) in row i; its angular velocity is not written."""
    x, q, v, L = y
    state[i, at.POS], state[i, at.POS + 1], state[i, at.POS + 2] = x
    state[i, at.QUAT], state[i, at.QUAT + 1], state[i, at.QUAT + 2], state[i, at.QUAT + 3] = q
    state[i, at.LINVEL], state[i, at.LINVEL + 1], state[i, at.LINVEL + 2] = v
    state[i, at.ANGMOM], state[i, at.ANGMOM + 1], state[i, at.ANGMOM + 2] = L


@inlined
def is_finite(y):
    """True if all numbers of the state y are finite and at most `layout.OVERFLOW_LIMIT`, far from overflow."""
    x, q, v, L = y
    turn = (q[0] * q[0] + q[1] * q[1]) + (q[2] * q[2] + q[3] * q[3])
    return (qt.dot(x, x) + qt.dot(v, v)) + (qt.dot(L, L) + turn) <= at.OVERFLOW_LIMIT * at.OVERFLOW_LIMIT


@inlined
def are_all_finite(now):
    """True if every number of every state in `now` (bodies, STATE_SIZE) is finite."""
    return find_nonfinite_body(now) < 0


@inlined
def find_nonfinite_body(now):
    """Index of the first row of `now` (bodies, STATE_SIZE) whose state is not finite; -1 if there is none."""
    for b in range(now.shape[0]):
        if not is_finite(read_state(now, b)):
            return b
    return -1


@inlined
def has_finite_loads(body):
    """True if the acceleration that `bind_body` found for the body is at most `layout.OVERFLOW_LIMIT`, and finite."""
    return body.acceleration <= at.OVERFLOW_LIMIT


@inlined
def find_overloaded_body(bodies):
    """Index of the first of the records `bodies` without finite loads (`has_finite_loads`); -1 if there is none."""
    for b in range(bodies.shape[0]):
        if not has_finite_loads(bodies[b]):
            return b
    return -1


@inlined
def clear_report(world, report):
    """Set all numbers of a world's row of `report` (worlds, REPORT_SIZE) to zero, at the start of a call of a step."""
    for c in range(at.REPORT_SIZE):
        report[world, c] = 0.0


@inlined
def report_fault(world, b, report):
    """Count a fault of body b of a world in `report`: its loads or new state are not finite, its old state is kept."""
    report[world, at.FAULTS] += 1.0
    if report[world, at.FIRST_FAULTY] == 0.0:
        report[world, at.FIRST_FAULTY] = 1.0 + b


@inlined
def principal_attitude(q, body, offset_frame):
    """Quaternion from the principal frame to the world, from the quaternion q of the body frame.

    The two are equal where the switch `offset_frame` is None.
    """
    if offset_frame is None:
        return q
    p = body.principal
    return qt.multiply(q, (p[0], p[1], p[2], p[3]))


@inlined
def principal_matrix(q, R, body, offset_frame):
    """Rotation matrix from the principal frame to the world, from quaternion q and matrix R of the body frame.

    It is R itself where the switch `offset_frame` is None.
    """
    if offset_frame is None:
        return R
    return qt.to_matrix(principal_attitude(q, body, offset_frame))


@inlined
def body_attitude(q, body, offset_frame):
    """Quaternion from the body frame to the world, from the quaternion q of the principal frame."""
    if offset_frame is None:
        return q
    p = body.principal
    return qt.multiply(q, (p[0], -p[1], -p[2], -p[3]))


@inlined
def apply_inv_inertia(R, L, J):
    """Multiply a world vector L by the inverse inertia: ω = R diag(J) Rᵀ L; of an angular momentum ω is in [rad/s].

    R is the rotation matrix of the principal frame, J the inverse principal moments [1/(kg m²)].
    """
    m = qt.transposed_matvec(R, L)
    return qt.matvec(R, (J[0] * m[0], J[1] * m[1], J[2] * m[2]))


@kernel
def angular_velocity(q, L, body, offset_frame):
    """Angular velocity [rad/s] of a body with attitude q and angular momentum L, world frame."""
    if L[0] == 0.0 and L[1] == 0.0 and L[2] == 0.0:
        return (0.0, 0.0, 0.0)
    return apply_inv_inertia(qt.to_matrix(principal_attitude(q, body, offset_frame)), L, body.J)


@inlined
def kinetic_energy(q, v, L, body, offset_frame):
    """Kinetic energy of one body with attitude q, velocity v and angular momentum L [J]."""
    return 0.5 * (body.mass * qt.dot(v, v) + qt.dot(L, angular_velocity(q, L, body, offset_frame)))


@inlined
def report_solve(report, world, residual, sweeps, method, tolerance):
    """Add one contact solve to a world's row of `report`.

    `residual` and `tolerance` are relative to the free contact speed, `sweeps` counts iterations, and `method` is one
    of the METHOD_ codes of `layout`.
    """
    report[world, at.SOLVES] += 1.0
    report[world, at.ITERATIONS] += sweeps
    report[world, at.RESIDUAL] = max(report[world, at.RESIDUAL], residual)
    report[world, at.SOLVER] = max(report[world, at.SOLVER], float(method))
    if method == METHOD_PIVOTING:
        report[world, at.FALLBACKS] += 1.0
    if not residual <= tolerance:
        report[world, at.UNCONVERGED] += 1.0
