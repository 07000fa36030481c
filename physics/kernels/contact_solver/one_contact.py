"""Contacts of one wall in the frame (n, a, b) of that wall, and the problem of a single contact in closed form.

In that frame a contact is its coordinates (c, a, b) relative to the centre of mass, and the rows r x n, r x a,
r x b of its Jacobian are (0, b, -a), (-b, 0, c), (a, -c, 0). A 3 x 3 block of W = J M⁻¹ Jᵀ is then a handful of
products of K, the inverse inertia in that frame.

One contact holds (3 x 3 solve, inside the cone), opens, or slides: then its impulse is p_n (1, -μ d) along the
direction d of its own sliding, p_n = -b_n / (W_nn - μ W_nt·d) stops the approach, and what is left is the angle of
d for which the velocity across, g = e·u_t with e = n x d, vanishes: Newton's method on the angle.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from physics.compiler.decorators import inlined
from physics.compiler.simd import lane_sqrt
from physics.kernels.contact_solver.impulse_distribution import solve_symmetric
from physics.kernels.math import quaternion as qt

# Newton steps on an angle at most: three are usual at a tolerance of 1e-6.
_ANGLE_NEWTON_STEPS = 10

# Largest turn of one Newton step [rad].
_MAX_ANGLE_STEP = 1.0

# A warm start is of other loads if its pushes are off by more than this share of what is needed.
_WARM_START_TOLERANCE = 0.1

# A vector whose square is no more has no direction: 1/square would overflow below 6e-309.
MIN_SQUARED_NORM = 1.0e-290

# What a contact was found to do.
CONTACT_UNSOLVED, CONTACT_OPENS, CONTACT_STICKS, CONTACT_SLIDES = range(4)


class FreeBody(NamedTuple):
    """A body without its contact impulses, in the stretched frame (n, a, b) of a wall (`anisotropic_friction`).

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
    """Inverse inertia (00, 01, 02, 11, 12, 22), velocity and angular velocity in the frame of the wall."""
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
    """base + a axes[0] + b axes[1] + c axes[2]."""
    n, t1, t2 = axes
    return (
        base[0] + (a * n[0] + b * t1[0] + c * t2[0]),
        base[1] + (a * n[1] + b * t1[1] + c * t2[1]),
        base[2] + (a * n[2] + b * t1[2] + c * t2[2]),
    )


@inlined
def point_velocity(r, u, w):
    """u + ω x r in the frame of the wall: (normal, tangents)."""
    m = qt.cross(w, r)
    return u[0] + m[0], u[1] + m[1], u[2] + m[2]


@inlined
def delassus_block(r, s, inv_mass, ratio, K):
    """W between contacts r and s: velocity at r, row by row, per impulse at s; ratio: see `anisotropic_friction`."""
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
    """`delassus_block` of a contact with itself, which is symmetric."""
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
    """1/√x of a number or of lanes; root and quotient are computed side by side, to shorten the wait for the result."""
    return lane_sqrt(square) * (1.0 / square)


@inlined
def is_warm_start_valid(push, needed):
    """True if a warm start's push is so close to the push under the present loads that its friction is valid, too."""
    return abs(push - needed) <= _WARM_START_TOLERANCE * abs(needed)


@inlined
def friction_direction(x, y, mu):
    """Vector -μ times the direction of (x, y); 0 if (x, y) has no direction."""
    square = x * x + y * y
    if not square > MIN_SQUARED_NORM:
        return 0.0, 0.0
    s = -mu * inverse_root(square)
    return s * x, s * y


@inlined
def rotate_direction(x, y, angle):
    """Vector (x, y) turned by about `angle`, with its length kept."""
    t = min(_MAX_ANGLE_STEP, max(-_MAX_ANGLE_STEP, angle))
    s = inverse_root(1.0 + t * t)
    return s * (x - t * y), s * (y + t * x)


@inlined
def sliding_residual(across, along, weight):
    """Residual of a sliding contact [m/s]: velocity across its direction, along it, μ p trace(W_tt)."""
    if not weight > 0.0:
        return 0.0
    if not along > 0.0:
        return math.inf
    return abs(across) * weight / (weight + along)


@inlined
def solve_contact_block(W, b, mu, trace, goal, x, y, may_hold):
    """Impulse of one contact that answers its free velocity b alone.

    Parameters
    ----------
    W : tuple of 9 floats
        Its block, symmetric.
    b : tuple of 3 floats
        Velocity less the target [m/s].
    trace : float
        W_aa + W_bb of the contact, which the residual is measured with: `W` may be less, when others give way.
    goal : float
        Tolerance of the residual [m/s].
    x, y : float
        First guess of -μ d; 0, 0: none.
    may_hold : bool
        False: leave out that it holds (then W may be singular).

    Returns
    -------
    what : int
        CONTACT_OPENS, CONTACT_STICKS, CONTACT_SLIDES, or CONTACT_UNSOLVED when Newton's method failed.
    p : tuple of 3 floats
        [N s].
    residual : float
        [m/s].
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
