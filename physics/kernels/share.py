"""Sharing out a total impulse and its moment among contacts that hold; see `direct`."""

from __future__ import annotations

import math

from physics.kernels import quaternion as qt
from physics.kernels.arms import wall_of
from physics.kernels.compiler import inlined
from physics.kernels.ellipse import friction_ratio
from physics.kernels.layout import NORMAL, TANGENT_1, TANGENT_2

# Weighted sharings of the tangential impulses at most, and the excess over a cone at which none is worth a
# trial.
SHARE_LIMIT = 12
HOPELESS = 1.5


@inlined
def wall_axis(walls, wall, first):
    """Three columns of a wall's row: its normal or a tangent."""
    return (walls[wall, first], walls[wall, first + 1], walls[wall, first + 2])


@inlined
def wall_axes(walls, wall):
    """Normal and the two tangents of a wall."""
    return (
        wall_axis(walls, wall, NORMAL),
        wall_axis(walls, wall, TANGENT_1),
        wall_axis(walls, wall, TANGENT_2),
    )


@inlined
def solve_symmetric(k, b):
    """x of K x = b for K = (k11, k12, k13, k22, k23, k33), by cofactors."""
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
def minus(a, b):
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])


@inlined
def contact_arm(work, i):
    return (work.arm[i, 0], work.arm[i, 1], work.arm[i, 2])


@inlined
def first_active(n, work):
    """First contact that is not left out."""
    for i in range(n):
        if work.active[i] != 0:
            return i
    return 0


@inlined
def is_in_cone(pn, pa, pb, work):
    """Whether an impulse (normal, tangents) is in the cone of friction."""
    limit, b = work.mu * pn, pb / friction_ratio(work)
    return pa * pa + b * b <= limit * limit


@inlined
def share_out(n, count, c, F, a, work):
    """Bolt-group impulses: (the contact that pulls most or -1, whether all are in their cones)."""
    walls = work.walls
    lowest = 0.0
    loser = -1
    holds = True
    s = 1.0 / count
    for i in range(n):
        if work.active[i] == 0:
            continue
        wall = wall_of(work.slot[i], work)
        m = qt.cross(a, minus(contact_arm(work, i), c))
        p = (s * F[0] + m[0], s * F[1] + m[1], s * F[2] + m[2])
        pn = qt.dot(wall_axis(walls, wall, NORMAL), p)
        pa, pb = qt.dot(wall_axis(walls, wall, TANGENT_1), p), qt.dot(wall_axis(walls, wall, TANGENT_2), p)
        work.normal[i] = pn
        work.across[i, 0], work.across[i, 1] = pa, pb
        if not pn >= lowest:
            lowest = pn
            loser = i
        if not is_in_cone(pn, pa, pb, work):
            holds = False
    return loser, holds


@inlined
def _share_by_weight(n, work):
    """Share the tangential impulses out by `work.weight` once: by what ratio that leaves a cone.

    With weights g_i, their centre r_g, ρ_i = r_i - r_g: p_t,i = g_i (P_t / Σg + α n x ρ_i), α = T_n / Σ g ρ²,
    T_n the moment of the tangential impulses about r_g. Weights are lowered where the cone is left.
    """
    active, across, weight, place, ratio = work.active, work.across, work.weight, work.place, friction_ratio(work)
    total = fa = fb = ma = mb = 0.0
    for i in range(n):
        if active[i] == 0:
            continue
        g = weight[i]
        total += g
        fa += across[i, 0]
        fb += across[i, 1]
        ma += g * place[i, 0]
        mb += g * place[i, 1]
    s = 1.0 / total
    ma, mb, fa, fb = s * ma, s * mb, s * fa, s * fb
    moment = second = 0.0
    for i in range(n):
        if active[i] == 0:
            continue
        a, b = place[i, 0] - ma, place[i, 1] - mb
        moment += a * across[i, 1] - b * across[i, 0]
        second += weight[i] * (a * a + b * b)
    alpha = moment / second if second > 0.0 else 0.0
    worst = 0.0
    for i in range(n):
        if active[i] == 0:
            continue
        g = weight[i]
        x, y = fa - alpha * (place[i, 1] - mb), fb + alpha * (place[i, 0] - ma)
        across[i, 0], across[i, 1] = g * x, g * y
        limit = work.mu * work.normal[i]
        y /= ratio
        size = g * math.sqrt(x * x + y * y)
        if not size <= limit:
            weight[i] *= 0.98 * limit / size
            worst = max(worst, size / limit)
    return worst


@inlined
def share_by_load(n, work):
    """Share the tangential impulses of one wall out in proportion to the normal ones; whether that holds."""
    walls, active = work.walls, work.active
    wall = wall_of(work.slot[first_active(n, work)], work)
    t1, t2 = wall_axis(walls, wall, TANGENT_1), wall_axis(walls, wall, TANGENT_2)
    for i in range(n):
        if active[i] == 0:
            continue
        if wall_of(work.slot[i], work) != wall:
            return False
        work.weight[i], r = work.normal[i], contact_arm(work, i)
        work.place[i, 0], work.place[i, 1] = qt.dot(t1, r), qt.dot(t2, r)
    for _ in range(SHARE_LIMIT):
        worst = _share_by_weight(n, work)
        if worst <= 1.0:
            return True
        if worst > HOPELESS:
            return False
    return False
