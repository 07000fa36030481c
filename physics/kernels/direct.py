"""Contacts that all hold: the impulse of a patch without a single sweep.

When every contact keeps the velocity asked of it (nothing slides, nothing lifts off) the twist after the solve
is known before the impulses are. Of the impulses that produce it the one of least norm is the bolt-group
formula: with n contact points at r_i, centroid r̄, d_i = r_i - r̄ and second moment K = Σ (|d_i|² 1 - d_i d_iᵀ),

    p_i = F / n + (K⁻¹ T) x d_i,

F the total impulse and T its moment about the centroid. If each p_i lies in its friction cone this solves the
contact problem exactly; a body at rest gets velocity zero, to the last bit, and a symmetric patch symmetric
impulses. It needs three points that are not on a line; otherwise, or outside a cone, the sweeps take over.
"""

from __future__ import annotations

import math

from physics.kernels import quaternion as qt
from physics.kernels.compiler import inlined, kernel
from physics.kernels.layout import NORMAL, TANGENT_1, TANGENT_2

# det K / tr(K)³ of a patch is (1 - s) s / 8 for a rectangle, s the smaller share of its second moment. Below
# 1e-6 (edges 1 : 350) the patch counts as a line and is left to the sweeps.
LINE_LIMIT = 1.0e-6

# The contact velocities asked for must be those of one rigid twist, to this share of the largest of them
# (rounding of a least-squares fit over a patch that is not a line).
RIGID_LIMIT = 1.0e-11


@inlined
def solve_symmetric(k, b):
    """x of K x = b for K = (k11, k12, k13, k22, k23, k33), by cofactors; and det K."""
    k11, k12, k13, k22, k23, k33 = k
    c11 = k22 * k33 - k23 * k23
    c12 = k13 * k23 - k12 * k33
    c13 = k12 * k23 - k13 * k22
    c22 = k11 * k33 - k13 * k13
    c23 = k12 * k13 - k11 * k23
    c33 = k11 * k22 - k12 * k12
    s = 1.0 / (k11 * c11 + k12 * c12 + k13 * c13)
    return (
        (c11 * b[0] + c12 * b[1] + c13 * b[2]) * s,
        (c12 * b[0] + c22 * b[1] + c23 * b[2]) * s,
        (c13 * b[0] + c23 * b[1] + c33 * b[2]) * s,
    )


@inlined
def _patch(n, arm):
    """Centroid of the contact points and their second moment about it."""
    cx = cy = cz = 0.0
    for i in range(n):
        cx += arm[i, 0]
        cy += arm[i, 1]
        cz += arm[i, 2]
    cx /= n
    cy /= n
    cz /= n
    xx = xy = xz = yy = yz = zz = 0.0
    for i in range(n):
        x, y, z = arm[i, 0] - cx, arm[i, 1] - cy, arm[i, 2] - cz
        xx += x * x
        xy += x * y
        xz += x * z
        yy += y * y
        yz += y * z
        zz += z * z
    return (cx, cy, cz), (yy + zz, -xy, -xz, xx + zz, -yz, xx + yy)


@inlined
def _is_line(k):
    det = (
        k[0] * (k[3] * k[5] - k[4] * k[4])
        - k[1] * (k[1] * k[5] - k[4] * k[2])
        + k[2] * (k[1] * k[4] - k[3] * k[2])
    )
    return not det > LINE_LIMIT * (k[0] + k[3] + k[5]) ** 3


@inlined
def _rigid_twist(n, work, centroid, k):
    """Least-squares twist (v about the centre of mass, ω) of the target velocities; found, or not rigid."""
    walls, features = work.walls, work.features
    arm, target, slot = work.arm, work.target, work.slot
    largest = 0.0
    for i in range(n):
        for c in range(3):
            largest = max(largest, abs(target[i, c]))
    zero = (0.0, 0.0, 0.0)
    if largest == 0.0:
        return True, zero, zero
    sx = sy = sz = 0.0
    tx = ty = tz = 0.0
    for i in range(n):
        t = _world_target(i, walls, slot[i] // features, target)
        d = (arm[i, 0] - centroid[0], arm[i, 1] - centroid[1], arm[i, 2] - centroid[2])
        m = qt.cross(d, t)
        sx, sy, sz = sx + t[0], sy + t[1], sz + t[2]
        tx, ty, tz = tx + m[0], ty + m[1], tz + m[2]
    w = solve_symmetric(k, (tx, ty, tz))
    vc = (sx / n, sy / n, sz / n)
    for i in range(n):
        t = _world_target(i, walls, slot[i] // features, target)
        d = (arm[i, 0] - centroid[0], arm[i, 1] - centroid[1], arm[i, 2] - centroid[2])
        m = qt.cross(w, d)
        miss = max(abs(vc[0] + m[0] - t[0]), abs(vc[1] + m[1] - t[1]), abs(vc[2] + m[2] - t[2]))
        if not miss <= RIGID_LIMIT * largest:
            return False, zero, zero
    m = qt.cross(w, centroid)
    return True, (vc[0] - m[0], vc[1] - m[1], vc[2] - m[2]), w


@inlined
def _world_target(i, walls, wall, target):
    """Target velocity of contact i in the world frame."""
    n, a, b = target[i, 0], target[i, 1], target[i, 2]
    return (
        n * walls[wall, NORMAL] + a * walls[wall, TANGENT_1] + b * walls[wall, TANGENT_2],
        n * walls[wall, NORMAL + 1] + a * walls[wall, TANGENT_1 + 1] + b * walls[wall, TANGENT_2 + 1],
        n * walls[wall, NORMAL + 2] + a * walls[wall, TANGENT_1 + 2] + b * walls[wall, TANGENT_2 + 2],
    )


@kernel
def hold_all(n, R, v, L, work):
    """Try the impulses with which all n contacts take their target velocity.

    Parameters
    ----------
    n : int
        Contacts in `work` (arm, target and slot are read; impulse is written when it succeeds).
    R : tuple of 9 floats
        Principal frame to world.
    v, L : tuple of 3 floats
        Velocity [m/s] and angular momentum [kg m²/s] without contact impulses, world frame.

    Returns
    -------
    found : bool
        False: some contact would have to pull or to slide, or the points are on a line. Nothing was written.
    v, L : tuple of 3 floats
        With the contact impulses, when found.
    """
    walls, features, mass, J, friction = work.walls, work.features, work.mass, work.J, work.mu
    if n < 3:
        return False, v, L
    centroid, k = _patch(n, work.arm)
    if _is_line(k):
        return False, v, L
    rigid, v1, w1 = _rigid_twist(n, work, centroid, k)
    if not rigid:
        return False, v, L
    wb = qt.transposed_matvec(R, w1)
    L1 = qt.matvec(R, (wb[0] / J[0], wb[1] / J[1], wb[2] / J[2]))
    F = (mass * (v1[0] - v[0]), mass * (v1[1] - v[1]), mass * (v1[2] - v[2]))
    m = qt.cross(centroid, F)
    a = solve_symmetric(k, (L1[0] - L[0] - m[0], L1[1] - L[1] - m[1], L1[2] - L[2] - m[2]))
    for i in range(n):
        d = (work.arm[i, 0] - centroid[0], work.arm[i, 1] - centroid[1], work.arm[i, 2] - centroid[2])
        s = qt.cross(a, d)
        p = (F[0] / n + s[0], F[1] / n + s[1], F[2] / n + s[2])
        wall = work.slot[i] // features
        pn = p[0] * walls[wall, NORMAL] + p[1] * walls[wall, NORMAL + 1] + p[2] * walls[wall, NORMAL + 2]
        if not pn >= 0.0:
            return False, v, L
        pa = (
            p[0] * walls[wall, TANGENT_1]
            + p[1] * walls[wall, TANGENT_1 + 1]
            + p[2] * walls[wall, TANGENT_1 + 2]
        )
        pb = (
            p[0] * walls[wall, TANGENT_2]
            + p[1] * walls[wall, TANGENT_2 + 1]
            + p[2] * walls[wall, TANGENT_2 + 2]
        )
        if not math.sqrt(pa * pa + pb * pb) <= friction * pn:
            return False, v, L
        work.impulse[3 * i] = pn
        work.impulse[3 * i + 1] = pa
        work.impulse[3 * i + 2] = pb
    return True, v1, L1
