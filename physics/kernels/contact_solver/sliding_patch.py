"""A patch of contacts that slide: their impulses from a few small linear systems, without a Delassus matrix.

A sliding contact has the impulse p_i (n - μ d_i) along the direction d_i = u_t/|u_t| of its own sliding (u_t
less what is asked of it). Given the directions, "every normal velocity is on target" is linear in the
normal impulses; given the impulses so are the velocities, and these give new directions. What remains is to
turn a few unit vectors the right way.

In the frame (n, a, b) of the wall the normal velocity of a point is affine in its coordinates,
u_n = v_n + ω_a b - ω_b a. Three contacts that are not on a line therefore fix v_n, ω_a and ω_b beforehand,
and with them the sum of the normal impulses. Of all normal impulses with the right sum and moments the affine
ones, p_i = y_0 + y_1 a_i + y_2 b_i about the centroid, have the least norm (a symmetric patch has symmetric
impulses); y_0 follows from the sum, y_1 and y_2 from ω_a and ω_b (2 x 2). Left over is the planar motion τ =
(v_a, v_b, ω_n).

With the directions of τ the impulses lead to τ + δ(τ); sought is δ = 0. When τ turns a direction, the
friction of contact i changes across it like a drag of coefficient κ_i = μ p_i / |u_i|: with e_i = n x d_i,
h_i = (e_i, r_i x e_i),

    δ(τ + Δ) = δ(τ) - (1 + C H) Δ,    H = Σ κ_i h_i h_iᵀ,

where C is the planar compliance of the body while y_1 and y_2 go on holding ω_a and ω_b. That is Newton's
method (the contacts are taken to be equally far from the centre of mass along n here, which is so to a few
slops). Where the impulses are those of the directions of τ, the velocity across direction i is h_i·δ exactly,
so the residual is measured, not estimated: |h_i·δ| s/(s + |u|) with s = μ p_i (W_aa + W_bb), no less than the
natural map of `gauss_seidel`.

Where a step would turn a direction right round some contacts stop, or hold: their impulses, not their directions, are
what is sought then (`primal_dual_friction`).

A contact that would have to pull opens, the one that pulls most first, or two of four at once (the block tips over an
edge); the fit of the targets says whether it then separates fast enough. One that would close while the others push
pushes again, once; where three push and it hardly closes, not before these are solved. Without friction the first
linear system is the solution.

All begins with the motion that the impulses of the last step lead to, and with themselves where some contacts held; or,
where they are of other loads, with `patch_start.cold_start_motion`.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from physics.compiler.decorators import inlined
from physics.compiler.simd import Lanes, first_true_lane, lane_sum, larger, max_of_lanes, select_lanes
from physics.kernels.contact_solver.contact_pair import contact_in_wall_frame
from physics.kernels.contact_solver.patch_algebra import (
    fit_normal_motion,
    has_small_turns,
    normal_motion_about,
    normal_velocity_excess,
    patch_centroid,
    patch_friction_directions,
    patch_normal_impulses,
    patch_sliding_residual,
    patch_slip_velocities,
    planar_compliance,
    planar_motion_after,
    solve_normal_slopes,
)
from physics.kernels.contact_solver.patch_start import warm_start_friction
from physics.kernels.contact_solver.primal_dual_friction import (
    ROUND_FAILED,
    ROUND_PULLS,
    ROUND_SOLVED,
    PatchRound,
    solve_planar_step,
    solve_stick_slip_patch,
    take_viscous_step,
)
from physics.kernels.contact_solver.two_contacts import solve_two_contacts
from physics.kernels.math.simd_gather import select_lane, valid_lanes_mask

# Linear solves of one attempt at most. Two are usual at a tolerance of 1e-6, each contact that opens costs
# one more.
_MAX_PATCH_SOLVES = 16

# What to try first (`stage.mode`): all hold, all slide, or some of both.
TRY_STICKING, TRY_SLIDING, TRY_MIXED = range(3)

# What a round comes to, beside `primal_dual_friction.ROUND_FAILED`, `ROUND_SOLVED` and `ROUND_PULLS`.
ROUND_CONTINUES, ROUND_TIPS, ROUND_REVERSES = range(3, 6)


class PatchSolution(NamedTuple):
    """Impulses of a patch.

    Attributes
    ----------
    found : bool
        Whether they solve the problem.
    impulses : tuple of 3 lanes
        Of each contact (normal, tangents) [N s].
    exerted : tuple of 5 floats
        Their sums along the tangents [N s], and moments [N m s].
    push : float
        Sum of the normal impulses [N s].
    residual : float
        [m/s].
    """

    found: bool
    impulses: tuple
    exerted: tuple
    push: float
    residual: float


class PushingContacts(NamedTuple):
    """Contacts of a patch that push.

    Attributes
    ----------
    count : int
        Number of them.
    on : lanes
        1 for each of them, 0 for an open contact.
    is_back : lanes
        1 for a contact that was open before and closed again, else 0.
    """

    count: int
    on: Lanes
    is_back: Lanes


class NormalChoice(NamedTuple):
    """Normal motion chosen for the contacts that push.

    Attributes
    ----------
    ok : bool
        Whether it meets their targets, and no open contact closes faster than `PatchProblem.loose`.
    closing : int
        The open contact that closes fastest, by more than the goal, or -1.
    is_even : bool
        Whether it meets the targets of four contacts within the goal. Then it does whichever of them push; three that
        met theirs to the letter would have the fourth off by four times as much, and it would push again for nothing.
    motion : tuple of 3 floats
        (v_n, ω_a, ω_b) [m/s, rad/s].
    """

    ok: bool
    closing: int
    is_even: bool
    motion: tuple


@inlined
def _fit_pushing_contacts(pushing, problem):
    """Choose the contacts that push, and their normal motion.

    Four targets may belong to no rigid motion. Then three contacts meet their targets, and one opens that is then
    faster than its target. A rectangle has two such choices; the contact that approaches less opens.

    Returns
    -------
    PushingContacts
    center : tuple of 3 floats
        Their centroid [m].
    NormalChoice
    """
    patch, goal, u, w = problem.patch, problem.goal, problem.body.u, problem.body.w
    count, on, is_back = pushing
    is_patch, center, motion = fit_normal_motion(count, patch, on)
    spare = normal_velocity_excess(patch, motion[0], motion[1], motion[2])
    if is_patch and count > 3 and not max_of_lanes(abs(spare)) <= goal:
        free = select_lanes(spare > 0.0, normal_velocity_excess(patch, u[0], w[1], w[2]), -math.inf)
        count, on = count - 1, select_lanes(select_lane(first_true_lane(free == max_of_lanes(free))), 0.0, on)
        is_patch, center, motion = fit_normal_motion(count, patch, on)
        spare = normal_velocity_excess(patch, motion[0], motion[1], motion[2])
    speeds = select_lanes(on > 0.0, 0.0, -spare)
    fastest = max_of_lanes(speeds)
    closing = first_true_lane(speeds == fastest) if fastest > goal else -1
    ok = is_patch and max_of_lanes(on * abs(spare)) <= goal and fastest <= problem.loose
    return PushingContacts(count, on, is_back), center, NormalChoice(ok, closing, ok and count > 3, motion)


@inlined
def _choose_normal_motion(pushing, choice, problem):
    """Choose the normal motion as `_fit_pushing_contacts`; an even choice stays, about the new centroid."""
    if choice.is_even:
        return pushing, patch_centroid(pushing.count, problem.patch, pushing.on), choice
    return _fit_pushing_contacts(pushing, problem)


@inlined
def _solve_remaining_pair(on, problem, scratch):
    """Solve the two contacts that still push, with the others open.

    Returns
    -------
    PatchSolution
    closing : int
        The open contact that would close fastest, where that is why it is not found, else -1.
    """
    patch, body, goal = problem.patch, problem.body, problem.goal
    _, a, b = patch.points
    u, w, K, inv_mass = body.u, body.w, body.K, body.inv_mass
    i = first_true_lane(on > 0.0)
    j = first_true_lane(select_lanes(select_lane(i), 0.0, on) > 0.0)
    first, second = contact_in_wall_frame(i, body, scratch), contact_in_wall_frame(j, body, scratch)
    found, p, q, m, miss = solve_two_contacts(first, second, problem.mu, goal, body, scratch)
    is_i, is_j = select_lane(i), select_lane(j)
    impulses = (
        select_lanes(is_i, p[0], select_lanes(is_j, q[0], 0.0)),
        select_lanes(is_i, p[1], select_lanes(is_j, q[1], 0.0)),
        select_lanes(is_i, p[2], select_lanes(is_j, q[2], 0.0)),
    )
    vn = u[0] + inv_mass * (p[0] + q[0])
    wa, wb = w[1] + (K[1] * m[0] + K[3] * m[1] + K[4] * m[2]), w[2] + (K[2] * m[0] + K[4] * m[1] + K[5] * m[2])
    closing = select_lanes(on > 0.0, 0.0, patch.targets[0] - (vn + (wa * b - wb * a)))
    fastest, again = max_of_lanes(larger(0.0, closing)), -1
    if found and not fastest <= goal:
        found, again = False, first_true_lane(closing == fastest)
    exerted = (p[1] + q[1], p[2] + q[2], m[0], m[1], m[2])
    return PatchSolution(found, impulses, exerted, p[0] + q[0], max(miss, fastest)), again


@inlined
def _direction_newton_round(patient, pushing, problem, normal, motion, scratch):
    """Take one round of Newton's method on the directions of `motion`.

    Returns
    -------
    PatchRound
        `ROUND_SOLVED`; `ROUND_CONTINUES`; `ROUND_PULLS`; `ROUND_TIPS`: two of four contacts would pull; or
        `ROUND_REVERSES`: a direction would turn right round. Its x, y and motion are then those after the first step
        of `primal_dual_friction`.
    pulling : lanes
        1 for a contact that would have to pull, else 0.
    """
    patch, on, mu = problem.patch, pushing.on, problem.mu
    slip = patch_slip_velocities(patch, motion, normal)
    friction, miss = patch_friction_directions(slip[0], slip[1], on, mu), 0.0
    slopes, turning = solve_normal_slopes(patch, on, normal, friction, problem.body.K)
    pulling, loser, p, exerted = patch_normal_impulses(patch, on, normal, slopes, friction)
    x, y, what = friction.x, friction.y, ROUND_CONTINUES
    if loser >= 0:
        what = ROUND_PULLS
        if not patient and pushing.count > 3 and lane_sum(pulling) == 2.0:
            what = ROUND_TIPS
    if loser < 0 or patient:
        led_to = planar_motion_after(exerted, problem.body, scratch)
        delta = led_to[0] - motion[0], led_to[1] - motion[1], led_to[2] - motion[2]
        miss, k = patch_sliding_residual(patch, p, friction, mu, delta)
        if loser < 0 and miss <= problem.goal:
            what = ROUND_SOLVED
        else:
            compliance = planar_compliance(problem, normal, friction, turning, scratch.body)
            step = solve_planar_step(compliance, (k[0], k[1], k[2], k[1], k[3], k[4], k[2], k[4], k[5]), delta)
            if not has_small_turns(patch, on, friction, mu, step):
                what = ROUND_REVERSES
                step, x, y = take_viscous_step(problem, on, p, friction, compliance, delta)
            motion = motion[0] + step[0], motion[1] + step[1], motion[2] + step[2]
    return PatchRound(what, loser, p, x, y, exerted, miss, motion), pulling


@inlined
def _push_again(contact, pushing):
    """Let an open contact push once more."""
    is_it = select_lane(contact)
    return PushingContacts(
        pushing.count + 1, select_lanes(is_it, 1.0, pushing.on), select_lanes(is_it, 1.0, pushing.is_back)
    )


@inlined
def _open_pulling(current, pulling, pushing):
    """Open the contact that would pull most, or two contacts of a tipping face."""
    count, on, is_back = pushing
    if current.what == ROUND_TIPS:
        return PushingContacts(2, on - pulling, is_back)
    return PushingContacts(count - 1, select_lanes(select_lane(current.loser), 0.0, on), is_back)


@inlined
def _solve_round(n, patient, is_mixed, pushing, problem, normal, motion, scratch):
    """Take one round on the directions; where they do not settle, take all rounds of `primal_dual_friction`.

    Returns
    -------
    PatchRound
    pulling : lanes
        As `_direction_newton_round`.
    mode : int
        `TRY_SLIDING` or `TRY_MIXED`: which of the two methods had the last word.
    """
    none = Lanes(0.0, 0.0, 0.0, 0.0)
    if is_mixed:
        x, y = warm_start_friction(n, pushing.on, scratch)
        current, pulling = PatchRound(ROUND_REVERSES, -1, none, x, y, (0.0, 0.0, 0.0, 0.0, 0.0), 0.0, motion), none
    else:
        current, pulling = _direction_newton_round(patient, pushing, problem, normal, motion, scratch)
    mode = TRY_SLIDING
    if current.what == ROUND_REVERSES:
        x, y, motion, mode = current.x, current.y, current.motion, TRY_MIXED
        current = solve_stick_slip_patch(patient, pushing.on, x, y, problem, normal, motion, scratch)
    return current, pulling, mode


@inlined
def solve_sliding_patch(n, patient, problem, start, is_mixed, scratch):
    """Find the directions, and the contacts that push.

    Parameters
    ----------
    n : int
        Contacts, 3 or 4.
    patient : bool
        Whether a contact that pulls may push again while directions still turn. Otherwise it opens at once, which
        is quick and nearly always right.
    problem : PatchProblem
    start : tuple of 3 floats
        Planar motion to start from.
    is_mixed : bool
        Whether some contacts held in the stage before: then its impulses in `scratch` are the start.

    Returns
    -------
    PatchSolution
        When it is found by a round, `stage.mode` says by which method.
    has_opened : bool
        Whether a contact was opened since it pulled: else patience changes nothing.
    """
    none, has_opened = Lanes(0.0, 0.0, 0.0, 0.0), False
    pushing, choice = PushingContacts(n, valid_lanes_mask(n), none), NormalChoice(False, -1, False, start)
    motion, is_set, again = start, False, -1
    normal = normal_motion_about(n, start, start, problem.body)
    for _ in range(_MAX_PATCH_SOLVES):
        if again >= 0:
            if pushing.is_back[again] > 0.0:
                break
            pushing, is_set, again = _push_again(again, pushing), False, -1
        if pushing.count < 3:
            pair, again = _solve_remaining_pair(pushing.on, problem, scratch)
            if again < 0:
                return pair, has_opened
            motion = planar_motion_after(pair.exerted, problem.body, scratch)
            continue
        if not is_set:
            pushing, center, choice = _choose_normal_motion(pushing, choice, problem)
            if not choice.ok:
                break
            normal, is_set = normal_motion_about(pushing.count, center, choice.motion, problem.body), True
        current, pulling, mode = _solve_round(n, patient, is_mixed, pushing, problem, normal, motion, scratch)
        motion, is_mixed = current.motion, False
        if current.what == ROUND_FAILED:
            break
        if current.what == ROUND_SOLVED and choice.closing < 0:
            scratch.stage.mode, p = mode, current.p
            impulses = p, p * current.x, p * current.y
            return PatchSolution(True, impulses, current.exerted, normal.push, current.miss), has_opened
        if current.what == ROUND_SOLVED:
            again = choice.closing
        if current.what == ROUND_PULLS or current.what == ROUND_TIPS:
            pushing, is_set, has_opened = _open_pulling(current, pulling, pushing), False, True
            if not patient:
                motion = start
    return PatchSolution(False, (none, none, none), (0.0, 0.0, 0.0, 0.0, 0.0), 0.0, 0.0), has_opened
