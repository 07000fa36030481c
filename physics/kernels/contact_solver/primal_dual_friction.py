"""Solve the friction of a patch in which some contacts stick, by a primal-dual Newton's method.

It is used where sliding directions would reverse. If a contact stops or nearly stops, its direction is not defined. So
the unknowns are the planar motion τ of the body and, for each contact, a vector z with |z| <= 1 that gives its friction
-μ p z. They obey z |u| = u: a sliding contact has z = d, the unit vector of its slip u, and a sticking contact has
u = 0 and any z in the disc. Linearised about both unknowns, with d = u/|u|,

    z' = (u + A δu)/|u|,   A = 1 - z dᵀ,   δu_i = G_i Δ,
    (1 + C H) Δ = δ - C Σ μ p_i G_iᵀ (d_i - z_i),   H = Σ κ_i G_iᵀ A_i G_i,   κ = μ p/|u|.

Δ is the step of τ, and δ the difference between the planar motion to which the impulses lead and τ. C is
`patch_algebra.planar_compliance`, and G_i τ the velocity of contact i.

- With z = d this is the step of `sliding_patch`.
- With A = 1 it is a *viscous* step, one of Weiszfeld's: friction acts as a viscous drag, which slows a contact that
  stops. It is made where a direction would reverse. Afterwards z of a stopping contact is within the disc.
- When the slip of a sticking contact is lost in rounding, u/|u| is undefined. Then z' = z + (u + δu)/s with a small
  speed s, on which the solution does not depend.

A motion about one sticking contact needs five or six rounds.

References
----------
.. [1] T. F. Chan, G. H. Golub, P. Mulet, *A nonlinear primal-dual method for total variation-based image restoration*,
   1999.
.. [2] K. D. Andersen, E. Christiansen, A. R. Conn, M. L. Overton, *An efficient primal-dual interior-point method for
   minimizing a sum of Euclidean norms*, 2000. Theirs are fixed weights; here μ p_i depends on the directions
   (`sliding_patch`).
"""

from __future__ import annotations

import math
from typing import NamedTuple

from physics.compiler.decorators import inlined, kernel
from physics.compiler.simd import Lanes, first_true_lane, lane_sqrt, lane_sum, larger, max_of_lanes, select_lanes
from physics.kernels.contact_solver.one_contact import inverse_root
from physics.kernels.contact_solver.patch import PatchFriction
from physics.kernels.contact_solver.patch_algebra import (
    has_turned_far,
    patch_normal_impulses,
    patch_slip_velocities,
    planar_compliance,
    planar_motion_after,
    solve_normal_slopes,
)
from physics.kernels.math import quaternion as qt

# Largest number of rounds.
_MAX_DUAL_ROUNDS = 24

# A slip below this share of the tolerance has no direction.
_NO_DIRECTION_SHARE = 1.0e-3

# The speed s, as a share of the largest free contact speed. For a smaller slip u/|u| has a large error by rounding, and
# so would the impulses.
_REGULARISATION_SHARE = 1.0e-7

# A contact counts as sliding if its friction is at least this share of μ p.
_FULL_FRICTION_SHARE = 0.999999

# Results of a round.
ROUND_FAILED, ROUND_SOLVED, ROUND_PULLS = range(3)


class PatchRound(NamedTuple):
    """Result of one round of `sliding_patch`, or of all rounds of `solve_stick_slip_patch`.

    Attributes
    ----------
    what : int
        `ROUND_SOLVED`; `ROUND_PULLS`, if the contact `loser` would have to pull; `ROUND_FAILED`; or one of the ROUND_
        codes of `sliding_patch`.
    loser : int
        The contact that would have to pull most, or -1.
    p : lanes
        Normal impulses [N s].
    x, y : lanes
        Impulses along the tangents per normal impulse.
    exerted : tuple of 5 floats
        Sums of the impulses along the tangents [N s], and of the moments [N m s].
    miss : float
        Residual [m/s].
    motion : tuple of 3 floats
        Planar motion of the next round (v_a, v_b, ω_n) [m/s, rad/s].
    """

    what: int
    loser: int
    p: Lanes
    x: Lanes
    y: Lanes
    exerted: tuple
    miss: float
    motion: tuple


class SlipLimits(NamedTuple):
    """Speeds that take the place of smaller slips, whose directions are undefined.

    Attributes
    ----------
    tiny : float
        Smallest slip of a contact that slides [m/s].
    slow : float
        Smallest slip of a contact that sticks: the speed s of the module docstring [m/s].
    """

    tiny: float
    slow: float


@inlined
def solve_planar_step(compliance, h, r):
    """Solve (1 + C H) Δ = r for the step Δ of the planar motion (v_a, v_b, ω_n), by Cramer's rule.

    `compliance` is C and h is H, each nine numbers row by row.
    """
    c0, c1, c2, c3, c4, c5, c6, c7, c8 = compliance
    h00, h01, h02, h10, h11, h12, h20, h21, h22 = h
    x = (
        1.0 + (c0 * h00 + c1 * h10 + c2 * h20),
        c3 * h00 + c4 * h10 + c5 * h20,
        c6 * h00 + c7 * h10 + c8 * h20,
    )
    y = (
        c0 * h01 + c1 * h11 + c2 * h21,
        1.0 + (c3 * h01 + c4 * h11 + c5 * h21),
        c6 * h01 + c7 * h11 + c8 * h21,
    )
    z = (
        c0 * h02 + c1 * h12 + c2 * h22,
        c3 * h02 + c4 * h12 + c5 * h22,
        1.0 + (c6 * h02 + c7 * h12 + c8 * h22),
    )
    yz = qt.cross(y, z)
    s = 1.0 / qt.dot(x, yz)
    return s * qt.dot(yz, r), s * qt.dot(qt.cross(z, x), r), s * qt.dot(qt.cross(x, y), r)


@inlined
def _friction_residual(mobility, p, friction, mu, after):
    """Largest tangential residual of a patch [m/s], with normal impulses p and their `PatchFriction`.

    `after` are the slips u to which the impulses lead, and `mobility` is W = W_aa + W_bb of each contact. The residual
    is the natural map of Coulomb's disc, |f - P(f - u/W)| W for the tangential impulse f, where P projects onto the
    disc |f| <= μ p. As W is at least 1/ρ_t, it bounds the residual of `gauss_seidel`.
    """
    if not mu > 0.0:
        return 0.0
    x, y = friction.x, friction.y
    load, (ua, ub) = mu * p, after
    fa, fb = mobility * (p * x), mobility * (p * y)
    ka, kb, load = fa - ua, fb - ub, mobility * load
    square = ka * ka + kb * kb
    share = select_lanes(square > load * load, load * inverse_root(square), 1.0)
    da, db = fa - share * ka, fb - share * kb
    square = select_lanes(p > 0.0, da * da + db * db, 0.0)
    return math.sqrt(max_of_lanes(larger(0.0, square)))


@inlined
def _newton_step(patch, load, d, size, gain, taken, compliance, delta):
    """Newton step of the primal-dual method: the step Δ of the planar motion, and the changes δu of the slips.

    The friction z' = z + gain + A δu/size, with A = 1 - `taken` dᵀ, is substituted. `load` is μ p, `size` the slips'
    size |u| or the speed s, `compliance` C, and `delta` δ of the module docstring.
    """
    _, a, b = patch.points
    (da, db), (ta, tb) = d, taken
    fa, fb = load * gain[0], load * gain[1]
    f0, f1, f2 = lane_sum(fa), lane_sum(fb), lane_sum(a * fb - b * fa)
    c0, c1, c2, c3, c4, c5, c6, c7, c8 = compliance
    r = (
        delta[0] - (c0 * f0 + c1 * f1 + c2 * f2),
        delta[1] - (c3 * f0 + c4 * f1 + c5 * f2),
        delta[2] - (c6 * f0 + c7 * f1 + c8 * f2),
    )
    k = load / size
    tn, dn = a * tb - b * ta, a * db - b * da  # Gᵀ taken and Gᵀ d, about the normal
    ka, kb, kn = k * ta, k * tb, k * tn
    h = (
        lane_sum(k - ka * da), -lane_sum(ka * db), -lane_sum(k * b + ka * dn),
        -lane_sum(kb * da), lane_sum(k - kb * db), lane_sum(k * a - kb * dn),
        -lane_sum(k * b + kn * da), lane_sum(k * a - kn * db), lane_sum(k * (a * a + b * b) - kn * dn),
    )  # fmt: skip
    step = solve_planar_step(compliance, h, r)
    return step, (step[0] - step[2] * b, step[1] + step[2] * a)


@inlined
def _next_friction(u, d, size, z, gain, taken, change, slides, tiny):
    """Friction z' of the next round (two lanes), after a step that changes the slips u by `change`.

    It is z + gain + A δu/size of `_newton_step`. Contacts that slide (`slides`), or whose z' is outside the disc in
    about the direction of their new slip u', get u'/|u'|. Other z' outside the disc are shortened to length 1.
    """
    s = d[0] * change[0] + d[1] * change[1]
    za = z[0] + (gain[0] + (change[0] - taken[0] * s) / size)
    zb = z[1] + (gain[1] + (change[1] - taken[1] * s) / size)
    ua, ub = u[0] + change[0], u[1] + change[1]
    long, fast = lane_sqrt(za * za + zb * zb), larger(lane_sqrt(ua * ua + ub * ub), tiny)
    slides = slides | ((long >= 1.0) & (ua * za + ub * zb > 0.5 * fast * long))
    long = larger(long, 1.0)
    return select_lanes(slides, ua / fast, za / long), select_lanes(slides, ub / fast, zb / long)


@kernel
def take_viscous_step(problem, on, p, friction, compliance, delta):
    """Make a viscous step, with A = 1, from contacts that all slide.

    p are normal impulses, `friction` is their `PatchFriction`. Returns the step of the planar motion, and lanes x and y
    with the tangential impulses per normal impulse after it.
    """
    patch, mu, goal = problem.patch, problem.mu, problem.goal
    size, s = larger(friction.speed, _NO_DIRECTION_SHARE * goal), -1.0 / mu
    d, none = (s * friction.x, s * friction.y), Lanes(0.0, 0.0, 0.0, 0.0)
    zero = none, none
    step, change = _newton_step(patch, mu * p, d, size, zero, zero, compliance, delta)
    u, slides = (size * d[0], size * d[1]), ~has_turned_far(on, d, size, change)
    za, zb = _next_friction(u, d, size, d, zero, zero, change, slides, _NO_DIRECTION_SHARE * goal)
    return step, -mu * on * za, -mu * on * zb


@inlined
def _primal_dual_step(problem, on, p, friction, u, compliance, delta, limits):
    """Make one step of the primal-dual method from `friction` (`PatchFriction`) and the slips u [m/s].

    If a sliding direction would reverse, the step is a viscous one.

    Returns
    -------
    step : tuple of 3 floats
        Step of the planar motion.
    x, y : lanes
        Impulses along the tangents per normal impulse after the step.
    is_settled : bool
        True if no direction would have reversed.
    """
    patch, mu, speed, (tiny, slow) = problem.patch, problem.mu, friction.speed, limits
    z, load, none = (friction.x / -mu, friction.y / -mu), mu * p, Lanes(0.0, 0.0, 0.0, 0.0)
    is_full = z[0] * z[0] + z[1] * z[1] >= _FULL_FRICTION_SHARE * _FULL_FRICTION_SHARE
    size = larger(speed, select_lanes(is_full, tiny, slow))
    d = u[0] / size, u[1] / size
    is_stuck = ~is_full & (speed < slow)
    gain = d[0] - select_lanes(is_stuck, 0.0, z[0]), d[1] - select_lanes(is_stuck, 0.0, z[1])
    taken = select_lanes(is_stuck, 0.0, z[0]), select_lanes(is_stuck, 0.0, z[1])
    step, change = _newton_step(patch, load, d, size, gain, taken, compliance, delta)
    has_turned = is_full & has_turned_far(on, d, size, change)
    is_settled = first_true_lane(has_turned) < 0
    if not is_settled:
        taken = none, none
        step, change = _newton_step(patch, load, d, size, gain, taken, compliance, delta)
    za, zb = _next_friction(u, d, size, z, gain, taken, change, is_full & ~has_turned, tiny)
    return step, -mu * on * za, -mu * on * zb, is_settled


@kernel
def solve_stick_slip_patch(patient, on, x, y, problem, normal, motion, scratch):
    """Solve a patch in which some pushing contacts stick, and the others slide.

    Parameters
    ----------
    patient : bool
        True: a contact that would pull stays among the pushing ones while directions still turn, until the residual is
        at most `problem.loose`. False: the method ends with `ROUND_PULLS` at once.
    on : lanes
        1 for contacts that push, 0 for open ones.
    x, y : lanes
        First guess of the impulses along the tangents per normal impulse, -μ z.
    problem : PatchProblem
        The contact problem.
    normal : NormalMotion
        Normal motion of the contacts that push.
    motion : tuple of 3 floats
        First guess of the planar motion (v_a, v_b, ω_n).

    Returns
    -------
    PatchRound
        Its `what` is `ROUND_SOLVED`, `ROUND_PULLS` or `ROUND_FAILED`.
    """
    patch, mu, goal, may_open = problem.patch, problem.mu, problem.goal, not patient
    limits = SlipLimits(_NO_DIRECTION_SHARE * goal, _REGULARISATION_SHARE * goal / scratch.settings.tolerance)
    for _ in range(_MAX_DUAL_ROUNDS):
        slip = patch_slip_velocities(patch, motion, normal)
        friction = PatchFriction(x, y, lane_sqrt(slip[0] * slip[0] + slip[1] * slip[1]))
        slopes, turning = solve_normal_slopes(patch, on, normal, friction, problem.body.K)
        _, loser, p, exerted = patch_normal_impulses(patch, on, normal, slopes, friction)
        if loser >= 0 and may_open:
            return PatchRound(ROUND_PULLS, loser, p, x, y, exerted, 0.0, motion)
        led_to = planar_motion_after(exerted, problem.body, scratch)
        miss = _friction_residual(patch.mobility, p, friction, mu, patch_slip_velocities(patch, led_to, normal))
        if loser < 0 and miss <= goal:
            return PatchRound(ROUND_SOLVED, -1, p, x, y, exerted, miss, motion)
        delta = led_to[0] - motion[0], led_to[1] - motion[1], led_to[2] - motion[2]
        compliance = planar_compliance(problem, normal, friction, turning, scratch.body)
        step, x, y, is_settled = _primal_dual_step(problem, on, p, friction, slip, compliance, delta, limits)
        may_open = not patient or (is_settled and miss <= problem.loose)
        motion = motion[0] + step[0], motion[1] + step[1], motion[2] + step[2]
    return PatchRound(ROUND_FAILED, -1, x, x, y, (0.0, 0.0, 0.0, 0.0, 0.0), 0.0, motion)
