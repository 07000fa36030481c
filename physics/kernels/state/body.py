"""Record of one body for one step, prepared once and passed from stage to stage."""

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
    """Gravity of a world [m/s²]."""
    return row_vector(bodies.gravity, world, 0)


@inlined
def bind_body(world, i, shape, bodies, friction, restitution, offset_frame, body):
    """Write parameters of body i, and the loads held over the step, into `body`.

    gravity, friction, restitution and offset_frame are None if the scene does not have them. offset_frame is None if
    the principal axes of every body are its body axes, and its geometric centre is its centre of mass.
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
    """(x, q, v, L) of row i: position, attitude, velocity, angular momentum."""
    return (
        (state[i, at.POS], state[i, at.POS + 1], state[i, at.POS + 2]),
        (state[i, at.QUAT], state[i, at.QUAT + 1], state[i, at.QUAT + 2], state[i, at.QUAT + 3]),
        (state[i, at.LINVEL], state[i, at.LINVEL + 1], state[i, at.LINVEL + 2]),
        (state[i, at.ANGMOM], state[i, at.ANGMOM + 1], state[i, at.ANGMOM + 2]),
    )


@inlined
def write_state(state, i, y):
    """Store y = (x, q, v, L) in row i."""
    x, q, v, L = y
    state[i, at.POS], state[i, at.POS + 1], state[i, at.POS + 2] = x
    state[i, at.QUAT], state[i, at.QUAT + 1], state[i, at.QUAT + 2], state[i, at.QUAT + 3] = q
    state[i, at.LINVEL], state[i, at.LINVEL + 1], state[i, at.LINVEL + 2] = v
    state[i, at.ANGMOM], state[i, at.ANGMOM + 1], state[i, at.ANGMOM + 2] = L


@inlined
def is_finite(y):
    """True if all numbers of the state are finite, and their squares far from overflow (`layout.OVERFLOW_LIMIT`)."""
    x, q, v, L = y
    turn = (q[0] * q[0] + q[1] * q[1]) + (q[2] * q[2] + q[3] * q[3])
    return (qt.dot(x, x) + qt.dot(v, v)) + (qt.dot(L, L) + turn) <= at.OVERFLOW_LIMIT * at.OVERFLOW_LIMIT


@inlined
def are_all_finite(now):
    """True if every number of every state in `now` (bodies, STATE_SIZE) is finite."""
    return find_nonfinite_body(now) < 0


@inlined
def find_nonfinite_body(now):
    """The first body in `now` (bodies, STATE_SIZE) whose state is not finite, -1: none."""
    for b in range(now.shape[0]):
        if not is_finite(read_state(now, b)):
            return b
    return -1


@inlined
def has_finite_loads(body):
    """True if the loads found by `bind_body` are finite and far from overflow (`layout.OVERFLOW_LIMIT`)."""
    return body.acceleration <= at.OVERFLOW_LIMIT


@inlined
def find_overloaded_body(bodies):
    """Index of the first of the records `bodies` with loads too large to bear; -1 if there is none."""
    for b in range(bodies.shape[0]):
        if not has_finite_loads(bodies[b]):
            return b
    return -1


@inlined
def clear_report(world, report):
    """Clear the report of a world at the start of its steps."""
    for c in range(at.REPORT_SIZE):
        report[world, c] = 0.0


@inlined
def report_fault(world, b, report):
    """Report a fault of body b of a world, which keeps its old state."""
    report[world, at.FAULTS] += 1.0
    if report[world, at.FIRST_FAULTY] == 0.0:
        report[world, at.FIRST_FAULTY] = 1.0 + b


@inlined
def principal_attitude(q, body, offset_frame):
    """Quaternion of the principal frame, from that of the body frame (equal unless `offset_frame`)."""
    if offset_frame is None:
        return q
    p = body.principal
    return qt.multiply(q, (p[0], p[1], p[2], p[3]))


@inlined
def principal_matrix(q, R, body, offset_frame):
    """Matrix of `principal_attitude`, from the matrix R of the body frame (equal unless `offset_frame`)."""
    if offset_frame is None:
        return R
    return qt.to_matrix(principal_attitude(q, body, offset_frame))


@inlined
def body_attitude(q, body, offset_frame):
    """Quaternion of the body frame, from that of the principal frame."""
    if offset_frame is None:
        return q
    p = body.principal
    return qt.multiply(q, (p[0], -p[1], -p[2], -p[3]))


@inlined
def apply_inv_inertia(R, L, J):
    """ω = R I⁻¹ Rᵀ L, world frame [rad/s], R the principal frame in the world, J the inverse principal moments."""
    m = qt.transposed_matvec(R, L)
    return qt.matvec(R, (J[0] * m[0], J[1] * m[1], J[2] * m[2]))


@kernel
def angular_velocity(q, L, body, offset_frame):
    """`apply_inv_inertia` of a body with attitude q."""
    if L[0] == 0.0 and L[1] == 0.0 and L[2] == 0.0:
        return (0.0, 0.0, 0.0)
    return apply_inv_inertia(qt.to_matrix(principal_attitude(q, body, offset_frame)), L, body.J)


@inlined
def kinetic_energy(q, v, L, body, offset_frame):
    """Kinetic energy of one body [J]."""
    return 0.5 * (body.mass * qt.dot(v, v) + qt.dot(L, angular_velocity(q, L, body, offset_frame)))


@inlined
def report_solve(report, world, residual, sweeps, method, tolerance):
    """Add one contact solve to the world's report."""
    report[world, at.SOLVES] += 1.0
    report[world, at.ITERATIONS] += sweeps
    report[world, at.RESIDUAL] = max(report[world, at.RESIDUAL], residual)
    report[world, at.SOLVER] = max(report[world, at.SOLVER], float(method))
    if method == METHOD_PIVOTING:
        report[world, at.FALLBACKS] += 1.0
    if not residual <= tolerance:
        report[world, at.UNCONVERGED] += 1.0
