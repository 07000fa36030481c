"""Solve a patch of sliding contacts by a few small linear systems, without a Delassus matrix.

A patch is three or four contacts of one wall. A sliding contact has the impulse p_i (n - μ d_i), with the direction
d_i = u_t/|u_t| of its own sliding (u_t less its target). If the directions are given, the normal impulses follow from a
linear system, by which all normal velocities meet their targets. The impulses give new velocities, and these give new
directions. So the only unknowns of Newton's method are a few unit vectors.

In the frame (n, a, b) of the wall the normal velocity of a point is affine in its coordinates,
u_n = v_n + ω_a b - ω_b a. So three contacts that are not on a line determine v_n, ω_a and ω_b, and with them the sum
of the normal impulses, before any impulse is known. Many normal impulses have this sum and the right moments. Those of
least norm are affine, p_i = y_0 + y_1 a_i + y_2 b_i about the centroid, and symmetric for a symmetric patch. y_0
follows from the sum, y_1 and y_2 from ω_a and ω_b (2 x 2). The planar motion τ = (v_a, v_b, ω_n) remains unknown.

With the directions of the planar motion τ, the impulses lead to the planar motion τ + δ(τ); the solution has δ = 0. If
τ turns a direction, the friction of contact i changes across it, like a drag with the coefficient κ_i = μ p_i / |u_i|.
With e_i = n x d_i and h_i = (e_i, r_i x e_i),

    δ(τ + Δ) = δ(τ) - (1 + C H) Δ,    H = Σ κ_i h_i h_iᵀ.

C is the planar compliance of the body, while y_1 and y_2 keep ω_a and ω_b. This is Newton's method. (It takes the
contacts to be equally far from the centre of mass along n, which is so to a few slops.) If the impulses belong to the
directions of τ, the velocity across direction i is exactly h_i·δ. So the residual is measured, not estimated:
|h_i·δ| s/(s + |u|) with s = μ p_i (W_aa + W_bb), which is at least the natural map of `gauss_seidel`.

If a step would reverse a direction, some contacts stop or stick. Then their impulses are the unknowns instead of their
directions (`primal_dual_friction`).

A contact that would have to pull opens, the one that pulls most first, or two of four at once (the block tips over an
edge). An open contact that would close pushes again, once. If three contacts push, and the fourth closes only slowly,
the three are solved first. Without friction the first linear system is the solution.

The solve starts from the planar motion after the impulses of the last step, and from these impulses themselves if some
contacts stuck. If they belong to other loads, it starts from `patch_start.cold_start_motion`.
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

# Largest number of linear solves of one attempt. Two are usual at a tolerance of 1e-6; each contact that opens needs
# one more.
_MAX_PATCH_SOLVES = 16

# Method to try first (`stage.mode`): all contacts stick, all slide, or some stick and some slide.
TRY_STICKING, TRY_SLIDING, TRY_MIXED = range(3)

# Results of a round of Newton's method, in addition to `primal_dual_friction.ROUND_FAILED`, `ROUND_SOLVED` and
# `ROUND_PULLS`: it goes on, two of four contacts would pull, or a sliding direction would reverse.
ROUND_CONTINUES, ROUND_TIPS, ROUND_REVERSES = range(3, 6)


class PatchSolution(NamedTuple):
    """Impulses of a patch, with their sums and residual.

    Attributes
    ----------
    found : bool
        True if the impulses solve the problem.
    impulses : tuple of 3 lanes
        Impulses (normal, tangents) of the contacts, one lane each [N s].
    exerted : tuple of 5 floats
        Sums of the impulses along the tangents [N s], and of their moments about (n, a, b) [N m s].
    push : float
        Sum of the normal impulses [N s].
    residual : float
        Residual [m/s].
    """

    found: bool
    impulses: tuple
    exerted: tuple
    push: float
    residual: float


class PushingContacts(NamedTuple):
    """Choice of the contacts of a patch that push; the others are open.

    Attributes
    ----------
    count : int
        Number of pushing contacts.
    on : lanes
        1 for each of them, 0 for an open contact.
    is_back : lanes
        1 for a contact that was open before and closed again, else 0.
    """

    count: int
    on: Lanes
    is_back: Lanes


class NormalChoice(NamedTuple):
    """Normal motion (v_n, ω_a, ω_b) of the body that is chosen for the pushing contacts of a patch.

    Attributes
    ----------
    ok : bool
        True if it meets the targets of the pushing contacts, and no open contact closes faster than
        `PatchProblem.loose`.
    closing : int
        The open contact that closes fastest, if faster than `PatchProblem.goal`; else -1.
    is_even : bool
        True if it meets the targets of all four contacts within the goal. Then it is kept, whichever contacts push. A
        new fit to three contacts could make the fourth close by a multiple of the goal, and push again needlessly.
    motion : tuple of 3 floats
        (v_n, ω_a, ω_b) [m/s, rad/s].
    """

    ok: bool
    closing: int
    is_even: bool
    motion: tuple


@inlined
def _fit_pushing_contacts(pushing, problem):
    """Fit a normal motion of the body to the targets of the pushing contacts; if four do not fit, one of them opens.

    Four targets may belong to no rigid motion. Then three contacts meet their targets, and the fourth separates faster
    than its target. A rectangle has two contacts for which this is so; the one that approaches less opens.

    Returns
    -------
    PushingContacts
        The contacts that push, one less than before if one has opened.
    center : tuple of 3 floats
        Their centroid [m].
    NormalChoice
        The normal motion.
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
    """Choose the normal motion of the pushing contacts by `_fit_pushing_contacts`; return the same three results.

    A `choice` that is even is kept; only the centroid is computed anew.
    """
    if choice.is_even:
        return pushing, patch_centroid(pushing.count, problem.patch, pushing.on), choice
    return _fit_pushing_contacts(pushing, problem)


@inlined
def _solve_remaining_pair(on, problem, scratch):
    """Solve a patch of which only two contacts, those with `on` = 1, still push.

    Returns
    -------
    PatchSolution
        The solution with the other contacts open.
    closing : int
        If the solution is not found because an open contact would close, the contact that closes fastest; else -1.
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
    """Make one round of Newton's method on the sliding directions of the planar motion `motion`.

    Returns
    -------
    PatchRound
        Its `what` is `ROUND_SOLVED`; `ROUND_CONTINUES`; `ROUND_PULLS`; `ROUND_TIPS`, if two of four contacts would
        pull; or `ROUND_REVERSES`, if a direction would reverse. In the last case its x, y and motion are those after
        the first step of `primal_dual_friction`.
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
    """Add the open contact number `contact` to the `PushingContacts`, and mark that it was open before."""
    is_it = select_lane(contact)
    return PushingContacts(
        pushing.count + 1, select_lanes(is_it, 1.0, pushing.on), select_lanes(is_it, 1.0, pushing.is_back)
    )


@inlined
def _open_pulling(current, pulling, pushing):
    """Remove contacts that would pull from the `PushingContacts`, after the `PatchRound` `current`.

    It is the contact that would pull most, or the two pulling contacts of a tipping face.
    """
    count, on, is_back = pushing
    if current.what == ROUND_TIPS:
        return PushingContacts(2, on - pulling, is_back)
    return PushingContacts(count - 1, select_lanes(select_lane(current.loser), 0.0, on), is_back)


@inlined
def _solve_round(n, patient, is_mixed, pushing, problem, normal, motion, scratch):
    """Make one round of Newton's method on sliding directions; if one would reverse, solve by `primal_dual_friction`.

    If `is_mixed`, some contacts stuck in the last stage, and `primal_dual_friction` starts at once.

    Returns
    -------
    PatchRound
        Result of the last method.
    pulling : lanes
        That of `_direction_newton_round`.
    mode : int
        Last method: `TRY_SLIDING` for Newton's method on directions, `TRY_MIXED` for `primal_dual_friction`.
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
    """Solve the contact problem of a patch: which contacts push, in which directions they slide, and which stick.

    Parameters
    ----------
    n : int
        Number of contacts, 3 or 4.
    patient : bool
        True: a contact that would pull stays among the pushing ones while directions still turn. False: it opens at
        once, which is quick and nearly always right.
    problem : PatchProblem
        The contact problem.
    start : tuple of 3 floats
        Planar motion (v_a, v_b, ω_n) to start from.
    is_mixed : bool
        True if some contacts stuck in the last stage. Then the impulses in `scratch` are the start.

    Returns
    -------
    PatchSolution
        The impulses. If a round has found them, `stage.mode` is set to its method.
    has_opened : bool
        True if a contact was opened because it would pull. Otherwise `patient` makes no difference.
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
