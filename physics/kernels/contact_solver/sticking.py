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

from physics.compiler.decorators import inlined
from physics.kernels.contact_solver.impulse_distribution import (
    distribute_by_bolt_group,
    distribute_by_load,
    is_in_cone,
    solve_symmetric,
)
from physics.kernels.contact_solver.one_contact import wall_to_world
from physics.kernels.contact_solver.sticking_twist import (
    RIGID_TWIST_TOLERANCE,
    FreeMotion,
    bolt_group,
    largest_free_speed,
    largest_target_speed,
    sticking_twist,
    world_target,
)
from physics.kernels.half_space.contact_point import contact_arm, wall_axes, wall_axis, wall_of
from physics.kernels.math import quaternion as qt
from physics.kernels.math.vector import minus
from physics.kernels.state.layout import WALL_NORMAL, WALL_TANGENT_1, WALL_TANGENT_2


@inlined
def _target_residual(n, v, w, scratch):
    """Largest error of the contact velocities at the twist (v, w), relative to their targets [m/s].

    For a contact without impulse only a normal velocity below the target is an error, since it may separate.
    """
    walls = scratch.scene.walls
    worst = 0.0
    for i in range(n):
        m = qt.cross(w, contact_arm(scratch.contacts, i))
        t = world_target(i, scratch)
        d = (v[0] + m[0] - t[0], v[1] + m[1] - t[1], v[2] + m[2] - t[2])
        if scratch.solver.normal[i] > 0.0:
            worst = max(worst, math.sqrt(qt.dot(d, d)))
        else:
            worst = max(
                worst, -qt.dot(wall_axis(walls, wall_of(scratch.contacts.slot[i], scratch.scene), WALL_NORMAL), d)
            )
    return worst


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
    largest = largest_target_speed(n, contacts)
    for i in range(n):
        solver.active[i] = 1
    count = n
    while count > 0:
        group = bolt_group(n, count, scratch)
        v_new, w_new = sticking_twist(n, group, largest == 0.0, free, scratch)
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
                if not miss <= RIGID_TWIST_TOLERANCE * largest:
                    if miss > scratch.stage.target_error_limit:
                        residual = miss / largest_free_speed(n, free, scratch)
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
