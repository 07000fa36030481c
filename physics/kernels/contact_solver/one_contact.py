"""Solve the contact problem of a single contact, in the frame (n, a, b) of its wall: normal and two tangents.

In this frame a contact has the coordinates (c, a, b) relative to the centre of mass. The angular rows r x n, r x a,
r x b of its Jacobian are (0, b, -a), (-b, 0, c), (a, -c, 0). So a 3 x 3 block of W = J M⁻¹ Jᵀ consists of a few
products with K, the inverse inertia in this frame.

A single contact opens, sticks (a 3 x 3 solve, with the impulse in the friction cone), or slides. A sliding contact has
the impulse p_n (1, -μ d), with the direction d of its sliding. p_n = -b_n / (W_nn - μ W_nt·d) stops the approach. The
unknown is the angle of d, for which the velocity across, g = e·u_t with e = n x d, vanishes. Newton's method finds it.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from physics.compiler.decorators import inlined
from physics.compiler.simd import lane_sqrt
from physics.kernels.contact_solver.impulse_distribution import solve_symmetric
from physics.kernels.math import quaternion as qt

# Largest number of Newton steps on an angle: three are usual at a tolerance of 1e-6.
_ANGLE_NEWTON_STEPS = 10

# Largest turn of one Newton step [rad].
_MAX_ANGLE_STEP = 1.0

# A warm start belongs to other loads if its normal impulses differ by more than this share from those needed now.
_WARM_START_TOLERANCE = 0.1

# A vector with a squared length up to this has no direction: 1/square would overflow below 6e-309.
MIN_SQUARED_NORM = 1.0e-290

# Results for a contact: Newton's method failed, or the contact opens, sticks or slides.
CONTACT_UNSOLVED, CONTACT_OPENS, CONTACT_STICKS, CONTACT_SLIDES = range(4)


class FreeBody(NamedTuple):
    """Motion and inertia of a body without contact impulses, in the stretched frame (n, a, b) of a wall.

    The frame is that of `anisotropic_friction`; with a single friction coefficient it is the frame of the wall.

    Attributes
    ----------
    axes : tuple of 3 tuples of 3 floats
        Normal and tangents of the wall, world frame, not stretched.
    u : tuple of 3 floats
        Velocity of the centre of mass [m/s].
    w : tuple of 3 floats
        Angular velocity [rad/s].
    K : tuple of 6 floats
        Inverse inertia (00, 01, 02, 11, 12, 22) [1/(kg m²)].
    inv_mass : float
        Inverse mass [1/kg]; along tangent b it is this times the square of `friction_ratio`.
    """

    axes: tuple
    u: tuple
    w: tuple
    K: tuple
    inv_mass: float


@inlined
def motion_in_wall_frame(R, v, L, axes, J):
    """Inverse inertia (00, 01, 02, 11, 12, 22), velocity and angular velocity of a body in the frame of a wall.

    R is the matrix of the principal frame, J the inverse moments; v and L are velocity and angular momentum, world
    frame. `axes` are the wall's normal and tangents.
    """
    e0, e1 = qt.transposed_matvec(R, axes[0]), qt.transposed_matvec(R, axes[1])
    e2 = qt.transposed_matvec(R, axes[2])
    j0 = (J[0] * e0[0], J[1] * e0[1], J[2] * e0[2])
    j1 = (J[0] * e1[0], J[1] * e1[1], J[2] * e1[2])
    j2 = (J[0] * e2[0], J[1] * e2[1], J[2] * e2[2])
    K = (qt.dot(j0, e0), qt.dot(j0, e1), qt.dot(j0, e2), qt.dot(j1, e1), qt.dot(j1, e2), qt.dot(j2, e2))
    m = qt.transposed_matvec(R, L)
    u = (qt.dot(axes[0], v), qt.dot(axes[1], v), qt.dot(axes[2], v))
    return K, u, (qt.dot(j0, m), qt.dot(j1, m), qt.dot(j2, m))


@inlined
def wall_to_world(axes, a, b, c, base):
    """Add a vector with the components (a, b, c) along three axes to the world vector `base`.

    The result is base + a axes[0] + b axes[1] + c axes[2]; `axes` are a wall's normal and tangents, world frame.
    """
    n, t1, t2 = axes
    return (
        base[0] + (a * n[0] + b * t1[0] + c * t2[0]),
        base[1] + (a * n[1] + b * t1[1] + c * t2[1]),
        base[2] + (a * n[2] + b * t1[2] + c * t2[2]),
    )


@inlined
def point_velocity(r, u, w):
    """Velocity u + ω x r of the point r of a body with velocity u and angular velocity w = ω, all in one frame."""
    m = qt.cross(w, r)
    return u[0] + m[0], u[1] + m[1], u[2] + m[2]


@inlined
def delassus_block(r, s, inv_mass, ratio, K):
    """Delassus block of two contacts at r and s: velocity at r per impulse at s, nine numbers row by row [1/kg].

    K is the inverse inertia in the wall's frame, `ratio` the `friction_ratio` of `anisotropic_friction`.
    """
    c, a, b = s
    n0, n1, n2 = b * K[1] - a * K[2], b * K[3] - a * K[4], b * K[4] - a * K[5]
    s0, s1, s2 = c * K[2] - b * K[0], c * K[4] - b * K[1], c * K[5] - b * K[2]
    t0, t1, t2 = a * K[0] - c * K[1], a * K[1] - c * K[3], a * K[2] - c * K[4]
    c, a, b = r
    return (
        inv_mass + (b * n1 - a * n2), b * s1 - a * s2, b * t1 - a * t2,
        c * n2 - b * n0, inv_mass + (c * s2 - b * s0), c * t2 - b * t0,
        a * n0 - c * n1, a * s0 - c * s1, ratio * ratio * inv_mass + (a * t0 - c * t1),
    )  # fmt: skip


@inlined
def diagonal_delassus_block(r, inv_mass, ratio, K):
    """Delassus block of the contact at r with itself, symmetric, nine numbers row by row [1/kg]: its mobility.

    K is the inverse inertia in the wall's frame, `ratio` the `friction_ratio` of `anisotropic_friction`.
    """
    c, a, b = r
    n1, n2 = b * K[3] - a * K[4], b * K[4] - a * K[5]
    s0, s1, s2 = c * K[2] - b * K[0], c * K[4] - b * K[1], c * K[5] - b * K[2]
    t0, t1, t2 = a * K[0] - c * K[1], a * K[1] - c * K[3], a * K[2] - c * K[4]
    na, nb, ab = b * s1 - a * s2, b * t1 - a * t2, c * t2 - b * t0
    return (
        inv_mass + (b * n1 - a * n2), na, nb,
        na, inv_mass + (c * s2 - b * s0), ab,
        nb, ab, ratio * ratio * inv_mass + (a * t0 - c * t1),
    )  # fmt: skip


@inlined
def inverse_root(square):
    """Inverse square root 1/√x of a number or of lanes, x = `square`, as √x · (1/x).

    Root and quotient are computed at the same time, so the result is ready earlier.
    """
    return lane_sqrt(square) * (1.0 / square)


@inlined
def is_warm_start_valid(push, needed):
    """True if a warm start fits the present loads, so that its friction can be used.

    `push` is the sum of its normal impulses, and `needed` that under the present loads, in the same unit.
    """
    return abs(push - needed) <= _WARM_START_TOLERANCE * abs(needed)


@inlined
def friction_direction(x, y, mu):
    """Friction per normal impulse of a contact that slides along (x, y): -μ times the unit vector, 0 if x = y = 0."""
    square = x * x + y * y
    if not square > MIN_SQUARED_NORM:
        return 0.0, 0.0
    s = -mu * inverse_root(square)
    return s * x, s * y


@inlined
def rotate_direction(x, y, angle):
    """Turn the vector (x, y) by about `angle` [rad], by less than π/2 and with its length kept."""
    t = min(_MAX_ANGLE_STEP, max(-_MAX_ANGLE_STEP, angle))
    s = inverse_root(1.0 + t * t)
    return s * (x - t * y), s * (y + t * x)


@inlined
def sliding_residual(across, along, weight):
    """Residual of a sliding contact [m/s], from its velocities across and along its assumed direction of sliding.

    `weight` is μ p_n trace(W_tt) [m/s]. The residual is infinite if the contact moves backwards.
    """
    if not weight > 0.0:
        return 0.0
    if not along > 0.0:
        return math.inf
    return abs(across) * weight / (weight + along)


@inlined
def solve_contact_block(W, b, mu, trace, goal, x, y, may_hold):
    """Solve the contact problem of one contact, u = W p + b with Coulomb's law.

    Parameters
    ----------
    W : tuple of 9 floats
        Delassus block of the contact, symmetric, row by row [1/kg].
    b : tuple of 3 floats
        Velocity without its impulse, less the target: (normal, tangents) [m/s].
    mu : float
        Coefficient of friction.
    trace : float
        W_aa + W_bb of the contact's own block [1/kg], by which the residual is measured. `W` may be smaller, if other
        contacts respond to this one.
    goal : float
        Tolerance of the residual [m/s].
    x, y : float
        First guess of -μ d, with the direction d of sliding; (0, 0) if there is none.
    may_hold : bool
        False if the contact is not to stick; then W may be singular.

    Returns
    -------
    what : int
        CONTACT_OPENS, CONTACT_STICKS, CONTACT_SLIDES, or CONTACT_UNSOLVED if Newton's method failed.
    p : tuple of 3 floats
        Impulse (normal, tangents) [N s].
    residual : float
        Residual [m/s].
    """
    if b[0] >= 0.0:
        return CONTACT_OPENS, (0.0, 0.0, 0.0), 0.0
    if mu > 0.0:
        p = solve_symmetric((W[0], W[1], W[2], W[4], W[5], W[8]), (-b[0], -b[1], -b[2]))
        if may_hold and p[0] >= 0.0 and p[1] * p[1] + p[2] * p[2] <= (mu * p[0]) * (mu * p[0]):
            return CONTACT_STICKS, p, 0.0
        if x == 0.0 and y == 0.0:
            x, y = friction_direction(-p[1], -p[2], mu)
    for _ in range(_ANGLE_NEWTON_STEPS):
        along = W[0] + (W[1] * x + W[2] * y)
        pn = -b[0] / along
        gx, gy = W[3] + (W[4] * x + W[5] * y), W[6] + (W[7] * x + W[8] * y)
        ux, uy = b[1] + pn * gx, b[2] + pn * gy
        if not along > 0.0:
            break
        if not mu > 0.0:
            return CONTACT_SLIDES, (pn, 0.0, 0.0), 0.0
        s = 1.0 / mu
        forward, across = -s * (x * ux + y * uy), s * (y * ux - x * uy)
        miss = sliding_residual(across, forward, mu * pn * trace)
        if miss <= goal:
            return CONTACT_SLIDES, (pn, pn * x, pn * y), miss
        # Turning by dα changes (x, y) by (-y, x) dα, p_n by `change`.
        change = -pn * (W[2] * x - W[1] * y) / along
        ex, ey = W[5] * x - W[4] * y, W[8] * x - W[7] * y
        slope = -forward + s * (y * (change * gx + pn * ex) - x * (change * gy + pn * ey))
        turn = -across / slope
        if not slope < 0.0:
            turn = math.copysign(_MAX_ANGLE_STEP, across)
        x, y = rotate_direction(x, y, turn)
    return CONTACT_UNSOLVED, (0.0, 0.0, 0.0), 0.0
