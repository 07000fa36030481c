"""A patch of contacts that slide: their impulses from a few small linear systems, without a Delassus matrix.

A sliding contact has the impulse p_i (n - μ d_i) along the direction d_i = u_t/|u_t| of its own sliding (u_t
less what is asked of it). Given the directions, "every normal velocity is the one asked for" is linear in the
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
natural map of `sweeps`.

Where a step would turn a direction right round, Newton's method is left for one step of Weiszfeld's: H then also
has the part along the directions, κ_i d_i d_iᵀ, as if friction were a viscous drag of that coefficient. That
always slows the contacts that stop; one that all but stops is tried as a pivot (`pivot`).

A contact that would have to pull opens, the one that pulls most first, or two of four at once (the block tips over an
edge); the fit of the targets says whether it then separates fast enough. One that would close while the others push
pushes again, once; where three push and it hardly closes, not before these are solved. Without friction the first
linear system is the solution.

All begins with the motion that the impulses of the last step lead to, or, where these are of other loads, with
`patch.cold_motion`.
"""

from __future__ import annotations

import math

from physics.kernels import quaternion as qt
from physics.kernels.columns import lane, present
from physics.kernels.compiler import inlined
from physics.kernels.ellipse import friction_ratio
from physics.kernels.lanes import Lanes, chosen, first_of, larger, largest, least, root, total
from physics.kernels.pair import contact_at, solve_pair
from physics.kernels.patch import (
    across_misses,
    add_along,
    centroid,
    comply,
    fit_targets,
    respond,
    resultant,
    spare_speed,
    turns_little,
)
from physics.kernels.pivot import FOUND, PULLS, SLIPS, turn_about

# Linear solves of one attempt at most. Two are usual at a tolerance of 1e-6, each contact that opens costs
# one more.
SLIDE_LIMIT = 16

# A contact is tried as a pivot when a step of Weiszfeld's leaves less than this share of its speed; after the first
# such step, the slowest one whatever is left.
STOPPING = 0.3

# A motion too fast by more than 1/STRETCH_LIMIT is slowed first.
STRETCH_LIMIT = 0.4

# What to try first (`work.mode`): all hold, all slide, or PIVOT + the slot of the contact that holds.
HOLD, SLIDE, PIVOT = range(3)


@inlined
def _newton(compliance, k, delta):
    """Step Δτ of (1 + C H) Δτ = δ, by the columns of the matrix and Cramer's rule."""
    c0, c1, c2, c3, c4, c5, c6, c7, c8 = compliance
    k0, k1, k2, k3, k4, k5 = k
    p = (
        1.0 + (c0 * k0 + c1 * k1 + c2 * k2),
        c3 * k0 + c4 * k1 + c5 * k2,
        c6 * k0 + c7 * k1 + c8 * k2,
    )
    q = (
        c0 * k1 + c1 * k3 + c2 * k4,
        1.0 + (c3 * k1 + c4 * k3 + c5 * k4),
        c6 * k1 + c7 * k3 + c8 * k4,
    )
    r = (
        c0 * k2 + c1 * k4 + c2 * k5,
        c3 * k2 + c4 * k4 + c5 * k5,
        1.0 + (c6 * k2 + c7 * k4 + c8 * k5),
    )
    qr = qt.cross(q, r)
    s = 1.0 / qt.dot(p, qr)
    return s * qt.dot(qr, delta), s * qt.dot(qt.cross(r, p), delta), s * qt.dot(qt.cross(p, q), delta)


@inlined
def _lengthening(motion, delta, gyration2, work):
    """By how much a motion of the same direction is larger where it leaves no energy: on the ray through it.

    The friction is the same all along the ray: σ = 1 + <τ, δ>/<τ, τ>, in the metric (1, 1/k², I/m), k = μ2/μ1.
    """
    ratio = friction_ratio(work)
    s = 1.0 / (ratio * ratio)
    size2 = motion[0] * motion[0] + s * motion[1] * motion[1] + gyration2 * motion[2] * motion[2]
    return 1.0 + (motion[0] * delta[0] + s * motion[1] * delta[1] + gyration2 * motion[2] * delta[2]) / size2


@inlined
def _normal_motion(count, goal, loose, patch, on, u, w):
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
    is_patch, center, motion = fit_targets(count, patch, on)
    spare = spare_speed(patch, motion[0], motion[1], motion[2])
    if is_patch and count > 3 and not largest(abs(spare)) <= goal:
        free = chosen(spare > 0.0, spare_speed(patch, u[0], w[1], w[2]), -math.inf)
        count, on = count - 1, chosen(lane(first_of(free == largest(free))), 0.0, on)
        is_patch, center, motion = fit_targets(count, patch, on)
        spare = spare_speed(patch, motion[0], motion[1], motion[2])
    speeds = chosen(on > 0.0, 0.0, -spare)
    fastest = largest(speeds)
    closing = first_of(speeds == fastest) if fastest > goal else -1
    ok = is_patch and largest(on * abs(spare)) <= goal and fastest <= loose
    return ok, closing, count, on, center, motion, ok and count > 3


@inlined
def _slowest(patch, on, slip, mu, step, tried, hurry):
    """The active contact, not yet `tried`, that is slowest after a step, if it is STOPPING or in a `hurry`; or -1."""
    (_, a, b), _, _ = patch
    x, y, size = slip
    da, db = step[0] - step[2] * b, step[1] + step[2] * a
    s = size / mu
    ua, ub = da - s * x, db - s * y
    left = chosen(on > tried, root(ua * ua + ub * ub), math.inf)
    if not hurry:
        left = chosen(left < STOPPING * size, left, math.inf)
    best = least(left)
    return first_of(left == best) if best < math.inf else -1


@inlined
def _turn(patch, on, p, slip, mu, compliance, k, motion, delta, gyration2, tried, hurry, work):
    """The next motion by Newton's step, or what replaces it: (whether it was Newton's, pivot to try or -1, motion)."""
    step = _newton(compliance, k, delta)
    is_settled = turns_little(patch, on, slip, mu, step)
    pivot = -1
    if not is_settled:
        stretch = _lengthening(motion, delta, gyration2, work)
        if 0.0 < stretch < STRETCH_LIMIT:
            return False, -1, (stretch * motion[0], stretch * motion[1], stretch * motion[2])
        step = _newton(compliance, add_along(patch, p, slip, mu, k), delta)
        pivot = _slowest(patch, on, slip, mu, step, tried, hurry)
    return is_settled, pivot, (motion[0] + step[0], motion[1] + step[1], motion[2] + step[2])


@inlined
def first_pivot(n, work):
    """The contact that held alone in the step before, or -1."""
    if work.mode >= PIVOT:
        for i in range(n):
            if work.slot[i] == work.mode - PIVOT:
                return i
    return -1


@inlined
def _two_left(patch, on, mu, goal, axes, u, w, inv_mass, K, work):
    """The two contacts that still push, the others open.

    Returns
    -------
    found, impulses, exerted, push, residual
        As `_search`.
    closing : int
        The open contact that would close fastest, where that is why it is not found, else -1.
    """
    (_, a, b), (target, _, _), _ = patch
    i = first_of(on > 0.0)
    j = first_of(chosen(lane(i), 0.0, on) > 0.0)
    first, second = contact_at(i, axes, u, w, work), contact_at(j, axes, u, w, work)
    found, p, q, m, miss = solve_pair(first, second, mu, goal, inv_mass, K, work)
    is_i, is_j = lane(i), lane(j)
    impulses = (
        chosen(is_i, p[0], chosen(is_j, q[0], 0.0)),
        chosen(is_i, p[1], chosen(is_j, q[1], 0.0)),
        chosen(is_i, p[2], chosen(is_j, q[2], 0.0)),
    )
    vn = u[0] + inv_mass * (p[0] + q[0])
    wa, wb = w[1] + (K[1] * m[0] + K[3] * m[1] + K[4] * m[2]), w[2] + (K[2] * m[0] + K[4] * m[1] + K[5] * m[2])
    closing = chosen(on > 0.0, 0.0, target - (vn + (wa * b - wb * a)))
    fastest, again = largest(larger(0.0, closing)), -1
    if found and not fastest <= goal:
        found, again = False, first_of(closing == fastest)
    exerted = (p[1] + q[1], p[2] + q[2], m[0], m[1], m[2])
    return found, impulses, exerted, p[0] + q[0], max(miss, fastest), again


@inlined
def _moved(exerted, u, w, inv_mass, mass_b, K):
    """Planar motion that impulses along the tangents, and moments, lead to."""
    fa, fb, tn, ta, tb = exerted
    return u[1] + inv_mass * fa, u[2] + mass_b * fb, w[0] + (K[0] * tn + K[1] * ta + K[2] * tb)


@inlined
def search(n, patient, mu, goal, loose, patch, start, pivot, axes, u, w, inv_mass, K, work):
    """Directions and set of pushing contacts.

    Parameters
    ----------
    patient : bool
        Whether a contact that pulls may push again while directions still turn. Otherwise it opens at once, which
        is quick and nearly always right.
    goal : float
        Residual asked for [m/s].
    loose : float
        Speed up to which an open contact may close while it is sought which others push [m/s].
    start : tuple of 3 floats
        Planar motion to start from.
    pivot : int
        Contact that is tried as one first, or -1.
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
    on, has_opened = present(n), False
    none = is_back = Lanes(0.0, 0.0, 0.0, 0.0)
    count, motion, tried, hurry, is_set, is_even, again, closing = n, start, none, False, False, False, -1, -1
    center = normal_motion = start
    for _ in range(SLIDE_LIMIT):
        if again >= 0:
            if is_back[again] > 0.0:
                break
            count, on, is_back = count + 1, chosen(lane(again), 1.0, on), chosen(lane(again), 1.0, is_back)
            again, is_set, tried = -1, False, none
        if count < 3:
            found, impulses, exerted, push, miss, again = _two_left(patch, on, mu, goal, axes, u, w, inv_mass, K, work)
            if again < 0:
                return found, impulses, exerted, push, miss, has_opened
            motion = _moved(exerted, u, w, inv_mass, mass_b, K)
            continue
        if not is_set and is_even:
            center = centroid(count, patch, on)
        elif not is_set:
            ok, closing, count, on, center, normal_motion, is_even = _normal_motion(count, goal, loose, patch, on, u, w)
            if not ok:
                break
        is_set = True
        vn, wa, wb = normal_motion
        push = (vn - u[0]) / inv_mass
        y0, gain = push / count, (wa - w[1], wb - w[2])
        if pivot >= 0:
            tried = chosen(lane(pivot), 1.0, tried)
            what, loser, impulses, exerted, miss, slipped = turn_about(
                pivot, patch, on, mu, goal, center, y0, gain, u, w, wa, wb, motion[2], inv_mass, K, work
            )
            if what == FOUND and closing >= 0:
                again = closing
                continue
            if what == FOUND:
                work.mode = PIVOT + work.slot[pivot]
                return True, impulses, exerted, push, miss, has_opened
            if what == PULLS:
                count, on, is_set, tried, has_opened = count - 1, chosen(lane(loser), 0.0, on), False, none, True
            elif what == SLIPS:
                motion = slipped
            pivot = -1
            continue
        slip, y, turning = respond(patch, on, mu, center, y0, gain, motion, wa, wb, K)
        pulling, loser, p, exerted = resultant(patch, on, center, y0, y, slip)
        if not patient and count > 3 and total(pulling) == 2.0:
            count, on, is_set, tried, motion, has_opened = 2, on - pulling, False, none, start, True
            continue
        is_settled = True
        if loser < 0 or patient:
            led_to = _moved(exerted, u, w, inv_mass, mass_b, K)
            delta = led_to[0] - motion[0], led_to[1] - motion[1], led_to[2] - motion[2]
            miss, k = across_misses(patch, p, slip, mu, delta)
            if loser < 0 and miss <= goal and closing >= 0:
                again = closing
                continue
            if loser < 0 and miss <= goal:
                work.mode = SLIDE
                return True, (p, p * slip[0], p * slip[1]), exerted, push, miss, has_opened
            compliance = comply(patch, center, slip, turning, inv_mass, K, work)
            is_settled, pivot, motion = _turn(
                patch, on, p, slip, mu, compliance, k, motion, delta, inv_mass / K[0], tried, hurry, work
            )
            hurry = hurry or not is_settled
        if loser >= 0 and is_settled:
            count, on, is_set, tried, has_opened = count - 1, chosen(lane(loser), 0.0, on), False, none, True
            if not patient:
                motion = start
    return False, (none, none, none), (0.0, 0.0, 0.0, 0.0, 0.0), 0.0, 0.0, has_opened
