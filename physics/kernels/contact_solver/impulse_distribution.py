"""Distribute a total impulse and its moment among sticking contacts, by the formulas of `sticking`."""

from __future__ import annotations

from physics.compiler.decorators import inlined
from physics.compiler.simd import LANE_COUNT, first_true_lane, lane_sqrt, lane_sum, select_lanes
from physics.kernels.contact_law.anisotropic_friction import friction_ratio
from physics.kernels.contact_law.materials import friction_at, friction_of
from physics.kernels.half_space.contact_point import contact_arm, wall_axis, wall_of
from physics.kernels.math import quaternion as qt
from physics.kernels.math.simd_gather import gather_column, gather_numbers, valid_lanes_mask
from physics.kernels.math.vector import minus
from physics.kernels.state.layout import WALL_NORMAL, WALL_TANGENT_1, WALL_TANGENT_2

# Largest number of iterations for the weights of the tangential impulses; nine in ten solutions need at most ten.
_MAX_WEISZFELD_STEPS = 40


@inlined
def solve_symmetric(k, b):
    """Solve K x = b for x, with the symmetric matrix K = (k11, k12, k13, k22, k23, k33), by cofactors."""
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
def first_active(n, solver):
    """Index of the first of n contacts with a flag in `solver.active`; 0 if there is none."""
    for i in range(n):
        if solver.active[i] != 0:
            return i
    return 0


@inlined
def is_in_cone(pn, pa, pb, slot, scratch):
    """True if the impulse (pn, pa, pb), normal and tangents, is in the friction cone of the contact in `slot`."""
    limit, b = friction_of(slot, scratch) * pn, pb / friction_ratio(scratch.body)
    return pa * pa + b * b <= limit * limit


@inlined
def distribute_by_bolt_group(n, count, c, F, a, scratch):
    """Write the impulses of the `count` active contacts by the bolt-group formula p_i = F/count + a x d_i.

    c is the centroid of the contacts, F the total impulse, and a the vector K⁻¹ T of the formula (`sticking`). The
    impulses go to `solver.normal` and `solver.across`. Returns (the contact that pulls most, or -1; whether all
    impulses are in their friction cones).
    """
    solver = scratch.solver
    walls = scratch.scene.walls
    lowest = 0.0
    loser = -1
    holds = True
    s = 1.0 / count
    for i in range(n):
        if solver.active[i] == 0:
            continue
        wall = wall_of(scratch.contacts.slot[i], scratch.scene)
        m = qt.cross(a, minus(contact_arm(scratch.contacts, i), c))
        p = (s * F[0] + m[0], s * F[1] + m[1], s * F[2] + m[2])
        pn = qt.dot(wall_axis(walls, wall, WALL_NORMAL), p)
        pa, pb = qt.dot(wall_axis(walls, wall, WALL_TANGENT_1), p), qt.dot(wall_axis(walls, wall, WALL_TANGENT_2), p)
        solver.normal[i] = pn
        solver.across[i, 0], solver.across[i, 1] = pa, pb
        if not pn >= lowest:
            lowest = pn
            loser = i
        if not is_in_cone(pn, pa, pb, scratch.contacts.slot[i], scratch):
            holds = False
    return loser, holds


@inlined
def _coordinates_along(axis, n, contacts):
    """Coordinates of n contacts along an axis, from the centre of mass, one lane each [m]."""
    return (
        axis[0] * gather_column(contacts.arm, 0, n)
        + axis[1] * gather_column(contacts.arm, 1, n)
        + axis[2] * gather_column(contacts.arm, 2, n)
    )


@inlined
def distribute_by_load(n, scratch):
    """Distribute the tangential impulses of the active contacts of one wall, so that all are in their friction cones.

    Returns whether this succeeds; then `solver.across` is written. Their sum P_t and moment stay the same. Let g_i be
    weights, at first the normal impulses p_n,i, r_g the centre of the contacts with these weights, and
    ρ_i = r_i - r_g. The tangential impulses are p_t,i = g_i u_i with

        u_i = P_t / Σg + α n x ρ_i,    α = T_n / Σ g ρ²,

    where T_n is the moment of the tangential impulses about r_g. Weiszfeld's weights μ p_n,i / |u_i| would bring all
    contacts equally near to their cones; the new weights are the geometric means of these and the old ones. The u_i are
    velocities of a rigid motion, against which friction has at most the power Σ μ p_n,i |u_i|. If Σ p_t,i·u_i is
    larger, no distribution is in the cones.
    """
    scene, contacts, solver = scratch.scene, scratch.contacts, scratch.solver
    walls, active, ratio = scene.walls, solver.active, friction_ratio(scratch.body)
    wall = wall_of(contacts.slot[first_active(n, solver)], scene)
    for i in range(n):
        if n > LANE_COUNT or (active[i] != 0 and wall_of(contacts.slot[i], scene) != wall):
            return False
    on = gather_numbers(active, n) * valid_lanes_mask(n)
    a, b = (
        _coordinates_along(wall_axis(walls, wall, WALL_TANGENT_1), n, contacts),
        _coordinates_along(wall_axis(walls, wall, WALL_TANGENT_2), n, contacts),
    )
    p, x, y = (
        on * gather_numbers(solver.normal, n),
        on * gather_column(solver.across, 0, n),
        on * gather_column(solver.across, 1, n),
    )
    fa, fb, spin, limit, g = lane_sum(x), lane_sum(y), lane_sum(a * y - b * x), friction_at(wall, scratch.body) * p, p
    for _ in range(_MAX_WEISZFELD_STEPS):
        s = 1.0 / lane_sum(g)
        ca, cb = s * lane_sum(g * a), s * lane_sum(g * b)
        da, db = a - ca, b - cb
        moment, second = spin - (ca * fb - cb * fa), lane_sum(g * (da * da + db * db))
        alpha = moment / second if second > 0.0 else 0.0
        x, y = s * fa - alpha * db, s * fb + alpha * da
        stretched = y / ratio
        size = g * lane_sqrt(x * x + stretched * stretched)
        if first_true_lane(~(size <= limit)) < 0:
            for i in range(n):
                if active[i] != 0:
                    solver.across[i, 0], solver.across[i, 1] = (g * x)[i], (g * y)[i]
            return True
        slip = ratio * y
        if lane_sum(g * (x * x + y * y)) > lane_sum(limit * lane_sqrt(x * x + slip * slip)):
            return False
        g = select_lanes(size > 0.0, g * lane_sqrt(limit / size), g)
    return False
