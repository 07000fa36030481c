"""Textbook integrators of the rigid state Y = (x, q, P, L), one signature for all of them.

    scheme(y, load, inertia, h) -> y,    y = (x, q, v, L)

The ordinary differential equation is the one of the course notes [1]_:

    x' = v,   v' = force / M + g,   q' = 1/2 q ω_body,   L' = torque,
    ω_body = J Rᵀ(q) L,   J = diag(1/I1, 1/I2, 1/I3)

with v = P/M instead of P, so that a body of infinite mass is `inv_mass` = 0.
Force and torque are held over the step, in the world frame. Then v and L are
linear in time, every scheme below has them exactly, and a scheme differs from
another only in x and in the attitude.

The flow keeps |q| = 1, a scheme does not: each step ends with q / |q|. The
`*_attitude` kernels are the same steps without it, and ω is that of R(q/|q|)
in every stage, so the right-hand side is smooth off the unit sphere and the
division costs no order. `matrix_explicit_euler` and `matrix_rk4` integrate
R' = [ω]x R instead and correct nothing: nine numbers drift where four could.

Every scheme takes the state y = (x, q, v, L), or (x, R, v, L), a `Load` (force, torque, g), an `Inertia` (inv_mass, J)
and the step h (all tuples hold floats, all scalars are floats):

==========  ==========  ======================================================
x, v        3 scalars   centre of mass [m], its velocity [m/s], world frame
q           4 scalars   unit quaternion (w, x, y, z), body to world; the body
                        frame is the principal frame of the inertia tensor
R           9 scalars   rotation matrix, body to world, row by row
L           3 scalars   angular momentum about the centre of mass [kg m²/s], world
force       3 scalars   [N], world frame, held over the step
torque      3 scalars   [N m] about the centre of mass, world frame, held
g           3 scalars   acceleration of gravity [m/s²], world frame, whatever the mass
inv_mass    scalar      1/M [1/kg]; 0: `force` does not move it
J           3 scalars   inverse principal moments [1/(kg m²)]; 0: does not turn
h           scalar      step [s]
==========  ==========  ======================================================

References
----------
.. [1] Witkin and Baraff, *Physically Based Modeling: Principles and Practice*,
   SIGGRAPH course notes, 1997: "Differential Equation Basics", sections 2-3
   (Euler, midpoint, Runge-Kutta); "Rigid Body Simulation I", sections 2-4.
.. [2] Hairer, Nørsett and Wanner, *Solving Ordinary Differential Equations I*,
   2nd ed., 1993, section II.1, table 1.2 (the classical fourth-order method).
.. [3] Hairer, Lubich and Wanner, *Geometric Numerical Integration*, 2nd ed.,
   2006, section I.1.2 (symplectic Euler), section IV.4 (projection keeps the order).
"""

from __future__ import annotations

import math
from typing import NamedTuple

from physics.compiler.decorators import kernel
from physics.kernels.math.quaternion import cross, matvec, multiply, normalise, to_matrix, transposed_matvec

# Codes of the schemes for `step` and `integrate`. 0 is reserved for the exact flow (`free_flight.fly`).
EXPLICIT_EULER = 1
SEMI_IMPLICIT_EULER = 2
MIDPOINT = 3
RK4 = 4


class Load(NamedTuple):
    """Force, torque and gravity on a body, constant over a step."""

    force: tuple  # 3 scalars [N], world frame
    torque: tuple  # 3 scalars, about the centre of mass [N m], world frame
    gravity: tuple  # 3 scalars, acceleration whatever the mass [m/s²], world frame


class Inertia(NamedTuple):
    """Inverse mass and inverse principal moments of a body."""

    inv_mass: float  # 1/M [1/kg]; 0: no force moves it
    J: tuple  # 3 scalars, inverse principal moments [1/(kg m²)]; 0: does not turn


@kernel
def _along3(a, h, rate):
    """Tuple a + h rate of 3 scalars: a after the time h at a constant rate."""
    return (a[0] + h * rate[0], a[1] + h * rate[1], a[2] + h * rate[2])


@kernel
def _along4(a, h, rate):
    """Tuple a + h rate of 4 scalars: a after the time h at a constant rate."""
    return (a[0] + h * rate[0], a[1] + h * rate[1], a[2] + h * rate[2], a[3] + h * rate[3])


@kernel
def _along9(a, h, rate):
    """Tuple a + h rate of 9 scalars: a after the time h at a constant rate."""
    return (
        a[0] + h * rate[0], a[1] + h * rate[1], a[2] + h * rate[2],
        a[3] + h * rate[3], a[4] + h * rate[4], a[5] + h * rate[5],
        a[6] + h * rate[6], a[7] + h * rate[7], a[8] + h * rate[8],
    )  # fmt: skip


@kernel
def acceleration(load, inertia):
    """Acceleration of the centre of mass, force / M + g [m/s²], world frame."""
    return _along3(load.gravity, inertia.inv_mass, load.force)


@kernel
def angvel_body(q, L, J):
    """Angular velocity J Rᵀ(q/|q|) L [rad/s], body frame, for a quaternion q of any length except zero."""
    body = transposed_matvec(to_matrix(normalise(q)), L)
    return (J[0] * body[0], J[1] * body[1], J[2] * body[2])


@kernel
def quaternion_rate(q, L, J):
    """Rate of the quaternion of a body with angular momentum L, q' = 1/2 q ω_body [1/s]."""
    omega = angvel_body(q, L, J)
    return multiply(q, (0.0, 0.5 * omega[0], 0.5 * omega[1], 0.5 * omega[2]))


@kernel
def matrix_rate(R, L, J):
    """Rate of the rotation matrix of a body with angular momentum L, R' = [ω]x R [1/s], with ω = R J Rᵀ L.

    R and the result are nine scalars, row by row. Each column of R' is ω x (column of R).
    """
    body = transposed_matvec(R, L)
    omega = matvec(R, (J[0] * body[0], J[1] * body[1], J[2] * body[2]))
    a = cross(omega, (R[0], R[3], R[6]))
    b = cross(omega, (R[1], R[4], R[7]))
    c = cross(omega, (R[2], R[5], R[8]))
    return (a[0], b[0], c[0], a[1], b[1], c[1], a[2], b[2], c[2])


@kernel
def euler_attitude(q, L, J, h):
    """Attitude by an explicit Euler step, q + h q'(q, L), not normalised: |q| grows by sqrt(1 + (h|ω|/2)²) a step."""
    return _along4(q, h, quaternion_rate(q, L, J))


@kernel
def midpoint_attitude(q, L, torque, J, h):
    """Attitude by a step h of the explicit midpoint rule under a constant torque, as a quaternion, not normalised."""
    half = 0.5 * h
    middle = _along4(q, half, quaternion_rate(q, L, J))
    return _along4(q, h, quaternion_rate(middle, _along3(L, half, torque), J))


@kernel
def rk4_attitude(q, L, torque, J, h):
    """Attitude by a step h of the classical Runge-Kutta method at constant torque, as a quaternion, not normalised."""
    half = 0.5 * h
    L_middle = _along3(L, half, torque)
    k1 = quaternion_rate(q, L, J)
    k2 = quaternion_rate(_along4(q, half, k1), L_middle, J)
    k3 = quaternion_rate(_along4(q, half, k2), L_middle, J)
    k4 = quaternion_rate(_along4(q, h, k3), _along3(L, h, torque), J)
    mean = _along4(_along4(k1, 2.0, k2), 1.0, _along4(k4, 2.0, k3))
    return _along4(q, h / 6.0, mean)


@kernel
def parabola(x, v, a, h):
    """Position x + h (v + h a / 2) after the time h at the constant acceleration a.

    Any scheme of order 2 or more gives this result for a constant acceleration.
    """
    return _along3(x, h, _along3(v, 0.5 * h, a))


@kernel
def explicit_euler(y, load, inertia, h):
    """Advance the state y by a step h of explicit Euler: every rate is taken at the start of the step. Order 1.

    y = (x, q, v, L) and the result have the form of the module docstring; `load` is a `Load`, `inertia` an `Inertia`.
    Under a constant acceleration a, x_n = x_0 + n h v_0 + n (n - 1) h² a / 2.
    """
    x, q, v, L = y
    return (
        _along3(x, h, v),
        normalise(euler_attitude(q, L, inertia.J, h)),
        _along3(v, h, acceleration(load, inertia)),
        _along3(L, h, load.torque),
    )


@kernel
def semi_implicit_euler(y, load, inertia, h):
    """Advance the state y by a step h of semi-implicit (symplectic) Euler. Order 1.

    Velocity and angular momentum are advanced first; position and attitude then move with the new ones.

    y = (x, q, v, L) and the result have the form of the module docstring; `load` is a `Load`, `inertia` an `Inertia`.
    Under a constant acceleration a, x_n = x_0 + n h v_0 + n (n + 1) h² a / 2.
    """
    x, q, v, L = y
    v_new = _along3(v, h, acceleration(load, inertia))
    L_new = _along3(L, h, load.torque)
    return (_along3(x, h, v_new), normalise(euler_attitude(q, L_new, inertia.J, h)), v_new, L_new)


@kernel
def midpoint(y, load, inertia, h):
    """Advance the state y by a step h of the explicit midpoint rule. Order 2.

    The rates of the whole step are those after half an Euler step.

    y = (x, q, v, L) and the result have the form of the module docstring; `load` is a `Load`, `inertia` an `Inertia`.
    Under a constant acceleration x is exact.
    """
    x, q, v, L = y
    a = acceleration(load, inertia)
    return (
        parabola(x, v, a, h),
        normalise(midpoint_attitude(q, L, load.torque, inertia.J, h)),
        _along3(v, h, a),
        _along3(L, h, load.torque),
    )


@kernel
def rk4(y, load, inertia, h):
    """Advance the state y by a step h of the classical Runge-Kutta method ([2]_ of the module docstring). Order 4.

    y = (x, q, v, L) and the result have the form of the module docstring; `load` is a `Load`, `inertia` an `Inertia`.
    Under a constant acceleration a, x is exact: (v + 4 (v + h a/2) + (v + h a)) h / 6 = h v + h² a / 2.
    """
    x, q, v, L = y
    a = acceleration(load, inertia)
    return (
        parabola(x, v, a, h),
        normalise(rk4_attitude(q, L, load.torque, inertia.J, h)),
        _along3(v, h, a),
        _along3(L, h, load.torque),
    )


@kernel
def matrix_explicit_euler(y, load, inertia, h):
    """Advance (x, R, v, L) by a step of explicit Euler on R' = [ω]x R, never re-orthonormalised. Order 1.

    Returns (x, R, v, L), R as nine scalars. About a fixed ω the two columns
    across it grow by sqrt(1 + (h|ω|)²) a step; a quaternion's length only grows by
    sqrt(1 + (h|ω|/2)²), and a division removes that error.
    """
    x, R, v, L = y
    return (
        _along3(x, h, v),
        _along9(R, h, matrix_rate(R, L, inertia.J)),
        _along3(v, h, acceleration(load, inertia)),
        _along3(L, h, load.torque),
    )


@kernel
def matrix_rk4(y, load, inertia, h):
    """Advance (x, R, v, L) by a step of classical Runge-Kutta on R' = [ω]x R, never re-orthonormalised. Order 4.

    Returns (x, R, v, L), R as nine scalars. About a fixed ω, with y = h|ω|, the
    two columns across it shrink by sqrt(1 - y⁶/72 + y⁸/576) a step (the modulus
    of the stability polynomial at iy). A quaternion's length shrinks by the same
    formula with y/2, 64 times less.
    """
    x, R, v, L = y
    half = 0.5 * h
    a = acceleration(load, inertia)
    L_middle = _along3(L, half, load.torque)
    L_new = _along3(L, h, load.torque)
    k1 = matrix_rate(R, L, inertia.J)
    k2 = matrix_rate(_along9(R, half, k1), L_middle, inertia.J)
    k3 = matrix_rate(_along9(R, half, k2), L_middle, inertia.J)
    k4 = matrix_rate(_along9(R, h, k3), L_new, inertia.J)
    mean = _along9(_along9(k1, 2.0, k2), 1.0, _along9(k4, 2.0, k3))
    return (parabola(x, v, a, h), _along9(R, h / 6.0, mean), _along3(v, h, a), L_new)


@kernel
def step(scheme, y, load, inertia, h):
    """Advance the state y by one step of the scheme with the code `scheme` (int).

    y = (x, q, v, L) and the result have the form of the module docstring; `load` is a `Load`, `inertia` an `Inertia`,
    and h the step [s]. An unknown code gives a state of NaN; callers check the code before.
    """
    if scheme == EXPLICIT_EULER:
        return explicit_euler(y, load, inertia, h)
    if scheme == SEMI_IMPLICIT_EULER:
        return semi_implicit_euler(y, load, inertia, h)
    if scheme == MIDPOINT:
        return midpoint(y, load, inertia, h)
    if scheme == RK4:
        return rk4(y, load, inertia, h)
    nan3 = (math.nan, math.nan, math.nan)
    return (nan3, (math.nan, math.nan, math.nan, math.nan), nan3, nan3)


@kernel
def integrate(scheme, y, load, inertia, h, steps):
    """State (x, q, v, L) after `steps` (int) steps of length h from y by `step`, all with the same load."""
    for _ in range(steps):
        y = step(scheme, y, load, inertia, h)
    return y
