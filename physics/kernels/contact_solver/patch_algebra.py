"""Evaluate the formulas of `sliding_patch` and `primal_dual_friction`, by sums over the contacts of a patch.

A patch (`Patch`) has three or four contacts, one SIMD lane each. For three contacts the fourth lane is the third
contact again, which never pushes. Vectors are in the stretched frame (n, a, b) of `anisotropic_friction`; with a single
friction coefficient it is the frame of the wall. These arguments and results have the same meaning everywhere:

on : lanes
    1 for a contact that pushes, 0 for one that is open.
p : lanes
    Normal impulses [N s].
motion : tuple of 3 floats
    Planar motion (v_a, v_b, ω_n) [m/s, m/s, rad/s].
exerted : tuple of 5 floats
    Sums over the contacts: impulses along the tangents (a, b) [N s], and moments about (n, a, b) [N m s].
"""

from __future__ import annotations

from physics.compiler.decorators import inlined
from physics.compiler.simd import (
    first_true_lane,
    lane_sqrt,
    lane_sum,
    larger,
    max_of_lanes,
    min_of_lanes,
    select_lanes,
)
from physics.kernels.contact_law.anisotropic_friction import friction_ratio
from physics.kernels.contact_solver.one_contact import (
    MIN_SQUARED_NORM,
    inverse_root,
    point_velocity,
)
from physics.kernels.contact_solver.patch import NormalMotion, PatchFriction

# A patch counts as a line if the determinant of its second moments is below this share of trace² (edges 1 : 1000).
_COLLINEAR_LIMIT = 1.0e-6


@inlined
def largest_free_speed(friction, patch, body):
    """Largest component of the contact velocities without impulses, less their targets [m/s].

    `friction` is None without friction; then only normal components count. `body` is a `FreeBody`.
    """
    target, speed = patch.targets, point_velocity(patch.points, body.u, body.w)
    worst = abs(speed[0] - target[0])
    if friction is not None:
        worst = larger(worst, larger(abs(speed[1] - target[1]), abs(speed[2] - target[2])))
    return max_of_lanes(larger(0.0, worst))


@inlined
def patch_centroid(count, patch, on):
    """Centroid (normal, tangents) of the `count` pushing contacts of a patch, those with `on` = 1 [m]."""
    c, a, b = patch.points
    s = 1.0 / count
    return s * lane_sum(on * c), s * lane_sum(on * a), s * lane_sum(on * b)


@inlined
def fit_normal_motion(count, patch, on):
    """Fit a normal motion to the normal targets of the `count` pushing contacts (`on` = 1), by least squares.

    The motion is (v_n, ω_a, ω_b): the velocity along the wall's normal, and the angular velocities about its tangents.
    Returns (is_patch, centroid of the contacts [m], motion). If the contacts are on a line, is_patch is False, and the
    motion is inaccurate or not finite.
    """
    _, a, b = patch.points
    target = patch.targets[0]
    center, t0 = patch_centroid(count, patch, on), (1.0 / count) * lane_sum(on * target)
    a, b = on * (a - center[1]), on * (b - center[2])
    saa, sab, sbb, ta, tb = (
        lane_sum(a * a),
        lane_sum(a * b),
        lane_sum(b * b),
        lane_sum(a * target),
        lane_sum(b * target),
    )
    det, trace = saa * sbb - sab * sab, saa + sbb
    s = 1.0 / det
    ga, gb = s * (sbb * ta - sab * tb), s * (saa * tb - sab * ta)
    return det > _COLLINEAR_LIMIT * trace * trace, center, (t0 - (ga * center[1] + gb * center[2]), gb, -ga)


@inlined
def normal_velocity_excess(patch, vn, wa, wb):
    """Normal velocities of the contacts less their targets [m/s], in the normal motion (v_n, ω_a, ω_b) = (vn, wa, wb).

    Pushing contacts should have 0 here, open contacts 0 or more.
    """
    _, a, b = patch.points
    return (vn + wa * b - wb * a) - patch.targets[0]


@inlined
def normal_motion_about(count, center, motion, body):
    """Make the `NormalMotion` of `count` contacts with the centroid `center`, for the `motion` (v_n, ω_a, ω_b).

    `body` is the `FreeBody` before the impulses.
    """
    vn, wa, wb = motion
    push = (vn - body.u[0]) / body.inv_mass
    return NormalMotion(center, wa, wb, push, push / count, (wa - body.w[1], wb - body.w[2]))


@inlined
def patch_friction_directions(ua, ub, on, mu):
    """Make the `PatchFriction` of contacts that slide with the velocities (ua, ub) [m/s].

    Friction is zero for contacts that are open or do not slip.
    """
    square = ua * ua + ub * ub
    s = select_lanes(square > MIN_SQUARED_NORM, -mu * on * inverse_root(square), 0.0)
    return PatchFriction(s * ua, s * ub, lane_sqrt(square))


@inlined
def patch_slip_velocities(patch, motion, normal):
    """Tangential velocities of the contacts of a patch less their targets [m/s], two lanes.

    `motion` is the body's planar motion (v_a, v_b, ω_n), along the wall and about its normal; `normal` is a
    `NormalMotion`.
    """
    c, a, b = patch.points
    _, target_a, target_b = patch.targets
    wa, wb = normal.wa, normal.wb
    return motion[0] + wb * c - motion[2] * b - target_a, motion[1] + motion[2] * a - wa * c - target_b


@inlined
def solve_normal_slopes(patch, on, normal, friction, K):
    """Solve for the slopes y_1, y_2 of normal impulses, affine in the place on the wall, that lead to a `NormalMotion`.

    `friction` is the `PatchFriction` that goes with them, and K the inverse inertia of the body.

    Returns
    -------
    y : tuple of 2 floats
        Slopes (y_1, y_2) [N s/m].
    turning : tuple of 6 floats
        Changes of ω_a per y_1 and y_2, of ω_b per y_1 and y_2, and of ω_n per y_1 and y_2, with their friction.
    """
    c, a, b = patch.points
    x, y, center, y0, gain = friction.x, friction.y, normal.center, normal.y0, normal.gain
    mn, ma, mb = a * y - b * x, on * b - c * y, c * x - on * a
    a, b = a - center[1], b - center[2]
    n0, n1, n2 = lane_sum(mn), lane_sum(a * mn), lane_sum(b * mn)
    a0, a1, a2 = lane_sum(ma), lane_sum(a * ma), lane_sum(b * ma)
    b0, b1, b2 = lane_sum(mb), lane_sum(a * mb), lane_sum(b * mb)
    g0, h0 = K[1] * n0 + K[3] * a0 + K[4] * b0, K[2] * n0 + K[4] * a0 + K[5] * b0
    g1, g2 = K[1] * n1 + K[3] * a1 + K[4] * b1, K[1] * n2 + K[3] * a2 + K[4] * b2
    h1, h2 = K[2] * n1 + K[4] * a1 + K[5] * b1, K[2] * n2 + K[4] * a2 + K[5] * b2
    f1, f2 = K[0] * n1 + K[1] * a1 + K[2] * b1, K[0] * n2 + K[1] * a2 + K[2] * b2
    s = 1.0 / (g1 * h2 - g2 * h1)
    ra, rb = gain[0] - g0 * y0, gain[1] - h0 * y0
    return (s * (h2 * ra - g2 * rb), s * (g1 * rb - h1 * ra)), (g1, g2, h1, h2, f1, f2)


@inlined
def planar_compliance(problem, normal, friction, turning, body):
    """Planar compliance C: change of the planar motion (v_a, v_b, ω_n) per planar impulse at the contacts' centroid.

    It is nine numbers, row by row. The slopes y_1 and y_2 respond to the impulse, so that the normal motion stays the
    same. `friction` and `turning` are those of
    `solve_normal_slopes`. `body` is the body's record.
    """
    _, a, b = problem.patch.points
    x, y, K, inv_mass, ratio = friction.x, friction.y, problem.body.K, problem.body.inv_mass, friction_ratio(body)
    mass_b = ratio * ratio * inv_mass
    cc, ca, cb = normal.center
    g1, g2, h1, h2, f1, f2 = turning
    s = 1.0 / (g1 * h2 - g2 * h1)
    a, b = a - ca, b - cb
    # Rows (ω_a, ω_b) of the response to the impulse (D_a, D_b, D_n), moments (D_n, -c D_b, c D_a).
    sa = (cc * K[4], -cc * K[3], K[1])
    sb = (cc * K[5], -cc * K[4], K[2])
    x1, x2, y1, y2 = (
        inv_mass * lane_sum(a * x),
        inv_mass * lane_sum(b * x),
        mass_b * lane_sum(a * y),
        mass_b * lane_sum(b * y),
    )
    # Planar motion by the y that make up for δω_a and δω_b.
    pa, pb = s * (x1 * h2 - x2 * h1), s * (x2 * g1 - x1 * g2)
    qa, qb = s * (y1 * h2 - y2 * h1), s * (y2 * g1 - y1 * g2)
    ra, rb = s * (f1 * h2 - f2 * h1), s * (f2 * g1 - f1 * g2)
    return (
        inv_mass - pa * sa[0] - pb * sb[0], -pa * sa[1] - pb * sb[1], -pa * sa[2] - pb * sb[2],
        -qa * sa[0] - qb * sb[0], mass_b - qa * sa[1] - qb * sb[1], -qa * sa[2] - qb * sb[2],
        cc * K[2] - ra * sa[0] - rb * sb[0],
        -cc * K[1] - ra * sa[1] - rb * sb[1],
        K[0] - ra * sa[2] - rb * sb[2],
    )  # fmt: skip


@inlined
def patch_normal_impulses(patch, on, normal, y, friction):
    """Compute the normal impulses of the pushing contacts, with the slopes y of `solve_normal_slopes`.

    Returns
    -------
    pulling : lanes
        1 for a contact that would have to pull, else 0.
    loser : int
        The contact that would have to pull most, or -1.
    p : lanes
        Normal impulses [N s], 0 for contacts that would pull.
    exerted : tuple of 5 floats
        Sums of impulses and moments, of p and its friction (module docstring).
    """
    c, a, b = patch.points
    center, y0 = normal.center, normal.y0
    p = select_lanes(on > 0.0, y0 + (y[0] * (a - center[1]) + y[1] * (b - center[2])), 0.0)
    pulling, loser = select_lanes(p < 0.0, 1.0, 0.0), -1
    if first_true_lane(~(p >= 0.0)) >= 0:  # written so that NaN also counts as pulling
        loser = first_true_lane((on > 0.0) & ~(p > min_of_lanes(p)))
    p = larger(p, 0.0)
    px, py = p * friction.x, p * friction.y
    exerted = lane_sum(px), lane_sum(py), lane_sum(a * py - b * px), lane_sum(b * p - c * py), lane_sum(c * px - a * p)
    return pulling, loser, p, exerted


@inlined
def planar_motion_after(exerted, body, scratch):
    """Planar motion (v_a, v_b, ω_n) of a body after contact impulses with the sums `exerted`.

    `body` is the `FreeBody` before them.
    """
    fa, fb, tn, ta, tb = exerted
    u, w, K, inv_mass, ratio = body.u, body.w, body.K, body.inv_mass, friction_ratio(scratch.body)
    mass_b = ratio * ratio * inv_mass
    return u[1] + inv_mass * fa, u[2] + mass_b * fb, w[0] + (K[0] * tn + K[1] * ta + K[2] * tb)


@inlined
def patch_sliding_residual(patch, p, friction, mu, delta):
    """Tangential residual of sliding contacts, and the matrix H of `sliding_patch`.

    `friction` has the directions of a planar motion, and the impulses lead to another one, which differs by `delta`.

    Returns
    -------
    worst : float
        Largest residual of contacts with p > 0 [m/s]. A contact that moves backwards counts with its whole velocity,
        which is an upper bound, since its impulse is in the friction cone and projections do not lengthen.
    H : tuple of 6 floats
        Σ κ h hᵀ (11, 12, 13, 22, 23, 33): growth of the friction across the directions with the planar motion.
    """
    if not mu > 0.0:
        return 0.0, (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    _, a, b = patch.points
    inv_mu = 1.0 / mu
    x, y, size = friction.x * inv_mu, friction.y * inv_mu, friction.speed  # (x, y) = -d
    da, db = delta[0] - delta[2] * b, delta[1] + delta[2] * a
    load = mu * p
    weight = load * patch.mobility  # μ p trace(W_tt), which is at least μ p / ρ_t
    along, across = size - (x * da + y * db), abs(x * db - y * da)
    miss = select_lanes(along > 0.0, across * weight / (weight + along), across - along)
    worst = max_of_lanes(larger(0.0, select_lanes(weight > 0.0, miss, 0.0)))
    s, h = select_lanes(size > 0.0, load / size, 0.0), -(a * x + b * y)
    sx, sy = s * x, s * y
    return worst, (
        lane_sum(sy * y),
        -lane_sum(sx * y),
        lane_sum(sy * h),
        lane_sum(sx * x),
        -lane_sum(sx * h),
        lane_sum(s * h * h),
    )


@inlined
def has_turned_far(on, d, size, change):
    """Mask of pushing contacts (`on` = 1) whose slip turns by more than about 70 degrees when `change` [m/s] is added.

    d are the directions of the slip velocities, `size` their sizes [m/s].
    """
    along, across = size + (d[0] * change[0] + d[1] * change[1]), d[0] * change[1] - d[1] * change[0]
    return (on * size > 0.0) & ~((along > 0.1 * size) & (abs(across) <= 3.0 * along))


@inlined
def has_small_turns(patch, on, friction, mu, step):
    """True if a `step` of the planar motion (v_a, v_b, ω_n) turns no slip by more than about 70 degrees."""
    _, a, b = patch.points
    x, y, size = friction
    s = -1.0 / mu
    change = step[0] - step[2] * b, step[1] + step[2] * a
    return first_true_lane(has_turned_far(on, (s * x, s * y), size, change)) < 0
