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
where they are of other loads, with `patch_algebra.cold_start_motion`.
"""

from __future__ import annotations

import math

from physics.kernels.compile.decorators import inlined
from physics.kernels.compile.simd import Lanes, first_true_lane, lane_sum, larger, max_of_lanes, select_lanes
from physics.kernels.contact_law.anisotropic_friction import friction_ratio
from physics.kernels.contact_solver.patch_algebra import (
    fit_normal_motion,
    has_small_turns,
    normal_velocity_excess,
    patch_centroid,
    patch_friction_directions,
    patch_normal_impulses,
    patch_sliding_residual,
    patch_slip_velocities,
    planar_compliance,
    planar_motion_after,
    solve_normal_slopes,
    warm_start_friction,
)
from physics.kernels.contact_solver.primal_dual_friction import (
    ROUND_FAILED,
    ROUND_PULLS,
    ROUND_SOLVED,
    solve_planar_step,
    solve_stick_slip_patch,
    take_viscous_step,
)
from physics.kernels.contact_solver.two_contacts import contact_in_wall_frame, solve_two_contacts
from physics.kernels.math.simd_gather import select_lane, valid_lanes_mask

# Linear solves of one attempt at most. Two are usual at a tolerance of 1e-6, each contact that opens costs
# one more.
_MAX_PATCH_SOLVES = 16

# What to try first (`work.mode`): all hold, all slide, or some of both.
TRY_STICKING, TRY_SLIDING, TRY_MIXED = range(3)

# What a round comes to, beside `primal_dual_friction.ROUND_FAILED`, `ROUND_SOLVED` and `ROUND_PULLS`.
ROUND_CONTINUES, ROUND_TIPS, ROUND_REVERSES = range(3, 6)


@inlined
def _choose_normal_motion(count, goal, loose, patch, on, u, w):
    """Normal motion of the contacts that push, and which do.

    Targets of four contacts that are those of no rigid motion are met by three: one opens that is then faster than
    asked. Of the two of a rectangle it is the one that approaches less.

    Returns
    -------
    ok : bool
        Whether the targets are met, and no open contact closes faster than `loose`.
    closing : int
        The open contact that closes fastest, by more than the goal, or -1.
    count, on
        Contacts that push.
    center : tuple of 3 floats
        Their centroid.
    motion : tuple of 3 floats
        (v_n, ω_a, ω_b).
    is_even : bool
        Whether it meets the targets of four contacts within the goal. Then it does whichever of them push; three that
        met theirs to the letter would have the fourth off by four times as much, and it would push again for nothing.
    """
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
    ok = is_patch and max_of_lanes(on * abs(spare)) <= goal and fastest <= loose
    return ok, closing, count, on, center, motion, ok and count > 3


@inlined
def _solve_remaining_pair(patch, on, mu, goal, axes, u, w, inv_mass, K, work):
    """The two contacts that still push, the others open.

    Returns
    -------
    found, impulses, exerted, push, residual
        As `_search`.
    closing : int
        The open contact that would close fastest, where that is why it is not found, else -1.
    """
    (_, a, b), (target, _, _), _ = patch
    i = first_true_lane(on > 0.0)
    j = first_true_lane(select_lanes(select_lane(i), 0.0, on) > 0.0)
    first, second = contact_in_wall_frame(i, axes, u, w, work), contact_in_wall_frame(j, axes, u, w, work)
    found, p, q, m, miss = solve_two_contacts(first, second, mu, goal, inv_mass, K, work)
    is_i, is_j = select_lane(i), select_lane(j)
    impulses = (
        select_lanes(is_i, p[0], select_lanes(is_j, q[0], 0.0)),
        select_lanes(is_i, p[1], select_lanes(is_j, q[1], 0.0)),
        select_lanes(is_i, p[2], select_lanes(is_j, q[2], 0.0)),
    )
    vn = u[0] + inv_mass * (p[0] + q[0])
    wa, wb = w[1] + (K[1] * m[0] + K[3] * m[1] + K[4] * m[2]), w[2] + (K[2] * m[0] + K[4] * m[1] + K[5] * m[2])
    closing = select_lanes(on > 0.0, 0.0, target - (vn + (wa * b - wb * a)))
    fastest, again = max_of_lanes(larger(0.0, closing)), -1
    if found and not fastest <= goal:
        found, again = False, first_true_lane(closing == fastest)
    exerted = (p[1] + q[1], p[2] + q[2], m[0], m[1], m[2])
    return found, impulses, exerted, p[0] + q[0], max(miss, fastest), again


@inlined
def _direction_newton_round(
    patient, count, patch, on, mu, goal, center, y0, gain, motion, u, w, wa, wb, inv_mass, K, work
):
    """One round of Newton's method on the directions, those of `motion`.

    Returns
    -------
    what : int
        FOUND; GOES_ON; PULLS: the contact `loser` would have to pull; TIPS: two of four would; TURNS_ROUND: a direction
        would, and the motion is that of the first step of `primal_dual_friction`.
    loser, pulling
        As of `patch_normal_impulses`.
    p, x, y : lanes
        Normal impulses, and impulses along the tangents per normal impulse: for the next round when it TURNS_ROUND.
    exerted : tuple of 5 floats
    miss : float
        Residual [m/s].
    motion : tuple of 3 floats
        Of the next round.
    """
    slip, miss = patch_friction_directions(*patch_slip_velocities(patch, motion, wa, wb), on, mu), 0.0
    slopes, turning = solve_normal_slopes(patch, on, center, y0, gain, slip, K)
    pulling, loser, p, exerted = patch_normal_impulses(patch, on, center, y0, slopes, slip)
    x, y, what = slip[0], slip[1], ROUND_CONTINUES
    if loser >= 0:
        what = ROUND_PULLS
        if not patient and count > 3 and lane_sum(pulling) == 2.0:
            what = ROUND_TIPS
    if loser < 0 or patient:
        ratio = friction_ratio(work)
        led_to = planar_motion_after(exerted, u, w, inv_mass, ratio * ratio * inv_mass, K)
        delta = led_to[0] - motion[0], led_to[1] - motion[1], led_to[2] - motion[2]
        miss, k = patch_sliding_residual(patch, p, slip, mu, delta)
        if loser < 0 and miss <= goal:
            what = ROUND_SOLVED
        else:
            compliance = planar_compliance(patch, center, slip, turning, inv_mass, K, work)
            step = solve_planar_step(compliance, (k[0], k[1], k[2], k[1], k[3], k[4], k[2], k[4], k[5]), delta)
            if not has_small_turns(patch, on, slip, mu, step):
                what = ROUND_REVERSES
                step, x, y = take_viscous_step(patch, on, p, slip, mu, compliance, delta, goal)
            motion = motion[0] + step[0], motion[1] + step[1], motion[2] + step[2]
    return what, loser, pulling, p, x, y, exerted, miss, motion


@inlined
def solve_sliding_patch(n, patient, mu, goal, loose, patch, start, is_mixed, axes, u, w, inv_mass, K, work):
    """Directions and set of pushing contacts.

    Parameters
    ----------
    patient : bool
        Whether a contact that pulls may push again while directions still turn. Otherwise it opens at once, which
        is quick and nearly always right.
    goal : float
        Tolerance of the residual [m/s].
    loose : float
        Speed up to which an open contact may close while it is sought which others push [m/s].
    start : tuple of 3 floats
        Planar motion to start from.
    is_mixed : bool
        Whether some contacts held in the stage before: then its impulses in `work` are the start.
    u, w, K
        Velocity and angular velocity without contact impulses, inverse inertia: in the stretched frame of the wall.

    Returns
    -------
    found : bool
    impulses : tuple of 3 lanes
        Of each contact (normal, tangents) [N s].
    exerted : tuple of 5 floats
        Their sums along the tangents, and moments.
    push : float
        Sum of the normal impulses [N s].
    residual : float
        [m/s].
    has_opened : bool
        Whether a contact was opened since it pulled: else patience changes nothing.
    """
    ratio = friction_ratio(work)
    mass_b = ratio * ratio * inv_mass
    on, has_opened = valid_lanes_mask(n), False
    none = is_back = Lanes(0.0, 0.0, 0.0, 0.0)
    count, motion, is_set, is_even, again, closing = n, start, False, False, -1, -1
    center = normal_motion = start
    for _ in range(_MAX_PATCH_SOLVES):
        if again >= 0:
            if is_back[again] > 0.0:
                break
            count, on, is_back = (
                count + 1,
                select_lanes(select_lane(again), 1.0, on),
                select_lanes(select_lane(again), 1.0, is_back),
            )
            again, is_set = -1, False
        if count < 3:
            found, impulses, exerted, push, miss, again = _solve_remaining_pair(
                patch, on, mu, goal, axes, u, w, inv_mass, K, work
            )
            if again < 0:
                return found, impulses, exerted, push, miss, has_opened
            motion = planar_motion_after(exerted, u, w, inv_mass, mass_b, K)
            continue
        if not is_set and is_even:
            center = patch_centroid(count, patch, on)
        elif not is_set:
            ok, closing, count, on, center, normal_motion, is_even = _choose_normal_motion(
                count, goal, loose, patch, on, u, w
            )
            if not ok:
                break
        is_set = True
        vn, wa, wb = normal_motion
        push = (vn - u[0]) / inv_mass
        y0, gain = push / count, (wa - w[1], wb - w[2])
        what, mode = ROUND_REVERSES, TRY_SLIDING
        if is_mixed:
            x, y = warm_start_friction(n, patch, on, work)
        else:
            what, loser, pulling, p, x, y, exerted, miss, motion = _direction_newton_round(
                patient, count, patch, on, mu, goal, center, y0, gain, motion, u, w, wa, wb, inv_mass, K, work
            )
        if what == ROUND_REVERSES:
            what, loser, p, x, y, exerted, miss, motion = solve_stick_slip_patch(
                patient, patch, on, x, y, mu, goal, loose, center, y0, gain, motion, u, w, wa, wb, inv_mass, K, work
            )
            is_mixed, mode = False, TRY_MIXED
        if what == ROUND_FAILED:
            break
        if what == ROUND_SOLVED and closing < 0:
            work.mode = mode
            return True, (p, p * x, p * y), exerted, push, miss, has_opened
        if what == ROUND_SOLVED:
            again = closing
        if what == ROUND_TIPS:
            count, on, is_set, motion, has_opened = 2, on - pulling, False, start, True
        if what == ROUND_PULLS:
            count, on, is_set, has_opened = count - 1, select_lanes(select_lane(loser), 0.0, on), False, True
            if not patient:
                motion = start
    return False, (none, none, none), (0.0, 0.0, 0.0, 0.0, 0.0), 0.0, 0.0, has_opened
