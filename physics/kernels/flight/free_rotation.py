"""Rotate a free rigid body over a time h, exact to rounding at any spin rate and without elliptic functions.

Let m be the angular momentum in the principal frame, J the inverse principal
moments, a = (J3 - J2, J1 - J3, J2 - J1). Euler's equations are m1' = a1 m2 m3
(and cyclic). Two facts make the flow over a time h explicit:

**Momentum.** The solution is made of Jacobi elliptic functions, and their
addition theorem, multiplied out with the invariants

    P = a1 (a3 m2² - a2 m3²),    Q = a3 (a1 m2² - a2 m1²)

in place of modulus and amplitudes, is a rational map of m itself:

    m1(h) = (C m1 + D σ a1 m2 m3) / N
    m2(h) = (C D m2 + σ a2 m1 m3) / N        N = 1 - a1 a3 σ² m2²
    m3(h) = (D m3 + C σ a3 m1 m2) / N        C² = 1 - P σ²,  D² = 1 - Q σ²

with one scalar series σ(h; P, Q) = sn(√P h) / √P. No axis has to be the
largest: everything is a power series in P and Q, of any sign.

**Attitude.** McLachlan and Zanna observed that the discrete rigid body of
Moser and Veselov with *modified* moments of inertia is the exact flow. In unit
quaternions (e0, e), the rotation of the step, its defining relation reads

    e0 e_j = (h/4) [(1 + s) J_j + d] (m_j(0) + m_j(h)),

with s and d power series in h² whose coefficients are polynomials in the
invariants |m|² and 2E = Σ J_j m_j², the same for the three axes. The
coefficients below were derived in exact rational arithmetic by matching the
Taylor series of the flow; `tests/kernels/test_rotation.py` derives them anew.
From e0 e follows e0² = (1 + √(1 - 4 |e0 e|²)) / 2.

A step whose angle h |ω| exceeds `PART_ANGLE_LIMIT` is cut into equal parts. A step of many turns is made by periods of
m. With the axes in the order of their moments, so that axis 2 is the middle one, the period is

    T = 4 K(k) / √max(P, Q) = 2π / agm(√max(P, Q), √|P - Q|).

After a period m is the same again, so the body has turned about the constant L. The angle of this turn is found for one
period, by parts, and multiplied by the number of periods. Where m is constant, the body turns about L at the rate
ω·L/|L| = 2E/|L|.

References
----------
.. [1] J. Moser, A. P. Veselov, *Discrete versions of some classical integrable systems and factorization
   of matrix polynomials*, Commun. Math. Phys. 139, 1991.
.. [2] R. I. McLachlan, A. Zanna, *The discrete Moser-Veselov algorithm for the free rigid body, revisited*,
   Found. Comput. Math. 5, 2005.
.. [3] E. Hairer, G. Vilmart, *Preprocessed discrete Moser-Veselov algorithm for the full dynamics of the
   rigid body*, J. Phys. A 39, 2006 (the first terms of s and d, and their use as an integrator).
.. [4] DLMF, section 22.8 (addition theorems), 22.10 (series of sn) and 19.8 (K by the arithmetic-geometric mean).
"""

from __future__ import annotations

import math

from physics.compiler.decorators import inlined, kernel
from physics.kernels.math import quaternion as qt

# Largest rotation angle of one part [rad]. The first neglected terms are of relative size θ⁸ times at most
# 1e-4 (s and d) and θ¹⁰ times 0.009 (σ): at 0.06, 1.7e-14 θ_part and 5e-15, that is 1e-15 rad per part at the
# most, and a few 1e-17 for the block.
PART_ANGLE_LIMIT = 0.06

# Below this angle² θ² [rad²] the terms of third order of all series are left out. With |P| h² + |Q| h² <= 2 θ² they
# change m(h) by less than 0.09 θ⁶ = 2.4e-14 of its size, and the attitude, where m(h) enters times θ/4, by 5e-17; those
# of s and d change it by 1e-4 θ⁷ = 2e-19. 1/N is taken by its series: the first neglected term is θ⁸ = 2e-17.
SMALL_SQUARE = 6.4e-5

# Below this angle² θ² [rad²] those of second order are left out too, but for those of C and D, and all after x² in
# `_half_angle`. Those of s and d are less than θ⁴/30 of e, which is less than θ/2: 0.02 θ⁵. Those of sn and of N change
# m(h) by less than θ⁵, what is left out there x³ < θ⁶/64. Together 4e-17 at most of 1.2 million random bodies.
TINY_SQUARE = 2.5e-6

# Below this |P| h² + |Q| h² the last terms of the series of sn, cn, dn are left out: they change m(h) by less
# than 0.037 (4e-4)⁴ = 1e-15 of its size, and the attitude, where m(h) enters times θ/4, by less than 1e-17.
SHORT_SERIES = 4.0e-4

# A turn that needs more parts than this, 6e5 rad within a period of m or with less than two periods, is that of a body
# whose moments are nearly equal. It is made as if m were constant, which keeps energy and momentum.
PARTS_LIMIT = 1.0e7

# Beyond this angle [rad] a step of at least two periods is made by periods. An error of one period's turn, a few 1e-16
# rad per part, counts once per period: less than EPS h |ω|, which the rounding of h alone makes.
MANY_TURNS = 50.0


def write_attitude_series(J1, J2, J3, out):
    """Write the coefficients of the series s and d of the module docstring, for one body or for many at once.

    New worlds call this Python function, so that no kernel has to be compiled first. `attitude_series` is the same
    function as a kernel.

    Parameters
    ----------
    J1, J2, J3 : float or (n,) float64
        Inverse principal moments of inertia [1/(kg m²)].
    out : (SERIES_SIZE,) or (SERIES_SIZE, n) float64, out
        Nine coefficients of s, then nine of d. The powers of (|m|², 2E) that they belong to are
        (1,0) (0,1) | (2,0) (1,1) (0,2) | (3,0) (2,1) (1,2) (0,3).
    """
    e1 = J1 + J2 + J3
    e2 = J1 * J2 + J2 * J3 + J3 * J1
    e3 = J1 * J2 * J3
    out[0] = e2 / 12
    out[1] = -e1 / 6
    out[2] = e2 * e2 / 120 - e1 * e3 / 40
    out[3] = e3 / 30 - e1 * e2 / 120
    out[4] = e1 * e1 / 120 - e2 / 240
    out[5] = 17 * (e2 * e2 * e2) / 20160 - 11 * e1 * e2 * e3 / 3360 + 5 * (e3 * e3) / 1008
    out[6] = -e1 * (e2 * e2) / 560 + 11 * (e1 * e1) * e3 / 1680 - e2 * e3 / 672
    out[7] = (e1 * e1) * e2 / 3360 + 41 * (e2 * e2) / 20160 - 53 * e1 * e3 / 5040
    out[8] = -(e1 * e1 * e1) / 5040 + e1 * e2 / 5040 + e3 / 280
    out[9] = -e3 / 6
    out[10] = e2 / 12
    out[11] = -e2 * e3 / 240
    out[12] = e1 * e3 / 30 - e2 * e2 / 240
    out[13] = -e1 * e2 / 240 - e3 / 40
    out[14] = e1 * (e3 * e3) / 280 - 19 * (e2 * e2) * e3 / 20160
    out[15] = e2 * e2 * e2 / 10080 - e1 * e2 * e3 / 10080 - 11 * (e3 * e3) / 1260
    out[16] = 13 * e1 * (e2 * e2) / 20160 - (e1 * e1) * e3 / 315 + 11 * e2 * e3 / 2016
    out[17] = (e1 * e1) * e2 / 10080 - 13 * (e2 * e2) / 10080 + e1 * e3 / 336


attitude_series = kernel(write_attitude_series)


@inlined
def _half_angle(x, square):
    """Scalar part e0 of a unit quaternion (e0, e), and 1/e0, from x = |e0 e|²: e0² = (1 + √(1 - 4x)) / 2.

    `square` is the squared angle of the rotation [rad²]. Power series replace two square roots, one after the other,
    which would take longer. 4x is sin² of an angle up to `PART_ANGLE_LIMIT`, so x < 9.0e-4. The first neglected terms,
    29 x⁶ of e0 and 51 x⁶ of 1/e0, are under 3e-17.
    """
    xx = x * x
    if square > TINY_SQUARE:
        fourth = xx * xx
        e0 = (1.0 - 0.5 * x) - (xx * (0.625 + 1.3125 * x) + fourth * ((429.0 / 128.0) + (2431.0 / 256.0) * x))
        inv_e0 = (1.0 + 0.5 * x) + (xx * (0.875 + 2.0625 * x) + fourth * ((715.0 / 128.0) + (4199.0 / 256.0) * x))
    else:
        e0, inv_e0 = (1.0 - 0.5 * x) - 0.625 * xx, (1.0 + 0.5 * x) + 0.875 * xx
    return e0, inv_e0


@inlined
def _part(q, m_body, J_body, c, mm, energy2, square, h):
    """Quaternion and body momentum after a free rotation over h [s], by an angle of at most `PART_ANGLE_LIMIT`.

    m_body is the momentum m in the principal frame, J_body the inverse moments and c the coefficients of
    `attitude_series`. mm is |m|², energy2 is 2E, and `square` is a bound of the squared angle of the turn [rad²].
    """
    J1, J2, J3 = J_body
    m1, m2, m3 = m_body
    a1, a2, a3 = J3 - J2, J1 - J3, J2 - J1
    hh = h * h

    # Series of sn, cn and dn with their modulus multiplied out: σ = sn/√P, C = cn, D = dn, and (σ/h)².
    p = a1 * (a3 * (m2 * m2) - a2 * (m3 * m3)) * hh
    r = a3 * (a1 * (m2 * m2) - a2 * (m1 * m1)) * hh
    t, x = p + r, (a1 * a3) * (m2 * m2) * hh
    sn, snsn = 1.0 - t * (1.0 / 6.0), 1.0 - t * (1.0 / 3.0)
    C = (1.0 - 0.5 * p) + p * ((p + 4.0 * r) * (1.0 / 24.0))
    D = (1.0 - 0.5 * r) + r * ((r + 4.0 * p) * (1.0 / 24.0))
    # s and d in the variables y = h² |m|², z = h² 2E.
    y, z = hh * mm, hh * energy2
    if square <= TINY_SQUARE:
        s, d = z * c[1] + y * c[0], z * c[10] + y * c[9]
        x *= snsn
        inv_N = 1.0 + x * (1.0 + x)
    else:
        u, pp, rr, tt = p * r, p * p, r * r, t * t
        sn += (tt + 12.0 * u) * (1.0 / 120.0)
        snsn += (2.0 * tt + 9.0 * u) * (1.0 / 45.0)
        s = z * (c[1] + z * c[4]) + y * (c[0] + z * c[3] + y * c[2])
        d = z * (c[10] + z * c[13]) + y * (c[9] + z * c[12] + y * c[11])
        if square > SMALL_SQUARE:
            sn -= t * (tt + 132.0 * u) * (1.0 / 5040.0)
            C -= p * ((pp + 44.0 * u + 16.0 * rr) * (1.0 / 720.0))
            D -= r * ((rr + 44.0 * u + 16.0 * pp) * (1.0 / 720.0))
            if abs(p) + abs(r) > SHORT_SERIES:
                sn += (tt * tt + 1224.0 * tt * u + 3024.0 * u * u) * (1.0 / 362880.0)
                C += p * (p * pp + 408.0 * p * u + 912.0 * r * u + 64.0 * r * rr) * (1.0 / 40320.0)
                D += r * (r * rr + 408.0 * r * u + 912.0 * p * u + 64.0 * p * pp) * (1.0 / 40320.0)
                snsn += (2.0 * tt * tt + 243.0 * tt * u + 378.0 * u * u) * (1.0 / 14175.0)
                snsn -= t * (tt + 27.0 * u) * (1.0 / 315.0)
            inv_N = 1.0 / (1.0 - x * snsn)
            yy, zz = y * y, z * z
            s += zz * (z * c[8] + y * c[7]) + yy * (z * c[6] + y * c[5])
            d += zz * (z * c[17] + y * c[16]) + yy * (z * c[15] + y * c[14])
        else:
            x *= snsn
            inv_N = 1.0 + x * (1.0 + x * (1.0 + x))
    sigma = h * sn
    g1, g2, g3 = sigma * (a1 * (m2 * m3)), sigma * (a2 * (m1 * m3)), sigma * (a3 * (m1 * m2))
    n1 = (C * m1 + D * g1) * inv_N
    n2 = (C * D * m2 + g2) * inv_N
    n3 = (D * m3 + C * g3) * inv_N

    s_plus_1 = 1.0 + s
    quarter = 0.25 * h
    v1 = quarter * (s_plus_1 * J1 + d) * (m1 + n1)
    v2 = quarter * (s_plus_1 * J2 + d) * (m2 + n2)
    v3 = quarter * (s_plus_1 * J3 + d) * (m3 + n3)
    e0, inv_e0 = _half_angle(v1 * v1 + v2 * v2 + v3 * v3, square)
    q = qt.renormalise(q)  # of the old q, which is known early; e is a unit quaternion to rounding
    return qt.multiply(q, (e0, v1 * inv_e0, v2 * inv_e0, v3 * inv_e0)), (n1, n2, n3)


@kernel
def momentum_period(m, J):
    """Period [s] of the momentum m in the principal frame, for inverse moments J.

    It is infinite on the separatrix, where m never returns.
    """
    one, two, three = (J[0], m[0] * m[0]), (J[1], m[1] * m[1]), (J[2], m[2] * m[2])
    if one[0] > two[0]:
        one, two = two, one
    if two[0] > three[0]:
        two, three = three, two
    if one[0] > two[0]:
        one, two = two, one
    a1, a2, a3 = three[0] - two[0], three[0] - one[0], two[0] - one[0]
    first, third = a1 * three[1], a3 * one[1]
    high = math.sqrt(a1 * a3 * two[1] + a2 * max(first, third))  # √max(P, Q)
    low = math.sqrt(a2 * abs(first - third))
    if low == 0.0:
        return math.inf
    while high - low > 4.0e-16 * high:
        high, low = 0.5 * (high + low), math.sqrt(high * low)
    return 2.0 * math.pi / high


@inlined
def _is_steady(m, J):
    """True if the momentum m in the principal frame is constant, because the gyroscopic torque is zero."""
    first, second, third = (J[2] - J[1]) * m[1] * m[2], (J[0] - J[2]) * m[2] * m[0], (J[1] - J[0]) * m[0] * m[1]
    return first == 0.0 and second == 0.0 and third == 0.0


@inlined
def _turn_steadily(q, L, mm, energy2, h):
    """Quaternion after the time h of a body whose momentum in the principal frame is constant: a turn about L.

    mm is |L|², energy2 is twice the energy of rotation.
    """
    s = h * (energy2 / mm)
    return qt.renormalise(qt.multiply(qt.exp_map((s * L[0], s * L[1], s * L[2])), q))


@inlined
def _turn_by_parts(q, m, L, J, series, mm, energy2, h, angle):
    """Quaternion after a free rotation over h [s], by at most `angle` [rad], in parts of at most `PART_ANGLE_LIMIT`.

    q is the quaternion and m the momentum in the principal frame at the start; mm is |m|², energy2 twice the energy.
    """
    if angle > PART_ANGLE_LIMIT * PARTS_LIMIT:
        return _turn_steadily(q, L, mm, energy2, h)
    parts = int(angle / PART_ANGLE_LIMIT) + 1
    for _ in range(parts):
        q, m = _part(q, m, J, series, mm, energy2, PART_ANGLE_LIMIT * PART_ANGLE_LIMIT, h / parts)
    return q


@kernel
def _turn_far(q, m, L, J, series, mm, energy2, h):
    """Quaternion after a free rotation over h [s], by an angle that may exceed `PART_ANGLE_LIMIT`.

    The rotation is made in parts; of many turns whole periods of the momentum m are made at once. q is the quaternion
    and m the momentum in the principal frame at the start; mm is |m|², energy2 twice the energy. The result is NaN if
    the angle overflows.
    """
    angle = abs(h) * math.sqrt(max(J[0], J[1], J[2]) * energy2)
    if not angle < math.inf:
        return (math.nan, math.nan, math.nan, math.nan)  # its energy overflows: the caller's guard reports it
    if _is_steady(m, J):
        return _turn_steadily(q, L, mm, energy2, h)
    count = 0.0
    if angle > MANY_TURNS:
        period = momentum_period(m, J)
        count = math.floor(abs(h) / period)
    if count >= 2.0:
        turned = _turn_by_parts(q, m, L, J, series, mm, energy2, period, angle * (period / abs(h)))
        e = qt.multiply(turned, qt.conjugate(q))  # about L, since m is again what it was
        size = math.sqrt(mm)
        turn = 2.0 * math.atan2(qt.dot((e[1], e[2], e[3]), L) / size, e[0]) * math.copysign(count, h)
        q = qt.multiply(qt.exp_map((turn * L[0] / size, turn * L[1] / size, turn * L[2] / size)), q)
        rest = max(abs(h) - count * period, 0.0)
        angle *= rest / abs(h)
        h = math.copysign(rest, h)
    return _turn_by_parts(q, m, L, J, series, mm, energy2, h, angle)


@inlined
def free_rotation(q, L, J, series, h):
    """Attitude of a body after a time h of torque-free rotation, as a quaternion of its principal frame.

    Parameters
    ----------
    q : tuple of 4 floats
        Unit quaternion, principal frame to world.
    L : tuple of 3 floats
        Angular momentum about the centre of mass, world frame [kg m²/s]. It is constant.
    J : tuple of 3 floats
        Inverse principal moments of inertia [1/(kg m²)].
    series : (SERIES_SIZE,) float64
        Coefficients of `attitude_series`.
    h : float
        Time [s], of any sign.

    Returns
    -------
    tuple of 4 floats
        Unit quaternion at the end.
    """
    m = qt.transposed_matvec(qt.to_matrix(q), L)
    w1, w2, w3 = J[0] * m[0], J[1] * m[1], J[2] * m[2]
    mm = m[0] * m[0] + m[1] * m[1] + m[2] * m[2]
    energy2 = w1 * m[0] + w2 * m[1] + w3 * m[2]
    # max |ω|² over the whole orbit, not only now: Σ J² m² <= max(J) Σ J m².
    square = h * h * (max(J[0], J[1], J[2]) * energy2)
    if square <= PART_ANGLE_LIMIT * PART_ANGLE_LIMIT:
        q, m = _part(q, m, J, series, mm, energy2, square, h)
        return q
    return _turn_far(q, m, L, J, series, mm, energy2, h)


@kernel
def isotropic_rotation(q, L, J1, h):
    """Quaternion after the time h of a body with equal moments, whose angular velocity ω = J1 L is constant.

    J1 is the inverse moment of inertia [1/(kg m²)], L the angular momentum, world frame.
    """
    s = J1 * h
    return qt.renormalise(qt.multiply(qt.exp_map((s * L[0], s * L[1], s * L[2])), q))
