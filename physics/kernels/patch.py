"""Sums over the contacts of a patch on one wall, for `slide` and `pivot`, whose docstrings have the formulas."""

from __future__ import annotations

import math

from physics.kernels.compiler import inlined
from physics.kernels.ellipse import friction_ratio
from physics.kernels.layout import NORMAL, TANGENT_1, TANGENT_2
from physics.kernels.point import point_velocity

# Second moments of a patch: below this share of det to trace² it counts as a line (edges 1 : 1000).
LINE_LIMIT = 1.0e-6

# Columns of `work.patch`, a row per contact, all in the stretched frame of `ellipse` (of an even wall: its frame):
# coordinates (normal, tangents) relative to the centre of mass, targets
# (normal, tangents), impulse per normal impulse (-μ d), sliding speed, normal impulse, W_aa + W_bb.
C, A, B, TARGET, TARGET_A, TARGET_B, X, Y, SPEED, P, MOBILITY = range(11)
PATCH_SIZE = 11


@inlined
def contact_place(i, work):
    """Coordinates (c, a, b) of contact i."""
    return work.patch[i, C], work.patch[i, A], work.patch[i, B]


@inlined
def contact_target(i, work):
    """Target velocity of contact i (normal, tangents)."""
    return work.patch[i, TARGET], work.patch[i, TARGET_A], work.patch[i, TARGET_B]


@inlined
def place_patch(n, friction, wall, u, w, inv_mass, K, work):
    """Fill `work.patch`; largest free contact speed [m/s], and the planar motion after the warm start.

    u, w, K are velocity and angular velocity without contact impulses, and inverse inertia, in the stretched frame.
    """
    walls, patch, target, impulse, arm = work.walls, work.patch, work.target, work.impulse, work.arm
    n0, n1, n2 = walls[wall, NORMAL], walls[wall, NORMAL + 1], walls[wall, NORMAL + 2]
    s0, s1, s2 = walls[wall, TANGENT_1], walls[wall, TANGENT_1 + 1], walls[wall, TANGENT_1 + 2]
    t0, t1, t2 = walls[wall, TANGENT_2], walls[wall, TANGENT_2 + 1], walls[wall, TANGENT_2 + 2]
    ratio = friction_ratio(work)
    mass_b = ratio * ratio * inv_mass
    scale = fa = fb = tn = ta = tb = 0.0
    for i in range(n):
        rx, ry, rz = arm[i, 0], arm[i, 1], arm[i, 2]
        c = ratio * (n0 * rx + n1 * ry + n2 * rz)
        a = ratio * (s0 * rx + s1 * ry + s2 * rz)
        b = t0 * rx + t1 * ry + t2 * rz
        patch[i, C], patch[i, A], patch[i, B] = c, a, b
        patch[i, TARGET], patch[i, TARGET_A], patch[i, TARGET_B] = target[i, 0], target[i, 1], ratio * target[i, 2]
        patch[i, MOBILITY] = (
            inv_mass + mass_b + K[0] * (a * a + b * b) - 2.0 * c * (K[1] * a + K[2] * b) + c * c * (K[3] + K[5])
        )
        speed = point_velocity((c, a, b), u, w)
        scale = max(scale, abs(speed[0] - target[i, 0]))
        if friction is not None:
            scale = max(scale, max(abs(speed[1] - target[i, 1]), abs(speed[2] - ratio * target[i, 2])))
            p, x, y = impulse[3 * i], impulse[3 * i + 1], impulse[3 * i + 2] / ratio
            fa += x
            fb += y
            tn += a * y - b * x
            ta += b * p - c * y
            tb += c * x - a * p
    start = (u[1] + inv_mass * fa, u[2] + mass_b * fb, w[0] + (K[0] * tn + K[1] * ta + K[2] * tb))
    return scale, start


@inlined
def fit_targets(count, work):
    """Centroid (normal, tangents) of the active contacts and the affine fit of their targets (value, slopes).

    On a line the slopes are not finite, or no longer accurate: then ok is false.
    """
    patch = work.patch
    cc = ca = cb = t0 = 0.0
    for j in range(count):
        i = work.active[j]
        cc += patch[i, C]
        ca += patch[i, A]
        cb += patch[i, B]
        t0 += patch[i, TARGET]
    s = 1.0 / count
    cc, ca, cb, t0 = s * cc, s * ca, s * cb, s * t0
    saa = sab = sbb = ta = tb = 0.0
    for j in range(count):
        i = work.active[j]
        a, b, t = patch[i, A] - ca, patch[i, B] - cb, patch[i, TARGET]
        saa += a * a
        sab += a * b
        sbb += b * b
        ta += a * t
        tb += b * t
    det, trace = saa * sbb - sab * sab, saa + sbb
    s = 1.0 / det
    ga, gb = s * (sbb * ta - sab * tb), s * (saa * tb - sab * ta)
    return det > LINE_LIMIT * trace * trace, (cc, ca, cb), (t0, ga, gb)


@inlined
def misfit(n, vn, wa, wb, work):
    """Largest violation of the normal targets [m/s] by the normal motion; an open contact may be faster."""
    patch = work.patch
    worst = 0.0
    for i in range(n):
        miss = patch[i, TARGET] - (vn + wa * patch[i, B] - wb * patch[i, A])
        if work.normal[i] >= 0.0:
            miss = abs(miss)
        worst = max(worst, miss)
    return worst


@inlined
def respond(count, mu, center, y0, gain, motion, wa, wb, K, work):
    """Directions at a planar motion, and the y_1, y_2 that go with them.

    Returns
    -------
    y : tuple of 2 floats
    turning : tuple of 6 floats
        (ω_a per y_1, y_2; ω_b per y_1, y_2; ω_n per y_1, y_2), friction along with them.
    """
    patch = work.patch
    _, ca, cb = center
    n0 = n1 = n2 = a0 = a1 = a2 = b0 = b1 = b2 = 0.0
    for j in range(count):
        i = work.active[j]
        c, a, b = patch[i, C], patch[i, A], patch[i, B]
        ua = motion[0] + wb * c - motion[2] * b - patch[i, TARGET_A]
        ub = motion[1] + motion[2] * a - wa * c - patch[i, TARGET_B]
        size = math.sqrt(ua * ua + ub * ub)
        s = 0.0
        if size > 0.0:
            s = -mu / size
        x, y = s * ua, s * ub
        patch[i, X], patch[i, Y], patch[i, SPEED] = x, y, size
        mn, ma, mb = a * y - b * x, b - c * y, c * x - a
        a -= ca
        b -= cb
        n0, n1, n2 = n0 + mn, n1 + a * mn, n2 + b * mn
        a0, a1, a2 = a0 + ma, a1 + a * ma, a2 + b * ma
        b0, b1, b2 = b0 + mb, b1 + a * mb, b2 + b * mb
    g0, h0 = K[1] * n0 + K[3] * a0 + K[4] * b0, K[2] * n0 + K[4] * a0 + K[5] * b0
    g1, g2 = K[1] * n1 + K[3] * a1 + K[4] * b1, K[1] * n2 + K[3] * a2 + K[4] * b2
    h1, h2 = K[2] * n1 + K[4] * a1 + K[5] * b1, K[2] * n2 + K[4] * a2 + K[5] * b2
    f1, f2 = K[0] * n1 + K[1] * a1 + K[2] * b1, K[0] * n2 + K[1] * a2 + K[2] * b2
    s = 1.0 / (g1 * h2 - g2 * h1)
    ra, rb = gain[0] - g0 * y0, gain[1] - h0 * y0
    return (s * (h2 * ra - g2 * rb), s * (g1 * rb - h1 * ra)), (g1, g2, h1, h2, f1, f2)


@inlined
def comply(count, center, turning, inv_mass, K, work):
    """Planar motion per planar impulse at the centroid, row by row (9): with the normal motion held by y_1, y_2.

    `turning` is that of `respond`, which only a step of Newton's has a use for this after.
    """
    patch, ratio = work.patch, friction_ratio(work)
    mass_b = ratio * ratio * inv_mass
    cc, ca, cb = center
    g1, g2, h1, h2, f1, f2 = turning
    s = 1.0 / (g1 * h2 - g2 * h1)
    x1 = x2 = y1 = y2 = 0.0
    for j in range(count):
        i = work.active[j]
        a, b, x, y = patch[i, A] - ca, patch[i, B] - cb, patch[i, X], patch[i, Y]
        x1 += a * x
        x2 += b * x
        y1 += a * y
        y2 += b * y
    # Rows (ω_a, ω_b) of the response to the impulse (D_a, D_b, D_n), moments (D_n, -c D_b, c D_a).
    sa = (cc * K[4], -cc * K[3], K[1])
    sb = (cc * K[5], -cc * K[4], K[2])
    x1, x2, y1, y2 = inv_mass * x1, inv_mass * x2, mass_b * y1, mass_b * y2
    # Motion per δω_a, δω_b made up for by y.
    pa, pb = s * (x1 * h2 - x2 * h1), s * (x2 * g1 - x1 * g2)
    qa, qb = s * (y1 * h2 - y2 * h1), s * (y2 * g1 - y1 * g2)
    ra, rb = s * (f1 * h2 - f2 * h1), s * (f2 * g1 - f1 * g2)
    return (
        inv_mass - pa * sa[0] - pb * sb[0], -pa * sa[1] - pb * sb[1], -pa * sa[2] - pb * sb[2],
        -qa * sa[0] - qb * sb[0], mass_b - qa * sa[1] - qb * sb[1], -qa * sa[2] - qb * sb[2],
        cc * K[2] - ra * sa[0] - rb * sb[0],
        -cc * K[1] - ra * sa[1] - rb * sb[1],
        K[0] - ra * sa[2] - rb * sb[2],
    )  # fmt: skip


@inlined
def resultant(count, center, y0, y, work):
    """Normal impulses of the active contacts: place of the one that pulls most or -1, and what the others exert."""
    patch = work.patch
    lowest = 0.0
    loser = -1
    fa = fb = tn = ta = tb = 0.0
    for j in range(count):
        i = work.active[j]
        c, a, b = patch[i, C], patch[i, A], patch[i, B]
        p = y0 + (y[0] * (a - center[1]) + y[1] * (b - center[2]))
        if not p >= lowest:
            lowest = p
            loser = j
        p = max(p, 0.0)
        patch[i, P] = p
        px, py = p * patch[i, X], p * patch[i, Y]
        fa += px
        fb += py
        tn += a * py - b * px
        ta += b * p - c * py
        tb += c * px - a * p
    return loser, (fa, fb, tn, ta, tb)


@inlined
def across_misses(count, mu, pivot, delta, work):
    """Largest tangential residual [m/s] when the motion that the directions are of is left by delta.

    Contact `pivot` holds and does not count; -1: all slide. Of a contact that moves backwards the whole velocity
    counts: its impulse is in the cone, and projections do not lengthen.

    Also H = Σ κ h hᵀ (11, 12, 13, 22, 23, 33): how the friction across grows with the planar motion.
    """
    patch = work.patch
    worst = k11 = k12 = k13 = k22 = k23 = k33 = 0.0
    if not mu > 0.0:
        return worst, (k11, k12, k13, k22, k23, k33)
    inv_mu = 1.0 / mu
    for j in range(count):
        i = work.active[j]
        a, b, p, size = patch[i, A], patch[i, B], patch[i, P], patch[i, SPEED]
        x, y = patch[i, X] * inv_mu, patch[i, Y] * inv_mu
        da, db = delta[0] - delta[2] * b, delta[1] + delta[2] * a
        load = mu * p
        if i == pivot:
            continue
        # (x, y) = -d; the weight, μ p trace(W_tt), is at least μ p / ρ_t.
        weight = load * patch[i, MOBILITY]
        along, across = size - (x * da + y * db), abs(x * db - y * da)
        if weight > 0.0:
            if along > 0.0:
                worst = max(worst, across * weight / (weight + along))
            else:
                worst = max(worst, across - along)
        if size > 0.0:
            s, h = load / size, -(a * x + b * y)
            k11 += s * y * y
            k12 -= s * x * y
            k13 += s * y * h
            k22 += s * x * x
            k23 -= s * x * h
            k33 += s * h * h
    return worst, (k11, k12, k13, k22, k23, k33)


@inlined
def add_along(count, mu, k, work):
    """H with the part along the directions, κ d dᵀ, besides: friction as a viscous drag."""
    patch = work.patch
    k11, k12, k13, k22, k23, k33 = k
    for j in range(count):
        i = work.active[j]
        x, y, size = patch[i, X], patch[i, Y], patch[i, SPEED]
        if size > 0.0:
            s, h = patch[i, P] / (mu * size), patch[i, A] * y - patch[i, B] * x
            k11 += s * x * x
            k12 += s * x * y
            k13 += s * x * h
            k22 += s * y * y
            k23 += s * y * h
            k33 += s * h * h
    return k11, k12, k13, k22, k23, k33


@inlined
def turns_little(count, mu, step, work):
    """Whether no direction turns by more than about 70 degrees, and none backwards, in a step of the motion."""
    patch = work.patch
    for j in range(count):
        i = work.active[j]
        x, y, size = patch[i, X], patch[i, Y], patch[i, SPEED]
        if size > 0.0:
            s = 1.0 / mu
            da, db = step[0] - step[2] * patch[i, B], step[1] + step[2] * patch[i, A]
            along, across = size - s * (x * da + y * db), s * (x * db - y * da)
            if not (along > 0.1 * size and abs(across) <= 3.0 * along):
                return False
    return True
