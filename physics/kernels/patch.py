"""Sums over the contacts of a patch on one wall, for `slide`, whose docstring has the formulas."""

from __future__ import annotations

import math

from physics.kernels import quaternion as qt
from physics.kernels.compiler import inlined

# Second moments of a patch: below this share of det to trace² it counts as a line (edges 1 : 1000).
LINE_LIMIT = 1.0e-6

# Columns of `work.patch`, a row per active contact: coordinates (normal, tangents) relative to the centre of
# mass, targets (normal, tangents), impulse per normal impulse (-μ d), sliding speed, normal impulse, W_aa +
# W_bb.
C, A, B, TARGET, TARGET_A, TARGET_B, X, Y, SPEED, P, MOBILITY = range(11)
PATCH_SIZE = 11


@inlined
def place_patch(n, friction, axes, v, w, inv_mass, K, work):
    """Fill `work.patch`; largest free contact speed [m/s], and the planar motion after the warm start."""
    patch, target, impulse, arm = work.patch, work.target, work.impulse, work.arm
    normal, t1, t2 = axes
    scale = fa = fb = tn = ta = tb = 0.0
    for i in range(n):
        r = (arm[i, 0], arm[i, 1], arm[i, 2])
        c, a, b = qt.dot(normal, r), qt.dot(t1, r), qt.dot(t2, r)
        work.active[i] = i
        work.normal[i] = 0.0
        patch[i, C], patch[i, A], patch[i, B] = c, a, b
        patch[i, TARGET], patch[i, TARGET_A], patch[i, TARGET_B] = target[i, 0], target[i, 1], target[i, 2]
        patch[i, MOBILITY] = (
            2.0 * inv_mass + K[0] * (a * a + b * b) - 2.0 * c * (K[1] * a + K[2] * b) + c * c * (K[3] + K[5])
        )
        scale = max(scale, abs(v[0] + w[1] * b - w[2] * a - target[i, 0]))
        if friction is not None:
            scale = max(scale, abs(v[1] + w[2] * c - w[0] * b - target[i, 1]))
            scale = max(scale, abs(v[2] + w[0] * a - w[1] * c - target[i, 2]))
            p, x, y = impulse[3 * i], impulse[3 * i + 1], impulse[3 * i + 2]
            fa += x
            fb += y
            tn += a * y - b * x
            ta += b * p - c * y
            tb += c * x - a * p
    start = (v[1] + inv_mass * fa, v[2] + inv_mass * fb, w[0] + (K[0] * tn + K[1] * ta + K[2] * tb))
    return scale, start


@inlined
def fit_targets(count, work):
    """Centroid (normal, tangents) of the active contacts and the affine fit of their targets (value, slopes).

    On a line the slopes are not finite, or no longer accurate: then ok is false.
    """
    patch = work.patch
    cc = ca = cb = t0 = 0.0
    for j in range(count):
        cc += patch[j, C]
        ca += patch[j, A]
        cb += patch[j, B]
        t0 += patch[j, TARGET]
    s = 1.0 / count
    cc, ca, cb, t0 = s * cc, s * ca, s * cb, s * t0
    saa = sab = sbb = ta = tb = 0.0
    for j in range(count):
        a, b, t = patch[j, A] - ca, patch[j, B] - cb, patch[j, TARGET]
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
def misfit(n, vn, wa, wb, axes, work):
    """Largest violation of the normal targets [m/s] by the normal motion; an open contact may be faster."""
    arm, normal_impulse = work.arm, work.normal
    worst = 0.0
    for i in range(n):
        r = (arm[i, 0], arm[i, 1], arm[i, 2])
        miss = work.target[i, 0] - (vn + wa * qt.dot(axes[2], r) - wb * qt.dot(axes[1], r))
        if normal_impulse[i] >= 0.0:
            miss = abs(miss)
        worst = max(worst, miss)
    return worst


@inlined
def respond(count, mu, center, y0, gain, motion, wa, wb, inv_mass, K, work):
    """Directions at a planar motion, the y_1, y_2 that go with them, and the compliance with these y at work.

    Returns
    -------
    y : tuple of 2 floats
    compliance : tuple of 9 floats
        Planar motion per planar impulse at the centroid, row by row: with the normal motion held by y_1, y_2.
    """
    patch = work.patch
    cc, ca, cb = center
    g0 = g1 = g2 = h0 = h1 = h2 = 0.0
    x1 = x2 = y1 = y2 = f1 = f2 = 0.0
    for j in range(count):
        c, a, b = patch[j, C], patch[j, A], patch[j, B]
        ua = motion[0] + wb * c - motion[2] * b - patch[j, TARGET_A]
        ub = motion[1] + motion[2] * a - wa * c - patch[j, TARGET_B]
        size = math.sqrt(ua * ua + ub * ub)
        s = 0.0
        if size > 0.0:
            s = -mu / size
        x, y = s * ua, s * ub
        patch[j, X], patch[j, Y], patch[j, SPEED] = x, y, size
        qn, qa, qb = a * y - b * x, b - c * y, c * x - a
        f = K[0] * qn + K[1] * qa + K[2] * qb
        g = K[1] * qn + K[3] * qa + K[4] * qb
        h = K[2] * qn + K[4] * qa + K[5] * qb
        a -= ca
        b -= cb
        g0 += g
        g1 += a * g
        g2 += b * g
        h0 += h
        h1 += a * h
        h2 += b * h
        f1 += a * f
        f2 += b * f
        x1 += a * x
        x2 += b * x
        y1 += a * y
        y2 += b * y
    s = 1.0 / (g1 * h2 - g2 * h1)
    ra, rb = gain[0] - g0 * y0, gain[1] - h0 * y0
    y = (s * (h2 * ra - g2 * rb), s * (g1 * rb - h1 * ra))
    # Rows (ω_a, ω_b) of the response to the impulse (D_a, D_b, D_n), moments (D_n, -c D_b, c D_a).
    sa = (cc * K[4], -cc * K[3], K[1])
    sb = (cc * K[5], -cc * K[4], K[2])
    x1, x2, y1, y2 = inv_mass * x1, inv_mass * x2, inv_mass * y1, inv_mass * y2
    # Motion per δω_a, δω_b made up for by y.
    pa, pb = s * (x1 * h2 - x2 * h1), s * (x2 * g1 - x1 * g2)
    qa, qb = s * (y1 * h2 - y2 * h1), s * (y2 * g1 - y1 * g2)
    ra, rb = s * (f1 * h2 - f2 * h1), s * (f2 * g1 - f1 * g2)
    compliance = (
        inv_mass - pa * sa[0] - pb * sb[0], -pa * sa[1] - pb * sb[1], -pa * sa[2] - pb * sb[2],
        -qa * sa[0] - qb * sb[0], inv_mass - qa * sa[1] - qb * sb[1], -qa * sa[2] - qb * sb[2],
        cc * K[2] - ra * sa[0] - rb * sb[0],
        -cc * K[1] - ra * sa[1] - rb * sb[1],
        K[0] - ra * sa[2] - rb * sb[2],
    )  # fmt: skip
    return y, compliance


@inlined
def resultant(count, center, y0, y, work):
    """Normal impulses of the active contacts: place of the one that pulls most or -1, and what all exert."""
    patch = work.patch
    lowest = 0.0
    loser = -1
    fa = fb = tn = ta = tb = 0.0
    for j in range(count):
        c, a, b = patch[j, C], patch[j, A], patch[j, B]
        p = y0 + (y[0] * (a - center[1]) + y[1] * (b - center[2]))
        patch[j, P] = p
        if not p >= lowest:
            lowest = p
            loser = j
        px, py = p * patch[j, X], p * patch[j, Y]
        fa += px
        fb += py
        tn += a * py - b * px
        ta += b * p - c * py
        tb += c * px - a * p
    return loser, (fa, fb, tn, ta, tb)


@inlined
def slide_residual(count, mu, delta, work):
    """Largest tangential residual [m/s]: the motion the directions are of is left by delta."""
    patch = work.patch
    worst = 0.0
    for j in range(count):
        da, db = delta[0] - delta[2] * patch[j, B], delta[1] + delta[2] * patch[j, A]
        x, y, p, size = patch[j, X], patch[j, Y], patch[j, P], patch[j, SPEED]
        if p > 0.0 and mu > 0.0:
            # (x, y) = -μ d; s = μ p trace(W_tt) is at least μ p / ρ_t.
            s = mu * p * patch[j, MOBILITY]
            along = size - (x * da + y * db) / mu
            if not along > 0.0:
                return math.inf
            worst = max(worst, abs(x * db - y * da) * s / (mu * (s + along)))
    return worst


@inlined
def drag(count, mu, work):
    """H = Σ κ h hᵀ (11, 12, 13, 22, 23, 33): how the friction grows with the planar motion."""
    patch = work.patch
    k11 = k12 = k13 = k22 = k23 = k33 = 0.0
    for j in range(count):
        a, b, x, y, p, size = patch[j, A], patch[j, B], patch[j, X], patch[j, Y], patch[j, P], patch[j, SPEED]
        if size > 0.0 and mu > 0.0:
            s = p / (mu * size)
            h = -(a * x + b * y)
            k11 += s * y * y
            k12 -= s * x * y
            k13 += s * y * h
            k22 += s * x * x
            k23 -= s * x * h
            k33 += s * h * h
    return k11, k12, k13, k22, k23, k33
