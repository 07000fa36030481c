"""One or two contacts of one wall: every mixture of holding, sliding and opening, without a Delassus matrix.

Two contacts that slide are two angles. For given directions "both normal velocities are on target" is a
2 x 2 system for the normal impulses, and Newton's method turns both directions at once until no velocity is left
across them (`one_contact` has the same for a single contact).

A direction that would have to turn right round belongs to a contact that holds. Its impulse answers the other's,
p_i = -W_ii⁻¹ (b_i + W_ij p_j), so that the other one is a single contact with the block W_jj - W_ji W_ii⁻¹ W_ij.
Where the cone does not allow p_i, contact i slides against it, and that is the next direction to start from.
"""

from __future__ import annotations

import math

from physics.kernels.compile.decorators import inlined, kernel
from physics.kernels.contact_law.anisotropic_friction import friction_ratio
from physics.kernels.contact_law.compliance import add_block_compliance
from physics.kernels.contact_solver.impulse_distribution import solve_symmetric
from physics.kernels.contact_solver.one_contact import (
    CONTACT_SLIDES,
    CONTACT_STICKS,
    CONTACT_UNSOLVED,
    delassus_block,
    diagonal_delassus_block,
    friction_direction,
    is_warm_start_valid,
    point_velocity,
    rotate_direction,
    sliding_residual,
    solve_contact_block,
)
from physics.kernels.math import quaternion as qt

# Newton steps at most. Two are usual at a tolerance of 1e-6.
_MAX_NEWTON_STEPS = 12

# How often a contact is tried as one that holds, and both once more after one that was open has closed.
_MAX_STICK_TRIALS = 2
_MAX_RECLOSURES = 1

# How often contacts that none of that is true of answer each other in turn, and how many times each.
_MAX_ALTERNATIONS = 2
_SWEEPS_PER_ALTERNATION = 8


@inlined
def _plus(p, q):
    return p[0] + q[0], p[1] + q[1], p[2] + q[2]


@inlined
def _transposed(W):
    return W[0], W[3], W[6], W[1], W[4], W[7], W[2], W[5], W[8]


@kernel
def _solve_with_open(Wi, Wji, bi, bj, mu, goal, x, y):
    """Contact i alone, contact j open: (found, p_i, p_j, residual, direction of i, and of j, to go on from)."""
    zero = (0.0, 0.0, 0.0)
    what, p, miss = solve_contact_block(Wi, bi, mu, Wi[4] + Wi[8], goal, x, y, True)
    uj = _plus(bj, qt.matvec(Wji, p))
    if what == CONTACT_SLIDES:
        x, y = p[1] / p[0], p[2] / p[0]
    elif what == CONTACT_STICKS:
        x, y = friction_direction(-p[1], -p[2], mu)
    xj, yj = friction_direction(uj[1], uj[2], mu)
    return what != CONTACT_UNSOLVED and uj[0] >= -goal, p, zero, max(miss, -uj[0]), x, y, xj, yj


@kernel
def _solve_with_sticking(Wi, Wij, Wj, bi, bj, mu, goal, x, y):
    """Contact i holds, j slides or opens: (found, p_i, p_j, residual, direction of i, and of j, to go on from)."""
    Wji = _transposed(Wij)
    k = (Wi[0], Wi[1], Wi[2], Wi[4], Wi[5], Wi[8])
    s0 = solve_symmetric(k, (Wij[0], Wij[3], Wij[6]))
    s1 = solve_symmetric(k, (Wij[1], Wij[4], Wij[7]))
    s2 = solve_symmetric(k, (Wij[2], Wij[5], Wij[8]))
    h = solve_symmetric(k, bi)
    c0, c1, c2, ch = qt.matvec(Wji, s0), qt.matvec(Wji, s1), qt.matvec(Wji, s2), qt.matvec(Wji, h)
    W = (
        Wj[0] - c0[0], Wj[1] - c1[0], Wj[2] - c2[0],
        Wj[3] - c0[1], Wj[4] - c1[1], Wj[5] - c2[1],
        Wj[6] - c0[2], Wj[7] - c1[2], Wj[8] - c2[2],
    )  # fmt: skip
    b = (bj[0] - ch[0], bj[1] - ch[1], bj[2] - ch[2])
    what, pj, miss = solve_contact_block(W, b, mu, Wj[4] + Wj[8], goal, x, y, False)
    pi = (
        -h[0] - (s0[0] * pj[0] + s1[0] * pj[1] + s2[0] * pj[2]),
        -h[1] - (s0[1] * pj[0] + s1[1] * pj[1] + s2[1] * pj[2]),
        -h[2] - (s0[2] * pj[0] + s1[2] * pj[1] + s2[2] * pj[2]),
    )
    holds = pi[0] >= 0.0 and pi[1] * pi[1] + pi[2] * pi[2] <= (mu * pi[0]) * (mu * pi[0])
    found = what != CONTACT_UNSOLVED and holds
    xi, yi = friction_direction(-pi[1], -pi[2], mu)
    if what == CONTACT_SLIDES:
        x, y = pj[1] / pj[0], pj[2] / pj[0]
    return found, pi, pj, miss, xi, yi, x, y


@inlined
def _solve_both_sliding(W11, W12, W22, b1, b2, mu, x1, y1, x2, y2):
    """Two contacts that slide in given directions: (p_1, p_2, misses, what `_direction_newton_step` goes on with)."""
    a11, a12 = W11[0] + (W11[1] * x1 + W11[2] * y1), W12[0] + (W12[1] * x2 + W12[2] * y2)
    a21, a22 = W12[0] + (W12[3] * x1 + W12[6] * y1), W22[0] + (W22[1] * x2 + W22[2] * y2)
    s = 1.0 / (a11 * a22 - a12 * a21)
    p1, p2 = s * (a12 * b2[0] - a22 * b1[0]), s * (a21 * b1[0] - a11 * b2[0])
    # Tangential velocity of i per normal impulse of j, friction along with it.
    g11 = W11[3] + (W11[4] * x1 + W11[5] * y1), W11[6] + (W11[7] * x1 + W11[8] * y1)
    g12 = W12[3] + (W12[4] * x2 + W12[5] * y2), W12[6] + (W12[7] * x2 + W12[8] * y2)
    g21 = W12[1] + (W12[4] * x1 + W12[7] * y1), W12[2] + (W12[5] * x1 + W12[8] * y1)
    g22 = W22[3] + (W22[4] * x2 + W22[5] * y2), W22[6] + (W22[7] * x2 + W22[8] * y2)
    u1x, u1y = b1[1] + (g11[0] * p1 + g12[0] * p2), b1[2] + (g11[1] * p1 + g12[1] * p2)
    u2x, u2y = b2[1] + (g21[0] * p1 + g22[0] * p2), b2[2] + (g21[1] * p1 + g22[1] * p2)
    # All of what follows is μ times the true across, along and slopes, which the turns do not notice.
    along1, along2 = -(x1 * u1x + y1 * u1y), -(x2 * u2x + y2 * u2y)
    across1, across2 = y1 * u1x - x1 * u1y, y2 * u2x - x2 * u2y
    t = 1.0 / mu
    miss1 = sliding_residual(t * across1, t * along1, p1 * mu * (W11[4] + W11[8]))
    miss2 = sliding_residual(t * across2, t * along2, p2 * mu * (W22[4] + W22[8]))
    inverse = (s * a11, s * a12, s * a21, s * a22)
    return p1, p2, miss1, miss2, (inverse, g11, g12, g21, g22, along1, along2, across1, across2)


@inlined
def _direction_newton_step(W11, W12, W22, x1, y1, x2, y2, p1, p2, sliding):
    """Newton's step of both directions [rad]: turning direction 1 by dα changes (x1, y1) by (-y1, x1) dα."""
    inverse, g11, g12, g21, g22, along1, along2, across1, across2 = sliding
    a11, a12, a21, a22 = inverse
    # What a turn of direction 1 does to p, then to u; then the same of direction 2.
    f1, f2 = p1 * (W11[2] * x1 - W11[1] * y1), p1 * (W12[6] * x1 - W12[3] * y1)
    d1, d2 = a12 * f2 - a22 * f1, a21 * f1 - a11 * f2
    vx = g11[0] * d1 + g12[0] * d2 + p1 * (W11[5] * x1 - W11[4] * y1)
    vy = g11[1] * d1 + g12[1] * d2 + p1 * (W11[8] * x1 - W11[7] * y1)
    j11 = y1 * vx - x1 * vy - along1
    vx = g21[0] * d1 + g22[0] * d2 + p1 * (W12[7] * x1 - W12[4] * y1)
    vy = g21[1] * d1 + g22[1] * d2 + p1 * (W12[8] * x1 - W12[5] * y1)
    j21 = y2 * vx - x2 * vy
    f1, f2 = p2 * (W12[2] * x2 - W12[1] * y2), p2 * (W22[2] * x2 - W22[1] * y2)
    d1, d2 = a12 * f2 - a22 * f1, a21 * f1 - a11 * f2
    vx = g11[0] * d1 + g12[0] * d2 + p2 * (W12[5] * x2 - W12[4] * y2)
    vy = g11[1] * d1 + g12[1] * d2 + p2 * (W12[8] * x2 - W12[7] * y2)
    j12 = y1 * vx - x1 * vy
    vx = g21[0] * d1 + g22[0] * d2 + p2 * (W22[5] * x2 - W22[4] * y2)
    vy = g21[1] * d1 + g22[1] * d2 + p2 * (W22[8] * x2 - W22[7] * y2)
    j22 = y2 * vx - x2 * vy - along2
    s = 1.0 / (j11 * j22 - j12 * j21)
    return s * (j12 * across2 - j22 * across1), s * (j21 * across1 - j11 * across2)


@kernel
def _solve_alternately(W11, W12, W22, b1, b2, mu, goal, p, q, x1, y1, x2, y2):
    """Each contact answers the impulse of the other in turn, from impulses p and q on; then what it came to is tried.

    (found, p, q, residual, direction of the first, and of the second, to go on from). One of them was to hold or to
    open and does not, or turns right round: Newton's method would go on to where friction pushes it along.
    """
    W21, miss = _transposed(W12), 0.0
    first = second = CONTACT_SLIDES
    for _ in range(_SWEEPS_PER_ALTERNATION):
        first, p, miss = solve_contact_block(W11, _plus(b1, qt.matvec(W12, q)), mu, W11[4] + W11[8], goal, x1, y1, True)
        if p[0] > 0.0:
            x1, y1 = friction_direction(-p[1], -p[2], mu)
        second, q, miss = solve_contact_block(
            W22, _plus(b2, qt.matvec(W21, p)), mu, W22[4] + W22[8], goal, x2, y2, True
        )
        if q[0] > 0.0:
            x2, y2 = friction_direction(-q[1], -q[2], mu)
    found = False
    if first == CONTACT_STICKS and second == CONTACT_SLIDES:
        found, p, q, miss, x1, y1, x2, y2 = _solve_with_sticking(W11, W12, W22, b1, b2, mu, goal, x2, y2)
    elif first == CONTACT_SLIDES and second == CONTACT_STICKS:
        found, q, p, miss, x2, y2, x1, y1 = _solve_with_sticking(W22, W21, W11, b2, b1, mu, goal, x1, y1)
    return found, p, q, miss, x1, y1, x2, y2


@inlined
def solve_block_pair(W11, W12, W22, b1, b2, mu, goal, x1, y1, x2, y2):
    """Impulses of two contacts: (found, p_1, p_2, residual [m/s])."""
    W21 = _transposed(W12)
    held1 = held2 = opened = turns = 0
    for _ in range(_MAX_NEWTON_STEPS):
        is_stuck = False
        p1, p2, miss1, miss2, sliding = _solve_both_sliding(W11, W12, W22, b1, b2, mu, x1, y1, x2, y2)
        worst, q1, q2 = max(miss1, miss2), (p1, p1 * x1, p1 * y1), (p2, p2 * x2, p2 * y2)
        if not (p1 >= 0.0 and p2 >= 0.0):
            if p1 >= p2:
                found, q1, q2, worst, x1, y1, x2, y2 = _solve_with_open(W11, W21, b1, b2, mu, goal, x1, y1)
            else:
                found, q2, q1, worst, x2, y2, x1, y1 = _solve_with_open(W22, W12, b2, b1, mu, goal, x2, y2)
            if found:
                return True, q1, q2, worst
            is_stuck, opened = opened >= _MAX_RECLOSURES, opened + 1  # the open one closes: once more with both
        elif worst <= goal:
            return True, q1, q2, worst
        elif miss1 == math.inf and held1 < _MAX_STICK_TRIALS:
            held1 += 1
            found, q1, q2, worst, x1, y1, x2, y2 = _solve_with_sticking(W11, W12, W22, b1, b2, mu, goal, x2, y2)
            if found:
                return True, q1, q2, worst
        elif miss2 == math.inf and held2 < _MAX_STICK_TRIALS:
            held2 += 1
            found, q2, q1, worst, x2, y2, x1, y1 = _solve_with_sticking(W22, W21, W11, b2, b1, mu, goal, x1, y1)
            if found:
                return True, q1, q2, worst
        elif worst == math.inf:
            is_stuck = True
        else:
            turn1, turn2 = _direction_newton_step(W11, W12, W22, x1, y1, x2, y2, p1, p2, sliding)
            x1, y1 = rotate_direction(x1, y1, turn1)
            x2, y2 = rotate_direction(x2, y2, turn2)
        if is_stuck:
            if turns == _MAX_ALTERNATIONS:
                break
            found, q1, q2, worst, x1, y1, x2, y2 = _solve_alternately(
                W11, W12, W22, b1, b2, mu, goal, q1, q2, x1, y1, x2, y2
            )
            if found:
                return True, q1, q2, worst
            held1, held2, turns = 0, 0, turns + 1
    return False, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 0.0


@inlined
def contact_in_wall_frame(i, axes, u, w, work):
    """Coordinates of contact i, its velocity without impulses less its target, and its impulse so far.

    All (normal, tangents) in the stretched frame of the wall with these axes; u, w are the body's motion there. Without
    friction there are no impulses so far.
    """
    arm, ratio = (work.arm[i, 0], work.arm[i, 1], work.arm[i, 2]), friction_ratio(work)
    place = (ratio * qt.dot(axes[0], arm), ratio * qt.dot(axes[1], arm), qt.dot(axes[2], arm))
    f, impulse = point_velocity(place, u, w), (0.0, 0.0, 0.0)
    if work.mu > 0.0:
        impulse = (work.impulse[3 * i], work.impulse[3 * i + 1], work.impulse[3 * i + 2] / ratio)
    return place, (f[0] - work.target[i, 0], f[1] - work.target[i, 1], f[2] - ratio * work.target[i, 2]), impulse


@inlined
def solve_one_contact(first, mu, goal, inv_mass, K, work):
    """Impulse of a single contact, of `contact_in_wall_frame`: (found, impulse, moment, residual [m/s])."""
    r, b, impulse = first
    W = add_block_compliance(diagonal_delassus_block(r, inv_mass, friction_ratio(work), K), work)
    x = y = 0.0
    if mu > 0.0:
        f = qt.matvec(W, impulse)
        if is_warm_start_valid(f[0], -b[0]):
            x, y = friction_direction(b[1] + f[1], b[2] + f[2], mu)
    what, p, miss = solve_contact_block(W, b, mu, W[4] + W[8], goal, x, y, True)
    return what != CONTACT_UNSOLVED, p, qt.cross(r, p), miss


@inlined
def _frictionless_response(W11, W12, W22, b1, b2):
    """Changes of velocity, by impulses without friction, of two contacts that approach with b1 and b2 (< 0) [m/s]."""
    s = 1.0 / (W11[0] * W22[0] - W12[0] * W12[0])
    p1, p2 = s * (W12[0] * b2 - W22[0] * b1), s * (W12[0] * b1 - W11[0] * b2)
    if p1 < 0.0:
        p1, p2 = 0.0, -b2 / W22[0]
    elif p2 < 0.0:
        p1, p2 = -b1 / W11[0], 0.0
    return (
        (W11[0] * p1 + W12[0] * p2, W11[3] * p1 + W12[3] * p2, W11[6] * p1 + W12[6] * p2),
        (W12[0] * p1 + W22[0] * p2, W12[1] * p1 + W22[3] * p2, W12[2] * p1 + W22[6] * p2),
    )


@inlined
def solve_two_contacts(first, second, mu, goal, inv_mass, K, work):
    """Impulses of two contacts (see `contact_in_wall_frame`).

    Returns
    -------
    found : bool
    p, q : tuples of 3 floats
        Of the first and of the second [N s].
    moment : tuple of 3 floats
        Of both.
    residual : float
        [m/s].
    """
    (r, b1, f), (s, b2, g) = first, second
    ratio = friction_ratio(work)
    W11, W22 = (
        add_block_compliance(diagonal_delassus_block(r, inv_mass, ratio, K), work),
        add_block_compliance(diagonal_delassus_block(s, inv_mass, ratio, K), work),
    )
    W12 = delassus_block(r, s, inv_mass, ratio, K)
    x1 = y1 = x2 = y2 = 0.0
    if mu > 0.0:
        u1 = _plus(qt.matvec(W11, f), qt.matvec(W12, g))
        u2 = _plus(qt.matvec(W22, g), qt.matvec(_transposed(W12), f))
        if not (is_warm_start_valid(u1[0], -b1[0]) and is_warm_start_valid(u2[0], -b2[0])):
            u1, u2 = _frictionless_response(W11, W12, W22, b1[0], b2[0])
        x1, y1 = friction_direction(b1[1] + u1[1], b1[2] + u1[2], mu)
        x2, y2 = friction_direction(b2[1] + u2[1], b2[2] + u2[2], mu)
    found, p, q, miss = solve_block_pair(W11, W12, W22, b1, b2, mu, goal, x1, y1, x2, y2)
    return found, p, q, _plus(qt.cross(r, p), qt.cross(s, q)), miss
