"""Solve contacts that all stick: the impulses of a patch, an edge or a point, directly.

If all contacts move at their target velocities (none slides, none lifts off), the twist of the body after the solve is
known before the impulses are, except for the part that the contacts leave free:

- three points that are not on a line determine the whole twist;
- points on a line with the direction e leave the rotation ω·e; no impulse on the line changes its angular momentum;
- one point leaves every rotation about it. Its impulse is W⁻¹ (t - u), with the target t, the velocity u, and the 3x3
  inverse mass W at the point.

Many sets of impulses give this twist. Those of least norm are given by the bolt-group formula. With n contact points at
r_i, their centroid r̄, d_i = r_i - r̄ and the second moment K = Σ (|d_i|² 1 - d_i d_iᵀ),

    p_i = F / n + (K⁻¹ T) x d_i,

where F is the total impulse and T its moment about the centroid. (On a line 1/Σ|d_i|² takes the place of K⁻¹, at a
point 0.) A body at rest gets zero velocity, to the last bit, and a symmetric patch gets symmetric impulses. If some
impulses leave their friction cones although every contact pushes, the tangential impulses are distributed in proportion
to the normal ones instead: the same formula with the weights p_n. A contact that would have to pull opens, the one that
pulls most first. If each p_i is in its friction cone at the end, the contact problem is solved exactly. Otherwise some
contacts slide (`sliding_patch`, `gauss_seidel`).

The targets of sticking contacts need not belong to a rigid motion: `target_velocity.set_resting_targets` moves points
of a turning body apart, by nanometres a step when the body is about to stop. If such targets were met exactly, all
contacts would slide, and friction would be spent on this. So the targets are replaced by those of the twist that fits
them best, if this changes them by less than `stage.target_error_limit`.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from physics.compiler.decorators import inlined
from physics.kernels.contact_solver.impulse_distribution import (
    distribute_by_bolt_group,
    distribute_by_load,
    first_active,
    is_in_cone,
    solve_symmetric,
)
from physics.kernels.contact_solver.one_contact import wall_to_world
from physics.kernels.half_space.contact_point import contact_arm, wall_axes, wall_axis, wall_of
from physics.kernels.math import quaternion as qt
from physics.kernels.math.vector import minus
from physics.kernels.state.layout import WALL_NORMAL, WALL_TANGENT_1, WALL_TANGENT_2

# For a rectangular patch det K / tr(K)³ is (1 - s) s / 8, with s the smaller share of its second moment. Below this
# limit (edges 1 : 350) the patch counts as a line.
_COLLINEAR_LIMIT = 1.0e-6

# Errors of the target velocities up to this share of the largest target are rounding (of a least-squares fit over a
# patch that is not a line).
_RIGID_TWIST_TOLERANCE = 1.0e-11


class FreeMotion(NamedTuple):
    """Motion of the body without contact impulses, world frame.

    Attributes
    ----------
    R : tuple of 9 floats
        Principal frame to world.
    v : tuple of 3 floats
        Velocity of the centre of mass [m/s].
    L : tuple of 3 floats
        Angular momentum about it [kg m²/s].
    """

    R: tuple
    v: tuple
    L: tuple


class BoltGroup(NamedTuple):
    """Centroid and second moment of the contacts that are to stick, those with a flag in `solver.active`; world frame.

    Attributes
    ----------
    count : int
        Number of these contacts.
    center : tuple of 3 floats
        Their centroid r̄, from the centre of mass [m].
    second : tuple of 6 floats
        Their second moment K (00, 01, 02, 11, 12, 22) about the centroid [m²].
    is_line : bool
        True if they are on a line, or at a point.
    """

    count: int
    center: tuple
    second: tuple
    is_line: bool


@inlined
def _bolt_group(n, count, scratch):
    """Make the `BoltGroup` of the active contacts, `count` of the n contacts in `scratch`."""
    contacts = scratch.contacts
    cx = cy = cz = 0.0
    for i in range(n):
        if scratch.solver.active[i] == 0:
            continue
        cx += contacts.arm[i, 0]
        cy += contacts.arm[i, 1]
        cz += contacts.arm[i, 2]
    c = (cx / count, cy / count, cz / count)
    xx = xy = xz = yy = yz = zz = 0.0
    for i in range(n):
        if scratch.solver.active[i] == 0:
            continue
        x, y, z = minus(contact_arm(contacts, i), c)
        xx += x * x
        xy += x * y
        xz += x * z
        yy += y * y
        yz += y * z
        zz += z * z
    k = (yy + zz, -xy, -xz, xx + zz, -yz, xx + yy)
    return BoltGroup(count, c, k, count < 3 or _is_collinear(k))


@inlined
def _is_collinear(k):
    det = k[0] * (k[3] * k[5] - k[4] * k[4]) - k[1] * (k[1] * k[5] - k[4] * k[2]) + k[2] * (k[1] * k[4] - k[3] * k[2])
    return not det > _COLLINEAR_LIMIT * (k[0] + k[3] + k[5]) ** 3


@inlined
def _world_target(i, scratch):
    """Target velocity of contact i in the world frame [m/s]."""
    contacts = scratch.contacts
    n, a, b = contacts.target[i, 0], contacts.target[i, 1], contacts.target[i, 2]
    walls, wall = scratch.scene.walls, wall_of(contacts.slot[i], scratch.scene)
    return (
        n * walls[wall, WALL_NORMAL] + a * walls[wall, WALL_TANGENT_1] + b * walls[wall, WALL_TANGENT_2],
        n * walls[wall, WALL_NORMAL + 1] + a * walls[wall, WALL_TANGENT_1 + 1] + b * walls[wall, WALL_TANGENT_2 + 1],
        n * walls[wall, WALL_NORMAL + 2] + a * walls[wall, WALL_TANGENT_1 + 2] + b * walls[wall, WALL_TANGENT_2 + 2],
    )


@inlined
def _largest_target_speed(n, contacts):
    largest = 0.0
    for i in range(n):
        for c in range(3):
            largest = max(largest, abs(contacts.target[i, c]))
    return largest


@inlined
def _target_moments(n, group, scratch):
    """Mean of the target velocities t_i of the active contacts [m/s], and Σ d_i x t_i, d_i from their centroid."""
    count, c = group.count, group.center
    s = (0.0, 0.0, 0.0)
    m = (0.0, 0.0, 0.0)
    for i in range(n):
        if scratch.solver.active[i] == 0:
            continue
        t = _world_target(i, scratch)
        d = qt.cross(minus(contact_arm(scratch.contacts, i), c), t)
        s = (s[0] + t[0], s[1] + t[1], s[2] + t[2])
        m = (m[0] + d[0], m[1] + d[1], m[2] + d[2])
    return (s[0] / count, s[1] / count, s[2] / count), m


@inlined
def _target_residual(n, v, w, scratch):
    """Largest error of the contact velocities at the twist (v, w), relative to their targets [m/s].

    For a contact without impulse only a normal velocity below the target is an error, since it may separate.
    """
    walls = scratch.scene.walls
    worst = 0.0
    for i in range(n):
        m = qt.cross(w, contact_arm(scratch.contacts, i))
        t = _world_target(i, scratch)
        d = (v[0] + m[0] - t[0], v[1] + m[1] - t[1], v[2] + m[2] - t[2])
        if scratch.solver.normal[i] > 0.0:
            worst = max(worst, math.sqrt(qt.dot(d, d)))
        else:
            worst = max(
                worst, -qt.dot(wall_axis(walls, wall_of(scratch.contacts.slot[i], scratch.scene), WALL_NORMAL), d)
            )
    return worst


@inlined
def _angular_velocity_about_line(n, group, vc, m, free, scratch):
    """Angular velocity of a body whose active contacts, on a line, move at their targets, world frame [rad/s].

    vc is the mean of the target velocities t and `m` is Σ d x t, both of `_target_moments`. Across the line the angular
    velocity is the least-squares fit Σ d x t / Σ|d|². Along the line's unit vector e it is α, from the condition that
    the contacts exert no moment about the line: e·(I ω - L - c x M (v₁ - v)) = 0, with the mass M, the centroid c, and
    v₁ = vc - ω x c.
    """
    body = scratch.body
    J, c, k, (R, v, L) = body.J, group.center, group.second, free
    first = minus(contact_arm(scratch.contacts, first_active(n, scratch.solver)), c)
    size2 = 0.5 * (k[0] + k[3] + k[5])
    s = 1.0 / math.sqrt(first[0] * first[0] + first[1] * first[1] + first[2] * first[2])
    e = (s * first[0], s * first[1], s * first[2])
    s = 1.0 / size2
    w = (s * m[0], s * m[1], s * m[2])
    eb, wb = qt.transposed_matvec(R, e), qt.transposed_matvec(R, w)
    Ie = (eb[0] / J[0], eb[1] / J[1], eb[2] / J[2])
    wc = qt.cross(w, c)
    ec = qt.cross(e, c)
    gain = (vc[0] - wc[0] - v[0], vc[1] - wc[1] - v[1], vc[2] - wc[2] - v[2])
    top = qt.dot(e, L) - qt.dot(Ie, wb) + body.mass * qt.dot(ec, gain)
    alpha = top / (qt.dot(Ie, eb) + body.mass * qt.dot(ec, ec))
    return (w[0] + alpha * e[0], w[1] + alpha * e[1], w[2] + alpha * e[2])


@inlined
def _point_impulse(r, t, free, body):
    """Impulse at the point r, from the centre of mass, that gives this point the velocity t, world frame [N s].

    `free` is the motion without the impulse.
    """
    J, q, (R, v, L) = body.J, 1.0 / body.mass, free
    x, y, z = qt.transposed_matvec(R, r)
    Lb = qt.transposed_matvec(R, L)
    wb = (J[0] * Lb[0], J[1] * Lb[1], J[2] * Lb[2])
    turn = qt.cross(wb, (x, y, z))
    goal = minus(qt.transposed_matvec(R, minus(t, v)), turn)
    W = (
        q + J[2] * y * y + J[1] * z * z, -J[2] * x * y, -J[1] * x * z,
        q + J[2] * x * x + J[0] * z * z, -J[0] * y * z,
        q + J[1] * x * x + J[0] * y * y,
    )  # fmt: skip
    return qt.matvec(R, solve_symmetric(W, goal))


@inlined
def _sticking_twist(n, group, no_target, free, scratch):
    """Velocity and angular velocity of the body whose active contacts move at their targets, world frame.

    `no_target` is true if all targets are zero.
    """
    zero = (0.0, 0.0, 0.0)
    if no_target and not group.is_line:
        return zero, zero
    c = group.center
    vc, m = _target_moments(n, group, scratch)
    if group.count == 1:
        J, R, L = scratch.body.J, free.R, free.L
        P = _point_impulse(c, vc, free, scratch.body)
        m = qt.cross(c, P)
        b = qt.transposed_matvec(R, (L[0] + m[0], L[1] + m[1], L[2] + m[2]))
        w = qt.matvec(R, (J[0] * b[0], J[1] * b[1], J[2] * b[2]))
    elif group.is_line:
        w = _angular_velocity_about_line(n, group, vc, m, free, scratch)
    else:
        w = solve_symmetric(group.second, m)
    return minus(vc, qt.cross(w, c)), w


@inlined
def _solve_bolt_group(group, T):
    """Vector K⁻¹ T of the bolt-group formula for the moment T [N s/m]: 2 T / tr K on a line, 0 at a point."""
    k = group.second
    if group.count == 1:
        return (0.0, 0.0, 0.0)
    if group.is_line:
        s = 2.0 / (k[0] + k[3] + k[5])
        return (s * T[0], s * T[1], s * T[2])
    return solve_symmetric(k, T)


@inlined
def _restore_moment(n, group, T, scratch):
    """Correct the impulses of `distribute_by_load`, so that their moment is T; return whether all stay in their cones.

    `distribute_by_load` takes all contacts to be equally far from the centre of mass along the normal, which is so to a
    few slops. The missing moment ΔT adds the impulses (K⁻¹ ΔT) x d_i of the bolt-group formula.
    """
    scene, contacts, solver = scratch.scene, scratch.contacts, scratch.solver
    walls, c = scene.walls, group.center
    mx, my, mz = T
    for i in range(n):
        if solver.active[i] == 0:
            continue
        wall, d = wall_of(contacts.slot[i], scene), minus(contact_arm(contacts, i), c)
        pn, pa, pb = solver.normal[i], solver.across[i, 0], solver.across[i, 1]
        p = wall_to_world(wall_axes(walls, wall), pn, pa, pb, (0.0, 0.0, 0.0))
        m = qt.cross(d, p)
        mx, my, mz = mx - m[0], my - m[1], mz - m[2]
    a = _solve_bolt_group(group, (mx, my, mz))
    for i in range(n):
        if solver.active[i] == 0:
            continue
        wall = wall_of(contacts.slot[i], scene)
        p = qt.cross(a, minus(contact_arm(contacts, i), c))
        pn = solver.normal[i] + qt.dot(wall_axis(walls, wall, WALL_NORMAL), p)
        pa = solver.across[i, 0] + qt.dot(wall_axis(walls, wall, WALL_TANGENT_1), p)
        pb = solver.across[i, 1] + qt.dot(wall_axis(walls, wall, WALL_TANGENT_2), p)
        solver.normal[i], solver.across[i, 0], solver.across[i, 1] = pn, pa, pb
        if not (pn >= 0.0 and is_in_cone(pn, pa, pb, contacts.slot[i], scratch)):
            return False
    return True


@inlined
def _largest_free_speed(n, free, scratch):
    """Largest component of contact velocities without impulses, less their targets [m/s]: the scale of a residual."""
    J, (R, v, L) = scratch.body.J, free
    b = qt.transposed_matvec(R, L)
    w = qt.matvec(R, (J[0] * b[0], J[1] * b[1], J[2] * b[2]))
    largest = 0.0
    for i in range(n):
        m = qt.cross(w, contact_arm(scratch.contacts, i))
        t = _world_target(i, scratch)
        largest = max(largest, abs(v[0] + m[0] - t[0]), abs(v[1] + m[1] - t[1]), abs(v[2] + m[2] - t[2]))
    return largest


@inlined
def solve_all_sticking(n, R, v, L, scratch):
    """Try to find impulses with which all n contacts move at their target velocities, or open.

    Parameters
    ----------
    n : int
        Number of contacts in `scratch`: arm, target and slot are read; impulse is written if found.
    R : tuple of 9 floats
        Principal frame to world.
    v, L : tuple of 3 floats
        Velocity [m/s] and angular momentum [kg m²/s] without contact impulses, world frame.

    Returns
    -------
    found : bool
        False if there are no such impulses. `contacts.impulse` is then unchanged.
    v, L : tuple of 3 floats
        Velocity and angular momentum with the contact impulses, if found.
    residual : float
        Largest error of the velocities, relative to the largest free contact speed; 0 within the allowed errors.
    """
    contacts, solver = scratch.contacts, scratch.solver
    J, mass, free = scratch.body.J, scratch.body.mass, FreeMotion(R, v, L)
    largest = _largest_target_speed(n, contacts)
    for i in range(n):
        solver.active[i] = 1
    count = n
    while count > 0:
        group = _bolt_group(n, count, scratch)
        v_new, w_new = _sticking_twist(n, group, largest == 0.0, free, scratch)
        wb = qt.transposed_matvec(R, w_new)
        L_new = qt.matvec(R, (wb[0] / J[0], wb[1] / J[1], wb[2] / J[2]))
        F = (mass * (v_new[0] - v[0]), mass * (v_new[1] - v[1]), mass * (v_new[2] - v[2]))
        m = qt.cross(group.center, F)
        T = (L_new[0] - L[0] - m[0], L_new[1] - L[1] - m[1], L_new[2] - L[2] - m[2])
        a = _solve_bolt_group(group, T)
        loser, holds = distribute_by_bolt_group(n, count, group.center, F, a, scratch)
        if loser < 0:
            if not holds and not (distribute_by_load(n, scratch) and _restore_moment(n, group, T, scratch)):
                return False, v, L, 0.0
            residual = 0.0
            if largest > 0.0 or count < n:
                miss = _target_residual(n, v_new, w_new, scratch)
                if not miss <= _RIGID_TWIST_TOLERANCE * largest:
                    if miss > scratch.stage.target_error_limit:
                        residual = miss / _largest_free_speed(n, free, scratch)
                    if not residual <= scratch.settings.tolerance:
                        return False, v, L, 0.0
            for i in range(n):
                contacts.impulse[3 * i] = solver.normal[i]
                contacts.impulse[3 * i + 1] = solver.across[i, 0]
                contacts.impulse[3 * i + 2] = solver.across[i, 1]
            return True, v_new, L_new, residual
        solver.active[loser] = 0
        solver.normal[loser] = solver.across[loser, 0] = solver.across[loser, 1] = 0.0
        count -= 1
    return False, v, L, 0.0
