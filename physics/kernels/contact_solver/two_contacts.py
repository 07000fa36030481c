"""Solve one or two contacts of one wall in every mixture of sticking, sliding and opening, without a Delassus matrix.

Two sliding contacts have two unknown directions. For given directions the normal impulses follow from a 2 x 2 system,
by which both normal velocities meet their targets. Newton's method turns both directions at once, until no velocity is
left across them. (`one_contact` does the same for a single contact.)

A contact whose direction would reverse sticks instead. Its impulse responds to that of the other contact,
p_i = -W_ii⁻¹ (b_i + W_ij p_j). So the other contact is a single contact with the block W_jj - W_ji W_ii⁻¹ W_ij. If p_i
is outside its friction cone, contact i slides, opposite to the tangential part of p_i; the search goes on with this
direction.
"""

from __future__ import annotations

import math

from physics.compiler.decorators import inlined, kernel
from physics.kernels.contact_law.anisotropic_friction import friction_ratio
from physics.kernels.contact_law.compliance import add_block_compliance
from physics.kernels.contact_solver.contact_pair import (
    PairProblem,
    PairTrial,
    SlidingPair,
    swap_pair_problem,
    swap_pair_trial,
    transpose_block,
)
from physics.kernels.contact_solver.impulse_distribution import solve_symmetric
from physics.kernels.contact_solver.one_contact import (
    CONTACT_SLIDES,
    CONTACT_STICKS,
    CONTACT_UNSOLVED,
    delassus_block,
    diagonal_delassus_block,
    friction_direction,
    is_warm_start_valid,
    rotate_direction,
    sliding_residual,
    solve_contact_block,
)
from physics.kernels.math import quaternion as qt

# Largest number of Newton steps. Two are usual at a tolerance of 1e-6.
_MAX_NEWTON_STEPS = 12

# Largest number of trials with a sticking contact, and of new trials with both contacts after an open one has closed.
_MAX_STICK_TRIALS = 2
_MAX_RECLOSURES = 1

# If all these trials fail, the contacts are solved in turn: largest number of such attempts, and sweeps of each.
_MAX_ALTERNATIONS = 2
_SWEEPS_PER_ALTERNATION = 8


@inlined
def _plus(p, q):
    return p[0] + q[0], p[1] + q[1], p[2] + q[2]


@kernel
def _solve_with_open(pair, direction):
    """Try to solve a `PairProblem` with the second contact open: the `PairTrial` of the first contact alone.

    `direction` is a first guess of the friction -μ d of the first contact.
    """
    Wi, bi, mu, goal = pair.W11, pair.b1, pair.mu, pair.goal
    x, y = direction
    what, p, miss = solve_contact_block(Wi, bi, mu, Wi[4] + Wi[8], goal, x, y, True)
    uj = _plus(pair.b2, qt.matvec(transpose_block(pair.W12), p))
    if what == CONTACT_SLIDES:
        x, y = p[1] / p[0], p[2] / p[0]
    elif what == CONTACT_STICKS:
        x, y = friction_direction(-p[1], -p[2], mu)
    second, found = friction_direction(uj[1], uj[2], mu), what != CONTACT_UNSOLVED and uj[0] >= -goal
    return PairTrial(found, p, (0.0, 0.0, 0.0), max(miss, -uj[0]), (x, y), second)


@kernel
def _solve_with_sticking(pair, direction):
    """Try to solve a `PairProblem` with the first contact sticking, and the second one sliding or open: a `PairTrial`.

    `direction` is a first guess of the friction -μ d of the second contact.
    """
    Wi, Wij, Wj, bi, bj, mu, goal = pair
    Wji = transpose_block(Wij)
    x, y = direction
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
    if what == CONTACT_SLIDES:
        x, y = pj[1] / pj[0], pj[2] / pj[0]
    return PairTrial(found, pi, pj, miss, friction_direction(-pi[1], -pi[2], mu), (x, y))


@inlined
def _solve_both_sliding(pair, first, second):
    """Solve a `PairProblem` for the normal impulses of two contacts that slide in given directions: a `SlidingPair`.

    `first` and `second` are their frictions -μ d per normal impulse, with the directions d of sliding.
    """
    W11, W12, W22, b1, b2, mu, _ = pair
    (x1, y1), (x2, y2) = first, second
    a11, a12 = W11[0] + (W11[1] * x1 + W11[2] * y1), W12[0] + (W12[1] * x2 + W12[2] * y2)
    a21, a22 = W12[0] + (W12[3] * x1 + W12[6] * y1), W22[0] + (W22[1] * x2 + W22[2] * y2)
    s = 1.0 / (a11 * a22 - a12 * a21)
    p1, p2 = s * (a12 * b2[0] - a22 * b1[0]), s * (a21 * b1[0] - a11 * b2[0])
    g11 = W11[3] + (W11[4] * x1 + W11[5] * y1), W11[6] + (W11[7] * x1 + W11[8] * y1)
    g12 = W12[3] + (W12[4] * x2 + W12[5] * y2), W12[6] + (W12[7] * x2 + W12[8] * y2)
    g21 = W12[1] + (W12[4] * x1 + W12[7] * y1), W12[2] + (W12[5] * x1 + W12[8] * y1)
    g22 = W22[3] + (W22[4] * x2 + W22[5] * y2), W22[6] + (W22[7] * x2 + W22[8] * y2)
    u1x, u1y = b1[1] + (g11[0] * p1 + g12[0] * p2), b1[2] + (g11[1] * p1 + g12[1] * p2)
    u2x, u2y = b2[1] + (g21[0] * p1 + g22[0] * p2), b2[2] + (g21[1] * p1 + g22[1] * p2)
    # All numbers from here on are μ times the true across, along and slopes; the turns are quotients of them.
    along1, along2 = -(x1 * u1x + y1 * u1y), -(x2 * u2x + y2 * u2y)
    across1, across2 = y1 * u1x - x1 * u1y, y2 * u2x - x2 * u2y
    t = 1.0 / mu
    miss1 = sliding_residual(t * across1, t * along1, p1 * mu * (W11[4] + W11[8]))
    miss2 = sliding_residual(t * across2, t * along2, p2 * mu * (W22[4] + W22[8]))
    inverse = (s * a11, s * a12, s * a21, s * a22)
    return SlidingPair(p1, p2, miss1, miss2, inverse, g11, g12, g21, g22, along1, along2, across1, across2)


@inlined
def _direction_newton_step(pair, first, second, sliding):
    """Newton step of both sliding directions: two angles [rad], from the `SlidingPair` of the present directions.

    `first` = (x1, y1) and `second` are the frictions -μ d per normal impulse of the two contacts of the `PairProblem`.
    Turning direction 1 by dα changes (x1, y1) by (-y1, x1) dα.
    """
    W11, W12, W22, _, _, _, _ = pair
    p1, p2, _, _, inverse, g11, g12, g21, g22, along1, along2, across1, across2 = sliding
    (x1, y1), (x2, y2) = first, second
    a11, a12, a21, a22 = inverse
    # Change of p, then of u, per turn of direction 1; then the same for direction 2.
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
def _solve_alternately(pair, trial):
    """Solve each contact of a pair in turn, with the other's impulse fixed, starting from `trial`: a `PairTrial`.

    If one contact sticks and the other slides at the end, this mixture is tried. The kernel is called if a contact that
    was assumed to stick or open does not, or if a sliding direction would reverse. Newton's method would then go on to
    a state in which friction pushes the contact along.
    """
    W11, W12, W22, b1, b2, mu, goal = pair
    _, p, q, miss, (x1, y1), (x2, y2) = trial
    W21 = transpose_block(W12)
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
    if first == CONTACT_STICKS and second == CONTACT_SLIDES:
        return _solve_with_sticking(pair, (x2, y2))
    if first == CONTACT_SLIDES and second == CONTACT_STICKS:
        return swap_pair_trial(_solve_with_sticking(swap_pair_problem(pair), (x1, y1)))
    return PairTrial(False, p, q, miss, (x1, y1), (x2, y2))


@inlined
def _turn_directions(pair, trial, sliding):
    """Return the `PairTrial` `trial` with both sliding directions turned by a Newton step."""
    (x1, y1), (x2, y2) = trial.first, trial.second
    turn1, turn2 = _direction_newton_step(pair, trial.first, trial.second, sliding)
    first, second = rotate_direction(x1, y1, turn1), rotate_direction(x2, y2, turn2)
    return PairTrial(False, trial.p, trial.q, trial.miss, first, second)


@inlined
def _try_sliding(sliding, first, second, goal):
    """Make the `PairTrial` of a `SlidingPair`; it is found if both contacts push, with residuals within `goal` [m/s].

    `first` and `second` are their frictions -μ d per normal impulse, with the directions d of sliding.
    """
    p1, p2, (x1, y1), (x2, y2) = sliding.p1, sliding.p2, first, second
    worst = max(sliding.miss1, sliding.miss2)
    found = p1 >= 0.0 and p2 >= 0.0 and worst <= goal
    return PairTrial(found, (p1, p1 * x1, p1 * y1), (p2, p2 * x2, p2 * y2), worst, first, second)


@inlined
def solve_block_pair(pair, first, second):
    """Solve a `PairProblem`: its `PairTrial`, from first guesses of the friction -μ d of both contacts."""
    swapped = swap_pair_problem(pair)
    held1 = held2 = opened = turns = 0
    for _ in range(_MAX_NEWTON_STEPS):
        is_stuck = False
        sliding = _solve_both_sliding(pair, first, second)
        trial = _try_sliding(sliding, first, second, pair.goal)
        if trial.found:
            return trial
        if not (sliding.p1 >= 0.0 and sliding.p2 >= 0.0):
            if sliding.p1 >= sliding.p2:
                trial = _solve_with_open(pair, first)
            else:
                trial = swap_pair_trial(_solve_with_open(swapped, second))
            is_stuck, opened = opened >= _MAX_RECLOSURES, opened + 1  # the open one closes: once more with both
        elif sliding.miss1 == math.inf and held1 < _MAX_STICK_TRIALS:
            held1 += 1
            trial = _solve_with_sticking(pair, second)
        elif sliding.miss2 == math.inf and held2 < _MAX_STICK_TRIALS:
            held2 += 1
            trial = swap_pair_trial(_solve_with_sticking(swapped, first))
        elif trial.miss == math.inf:
            is_stuck = True
        else:
            trial = _turn_directions(pair, trial, sliding)
        if is_stuck and not trial.found:
            if turns == _MAX_ALTERNATIONS:
                break
            trial = _solve_alternately(pair, trial)
            held1, held2, turns = 0, 0, turns + 1
        if trial.found:
            return trial
        first, second = trial.first, trial.second
    return PairTrial(False, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 0.0, first, second)


@inlined
def solve_one_contact(contact, mu, goal, body, scratch):
    """Solve a single `WallContact`: (found, impulse [N s], moment [N m s], residual [m/s]).

    mu is the coefficient of friction, `goal` the tolerance of the residual [m/s], and `body` a `FreeBody`. Impulse and
    moment have the components (normal, tangents).
    """
    r, b, impulse = contact
    W = add_block_compliance(
        diagonal_delassus_block(r, body.inv_mass, friction_ratio(scratch.body), body.K), scratch.body
    )
    x = y = 0.0
    if mu > 0.0:
        f = qt.matvec(W, impulse)
        if is_warm_start_valid(f[0], -b[0]):
            x, y = friction_direction(b[1] + f[1], b[2] + f[2], mu)
    what, p, miss = solve_contact_block(W, b, mu, W[4] + W[8], goal, x, y, True)
    return what != CONTACT_UNSOLVED, p, qt.cross(r, p), miss


@inlined
def _frictionless_response(pair):
    """Changes of the velocities of two contacts [m/s] by the impulses that solve their problem without friction."""
    W11, W12, W22 = pair.W11, pair.W12, pair.W22
    b1, b2 = pair.b1[0], pair.b2[0]
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
def solve_two_contacts(first, second, mu, goal, body, scratch):
    """Solve two contacts of one wall.

    Parameters
    ----------
    first, second : WallContact
        The two contacts.
    mu : float
        Coefficient of friction.
    goal : float
        Tolerance of the residual [m/s].
    body : FreeBody
        The body without contact impulses.

    Returns
    -------
    found : bool
        True if the impulses solve the problem.
    p, q : tuples of 3 floats
        Impulses (normal, tangents) of the first and of the second contact [N s].
    moment : tuple of 3 floats
        Sum of their moments about the centre of mass [N m s].
    residual : float
        Residual [m/s].
    """
    (r, b1, f), (s, b2, g) = first, second
    inv_mass, K, ratio = body.inv_mass, body.K, friction_ratio(scratch.body)
    W11, W22 = (
        add_block_compliance(diagonal_delassus_block(r, inv_mass, ratio, K), scratch.body),
        add_block_compliance(diagonal_delassus_block(s, inv_mass, ratio, K), scratch.body),
    )
    W12 = delassus_block(r, s, inv_mass, ratio, K)
    pair, directions = PairProblem(W11, W12, W22, b1, b2, mu, goal), ((0.0, 0.0), (0.0, 0.0))
    if mu > 0.0:
        u1 = _plus(qt.matvec(W11, f), qt.matvec(W12, g))
        u2 = _plus(qt.matvec(W22, g), qt.matvec(transpose_block(W12), f))
        if not (is_warm_start_valid(u1[0], -b1[0]) and is_warm_start_valid(u2[0], -b2[0])):
            u1, u2 = _frictionless_response(pair)
        directions = (
            friction_direction(b1[1] + u1[1], b1[2] + u1[2], mu),
            friction_direction(b2[1] + u2[1], b2[2] + u2[2], mu),
        )
    trial = solve_block_pair(pair, directions[0], directions[1])
    return trial.found, trial.p, trial.q, _plus(qt.cross(r, trial.p), qt.cross(s, trial.q)), trial.miss
