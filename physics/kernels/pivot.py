"""A patch of contacts that turns about one of them: that one holds, the others slide or open.

Coulomb's friction lets one contact of a patch hold while the others slide about it for a whole range of loads, not
by accident. With contact k held the planar motion is one number, ω_n, and the directions of the others are those
of a rotation about r_k: only its sense matters (but for targets that differ, which is why ω_n is iterated on).
Given the directions, all is linear in the impulse (f_a, f_b) across contact k and in y_1, y_2 of `slide`: ω_a and
ω_b are the ones asked for, and contact k has its target velocity.

Where the cone does not allow (f_a, f_b) contact k slides against it, which is a direction to go on from.
"""

from __future__ import annotations

import math

from physics.kernels.columns import lane
from physics.kernels.compiler import inlined, kernel
from physics.kernels.ellipse import friction_ratio
from physics.kernels.lanes import chosen, total
from physics.kernels.patch import across_misses, opposed, resultant

# Rounds on ω_n at most: one when the sense is guessed right and all targets agree, two when it is the other sense.
PIVOT_LIMIT = 3

# What came out.
NOT_FOUND, FOUND, SLIPS, PULLS = range(4)


@inlined
def _contact(k, patch):
    """Coordinates of contact k and what is asked of it along the tangents."""
    (c, a, b), (_, target_a, target_b), _ = patch
    return (c[k], a[k], b[k]), (target_a[k], target_b[k])


@inlined
def _point_at(k, patch, on, mu, center, wa, wb, spin, K):
    """Directions of the contacts that slide about contact k, for ω_n = spin, and sums over all of them.

    Returns
    -------
    slip : tuple of 3 lanes
        As of `patch.respond`.
    x, y, f, g, h : tuples of 3 floats
        Of the impulse per normal impulse along the two tangents and of the response (ω_n, ω_a, ω_b) to it: sums with
        the weights 1, a, b (about the centroid).
    """
    (c, a, b), (_, target_a, target_b), _ = patch
    (ck, ak, bk), (ta, tb) = _contact(k, patch)
    ua = wb * (c - ck) - spin * (b - bk) + (ta - target_a)
    ub = spin * (a - ak) - wa * (c - ck) + (tb - target_b)
    slip = opposed(ua, ub, chosen(lane(k), 0.0, on), mu)
    x, y, _ = slip
    mn, ma, mb = a * y - b * x, on * b - c * y, c * x - on * a
    f = K[0] * mn + K[1] * ma + K[2] * mb
    g = K[1] * mn + K[3] * ma + K[4] * mb
    h = K[2] * mn + K[4] * ma + K[5] * mb
    a, b = a - center[1], b - center[2]
    return (
        slip,
        (total(x), total(a * x), total(b * x)),
        (total(y), total(a * y), total(b * y)),
        (total(f), total(a * f), total(b * f)),
        (total(g), total(a * g), total(b * g)),
        (total(h), total(a * h), total(b * h)),
    )


@inlined
def _hold_at(k, patch, sums, y0, gain, u, w, wa, wb, inv_mass, K, work):
    """Impulse (f_a, f_b) across contact k, (y_1, y_2), and the ω_n that they lead to."""
    x, y, f, g, h = sums
    ratio = friction_ratio(work)
    mass_b = ratio * ratio * inv_mass
    (ck, ak, bk), (ta, tb) = _contact(k, patch)
    # Response (ω_n, ω_a, ω_b) to f_a and to f_b.
    pn, pa, pb = ck * K[2] - bk * K[0], ck * K[4] - bk * K[1], ck * K[5] - bk * K[2]
    qn, qa, qb = ak * K[0] - ck * K[1], ak * K[1] - ck * K[3], ak * K[2] - ck * K[4]
    s = 1.0 / (g[1] * h[2] - g[2] * h[1])
    ra, rb = gain[0] - g[0] * y0, gain[1] - h[0] * y0
    r1, r2 = s * (h[2] * ra - g[2] * rb), s * (g[1] * rb - h[1] * ra)
    e11, e21 = s * (h[2] * pa - g[2] * pb), s * (g[1] * pb - h[1] * pa)
    e12, e22 = s * (h[2] * qa - g[2] * qb), s * (g[1] * qb - h[1] * qa)
    free = w[0] + f[0] * y0 + f[1] * r1 + f[2] * r2
    wfa, wfb = pn - f[1] * e11 - f[2] * e21, qn - f[1] * e12 - f[2] * e22
    maa = inv_mass * (1.0 - x[1] * e11 - x[2] * e21) - bk * wfa
    mab = -inv_mass * (x[1] * e12 + x[2] * e22) - bk * wfb
    mba = -mass_b * (y[1] * e11 + y[2] * e21) + ak * wfa
    mbb = mass_b * (1.0 - y[1] * e12 - y[2] * e22) + ak * wfb
    va = ta - u[1] - wb * ck - inv_mass * (x[0] * y0 + x[1] * r1 + x[2] * r2) + free * bk
    vb = tb - u[2] + wa * ck - mass_b * (y[0] * y0 + y[1] * r1 + y[2] * r2) - free * ak
    s = 1.0 / (maa * mbb - mab * mba)
    fa, fb = s * (mbb * va - mab * vb), s * (maa * vb - mba * va)
    return (fa, fb), (r1 - e11 * fa - e12 * fb, r2 - e21 * fa - e22 * fb), free + wfa * fa + wfb * fb


@kernel
def turn_about(k, patch, on, mu, goal, center, y0, gain, u, w, wa, wb, spin, inv_mass, K, work):
    """Impulses with which contact k holds and the other active contacts slide.

    Parameters
    ----------
    k : int
        The contact.
    patch, on
        Of the contacts (`patch`).
    center, y0, gain, u, w, wa, wb, K
        As in `slide.search`.
    spin : float
        First guess of ω_n [rad/s].

    Returns
    -------
    what : int
        FOUND; SLIPS: contact k cannot hold; PULLS: an active contact would have to pull; NOT_FOUND.
    loser : int
        The active contact that pulls most.
    impulses : tuple of 3 lanes
        Of the contacts, when found (normal, tangents).
    total : tuple of 5 floats
        Impulses along the tangents and moments of all contacts.
    miss : float
        Residual [m/s].
    motion : tuple of 3 floats
        Planar motion (v_a, v_b, ω_n): where contact k slips, just off the pivot.
    """
    (ck, ak, bk), (ta, tb) = _contact(k, patch)
    none, still = (0.0, 0.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    for _ in range(PIVOT_LIMIT):
        slip, x, y, f, g, h = _point_at(k, patch, on, mu, center, wa, wb, spin, K)
        sums = x, y, f, g, h
        (fa, fb), slopes, turned = _hold_at(k, patch, sums, y0, gain, u, w, wa, wb, inv_mass, K, work)
        _, loser, p, (sa, sb, mn, ma, mb) = resultant(patch, on, center, y0, slopes, slip)
        exerted = (sa + fa, sb + fb, mn + (ak * fb - bk * fa), ma - ck * fb, mb + ck * fa)
        change = turned - spin
        is_held = lane(k)
        miss, _ = across_misses(patch, chosen(is_held, 0.0, p), slip, mu, (change * bk, -change * ak, change))
        if not math.isfinite(turned):
            break
        if miss <= goal:
            impulses = p, chosen(is_held, fa, p * slip[0]), chosen(is_held, fb, p * slip[1])
            motion = (ta - wb * ck + turned * bk, tb + wa * ck - turned * ak, turned)
            if loser >= 0:
                return PULLS, loser, impulses, none, miss, motion
            size, load = math.sqrt(fa * fa + fb * fb), mu * p[k]
            if size <= load:
                return FOUND, -1, impulses, exerted, miss, motion
            s = (size - load) * patch[2][k] / size
            return SLIPS, -1, impulses, none, miss, (motion[0] - s * fa, motion[1] - s * fb, turned)
        spin = turned
    return NOT_FOUND, -1, (on, on, on), none, 0.0, still
