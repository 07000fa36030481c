"""Solve up to four contacts of one wall directly: one or two (`two_contacts`), or a face (`sliding_patch`)."""

from __future__ import annotations

from typing import NamedTuple

from physics.compiler.decorators import inlined
from physics.kernels.contact_law.anisotropic_friction import friction_ratio, stretched_frame
from physics.kernels.contact_law.materials import friction_of
from physics.kernels.contact_solver.contact_pair import contact_in_wall_frame
from physics.kernels.contact_solver.one_contact import FreeBody, motion_in_wall_frame, wall_to_world
from physics.kernels.contact_solver.patch import PatchProblem, gather_patch
from physics.kernels.contact_solver.patch_algebra import largest_free_speed
from physics.kernels.contact_solver.patch_start import cold_start_motion, warm_start_motion
from physics.kernels.contact_solver.sliding_patch import TRY_MIXED, TRY_SLIDING, solve_sliding_patch
from physics.kernels.contact_solver.two_contacts import solve_one_contact, solve_two_contacts
from physics.kernels.half_space.contact_point import wall_axes
from physics.kernels.math.simd_gather import valid_lanes_mask

# Share of the free contact speed by which an open contact may close while the pushing contacts are searched.
_CLOSING_TOLERANCE = 1.0e-2


class WallSolution(NamedTuple):
    """Result of the contacts of one wall: sums of their impulses, in the stretched frame of the wall.

    If found, the impulse of each contact is in `contacts.impulse`.

    Attributes
    ----------
    found : bool
        True if the impulses solve the problem.
    exerted : tuple of 5 floats
        Sums of the impulses along the tangents [N s], and of their moments about normal and tangents [N m s].
    push : float
        Sum of the normal impulses [N s].
    residual : float
        Residual [m/s].
    scale : float
        Largest free contact speed [m/s].
    """

    found: bool
    exerted: tuple
    push: float
    residual: float
    scale: float


@inlined
def _solve_face(n, friction, body, scratch):
    """Solve the n = 3 or 4 contacts of a face as a patch: a `WallSolution`; if found, `contacts.impulse` is written.

    `friction` is None without friction, and `body` is a `FreeBody`.
    """
    patch, on = gather_patch(n, body, scratch), valid_lanes_mask(n)
    mu = friction_of(scratch.contacts.slot[0], scratch)
    scale = largest_free_speed(friction, patch, body)
    start, is_mixed = (body.u[1], body.u[2], body.w[0]), False
    if friction is not None:
        start, is_of_now = warm_start_motion(n, patch, on, body, scratch)
        is_mixed = is_of_now and scratch.stage.mode == TRY_MIXED
        if not is_of_now and mu > 0.0:
            start = cold_start_motion(n, patch, on, mu, body)
    goal = scratch.settings.tolerance * scale
    loose = max(goal, _CLOSING_TOLERANCE * scale) if n > 3 else goal
    problem = PatchProblem(patch, body, mu, goal, loose)
    for patient in range(2):
        face, has_opened = solve_sliding_patch(n, patient > 0, problem, start, is_mixed, scratch)
        if face.found:
            p, x, y = face.impulses
            for i in range(n):
                _store_impulse(i, (p[i], x[i], y[i]), friction, scratch)
            return WallSolution(True, face.exerted, face.push, face.residual, scale)
        if not has_opened:
            break
    return WallSolution(False, (0.0, 0.0, 0.0, 0.0, 0.0), 0.0, 0.0, scale)


@inlined
def _store_impulse(i, p, friction, scratch):
    """Write the impulse p of contact i, in the stretched frame, to `contacts.impulse`, along the unit tangents."""
    contacts = scratch.contacts
    if friction is None:
        contacts.impulse[i] = p[0]
    else:
        contacts.impulse[3 * i], contacts.impulse[3 * i + 1] = p[0], p[1]
        contacts.impulse[3 * i + 2] = friction_ratio(scratch.body) * p[2]


@inlined
def _largest_component(friction, b):
    """Largest component of a contact velocity b [m/s]; without friction (None) only the normal one counts."""
    if friction is None:
        return abs(b[0])
    return max(abs(b[0]), max(abs(b[1]), abs(b[2])))


@inlined
def _solve_one_or_two(n, friction, body, scratch):
    """Solve the n = 1 or 2 contacts of a wall: a `WallSolution`; if found, `contacts.impulse` is written.

    `friction` is None without friction, and `body` is a `FreeBody`.
    """
    first, mu = contact_in_wall_frame(0, body, scratch), friction_of(scratch.contacts.slot[0], scratch)
    scale = _largest_component(friction, first.approach)
    if n == 1:
        found, p, m, miss = solve_one_contact(first, mu, scratch.settings.tolerance * scale, body, scratch)
    else:
        second = contact_in_wall_frame(1, body, scratch)
        scale = max(scale, _largest_component(friction, second.approach))
        found, p, q, m, miss = solve_two_contacts(first, second, mu, scratch.settings.tolerance * scale, body, scratch)
        if found:
            _store_impulse(1, q, friction, scratch)
            scratch.stage.mode = TRY_SLIDING
    if found:
        _store_impulse(0, p, friction, scratch)
    if n == 2:
        p = p[0] + q[0], p[1] + q[1], p[2] + q[2]
    return WallSolution(found, (p[1], p[2], m[0], m[1], m[2]), p[0], miss, scale)


@inlined
def solve_single_wall(n, friction, wall, R, v, L, scratch):
    """Try to find impulses with which the n contacts of one wall stick, slide or open.

    Parameters
    ----------
    n : int
        Number of contacts in `scratch`, at most four: arm, target, slot and impulse (the warm start) are read.
    friction : True or None
        None: without friction; `scratch.body.mu` is 0, and `contacts.impulse` has one number per contact.
    wall : int
        Index of the wall.
    R : tuple of 9 floats
        Principal frame to world.
    v, L : tuples of 3 floats
        Velocity [m/s] and angular momentum [kg m²/s] without contact impulses, world frame.

    Returns
    -------
    found : bool
        True if a solution was written to `contacts.impulse`; `stage.mode` then tells the method to try first next time.
    v, L : tuples of 3 floats
        Velocity and angular momentum with the contact impulses, if found.
    residual : float
        Residual, relative to the largest free contact speed.
    """
    axes, inv_mass, ratio = wall_axes(scratch.scene.walls, wall), 1.0 / scratch.body.mass, friction_ratio(scratch.body)
    K, u, w = motion_in_wall_frame(R, v, L, axes, scratch.body.J)
    K, u, w = stretched_frame(K, u, w, ratio)
    body = FreeBody(axes, u, w, K, inv_mass)
    if n < 3:
        solved = _solve_one_or_two(n, friction, body, scratch)
    else:
        solved = _solve_face(n, friction, body, scratch)
    if not solved.found:
        return False, v, L, 0.0
    miss = solved.residual
    if solved.scale > 0.0:
        miss /= solved.scale
    fa, fb, tn, ta, tb = solved.exerted
    v = wall_to_world(axes, inv_mass * solved.push, inv_mass * fa, ratio * (inv_mass * fb), v)
    return True, v, wall_to_world(axes, tn, ta, tb / ratio, L), miss
