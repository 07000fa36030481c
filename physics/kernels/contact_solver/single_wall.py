"""The contacts of one wall, up to four, solved directly: one or two (`two_contacts`), or a face (`sliding_patch`)."""

from __future__ import annotations

from physics.kernels.compile.decorators import inlined
from physics.kernels.contact_law.anisotropic_friction import friction_ratio, stretched_frame
from physics.kernels.contact_solver.one_contact import motion_in_wall_frame, wall_to_world
from physics.kernels.contact_solver.patch_algebra import (
    cold_start_motion,
    gather_patch,
    largest_free_speed,
    warm_start_motion,
)
from physics.kernels.contact_solver.sliding_patch import TRY_MIXED, TRY_SLIDING, solve_sliding_patch
from physics.kernels.contact_solver.two_contacts import contact_in_wall_frame, solve_one_contact, solve_two_contacts
from physics.kernels.half_space.contact_point import wall_axes
from physics.kernels.math.simd_gather import valid_lanes_mask

# Share of the free speed by which a contact that opened may close while it is sought which others push.
_CLOSING_TOLERANCE = 1.0e-2


@inlined
def _solve_face(n, friction, axes, u, w, inv_mass, K, work):
    """Three contacts or four: (found, tangents and moments, Σ p_n, residual, its scale), `work.impulse` when found."""
    patch, on = gather_patch(n, axes, inv_mass, K, work), valid_lanes_mask(n)
    scale = largest_free_speed(friction, patch, u, w)
    start, is_mixed = (u[1], u[2], w[0]), False
    if friction is not None:
        start, is_of_now = warm_start_motion(n, patch, on, u, w, inv_mass, K, work)
        is_mixed = is_of_now and work.mode == TRY_MIXED
        if not is_of_now and work.mu > 0.0:
            start = cold_start_motion(n, patch, on, work.mu, u, w, inv_mass, K)
    goal = work.tolerance * scale
    loose = max(goal, _CLOSING_TOLERANCE * scale) if n > 3 else goal
    for patient in range(2):
        found, impulses, exerted, push, miss, has_opened = solve_sliding_patch(
            n, patient > 0, work.mu, goal, loose, patch, start, is_mixed, axes, u, w, inv_mass, K, work
        )
        if found:
            for i in range(n):
                _store_impulse(i, (impulses[0][i], impulses[1][i], impulses[2][i]), friction, work)
            return True, exerted, push, miss, scale
        if not has_opened:
            break
    return False, (0.0, 0.0, 0.0, 0.0, 0.0), 0.0, 0.0, scale


@inlined
def _store_impulse(i, p, friction, work):
    """Impulse of contact i to `work.impulse`, along the unit tangents."""
    if friction is None:
        work.impulse[i] = p[0]
    else:
        work.impulse[3 * i], work.impulse[3 * i + 1] = p[0], p[1]
        work.impulse[3 * i + 2] = friction_ratio(work) * p[2]


@inlined
def _largest_component(friction, b):
    """Largest component of a contact velocity that impulses can change [m/s]."""
    if friction is None:
        return abs(b[0])
    return max(abs(b[0]), max(abs(b[1]), abs(b[2])))


@inlined
def _solve_one_or_two(n, friction, axes, u, w, inv_mass, K, work):
    """One contact or two, as `_solve_face`."""
    first = contact_in_wall_frame(0, axes, u, w, work)
    scale = _largest_component(friction, first[1])
    if n == 1:
        found, p, m, miss = solve_one_contact(first, work.mu, work.tolerance * scale, inv_mass, K, work)
    else:
        second = contact_in_wall_frame(1, axes, u, w, work)
        scale = max(scale, _largest_component(friction, second[1]))
        found, p, q, m, miss = solve_two_contacts(first, second, work.mu, work.tolerance * scale, inv_mass, K, work)
        if found:
            _store_impulse(1, q, friction, work)
            work.mode = TRY_SLIDING
    if found:
        _store_impulse(0, p, friction, work)
    if n == 2:
        p = p[0] + q[0], p[1] + q[1], p[2] + q[2]
    return found, (p[1], p[2], m[0], m[1], m[2]), p[0], miss, scale


@inlined
def solve_single_wall(n, friction, wall, R, v, L, work):
    """Try the impulses with which the n contacts of one wall slide, open, or turn about one that holds.

    Parameters
    ----------
    n : int
        Contacts in `work`, four at most: arm, target, slot and impulse (the warm start) are read.
    friction : True or None
        None: frictionless, `work.mu` is 0 and `work.impulse` has one number per contact.
    wall : int
        The wall.
    R : tuple of 9 floats
        Principal frame to world.
    v, L : tuples of 3 floats
        Velocity [m/s] and angular momentum [kg m²/s] without contact impulses, world frame.

    Returns
    -------
    found : bool
        Whether `work.impulse` was written; `work.mode` then says what to try first next time.
    v, L : tuples of 3 floats
        With the contact impulses, when found.
    residual : float
        Relative to the largest free contact speed.
    """
    axes, inv_mass, ratio = wall_axes(work.walls, wall), 1.0 / work.mass, friction_ratio(work)
    K, u, w = motion_in_wall_frame(R, v, L, axes, work.J)
    K, u, w = stretched_frame(K, u, w, ratio)
    if n < 3:
        found, exerted, push, miss, scale = _solve_one_or_two(n, friction, axes, u, w, inv_mass, K, work)
    else:
        found, exerted, push, miss, scale = _solve_face(n, friction, axes, u, w, inv_mass, K, work)
    if not found:
        return False, v, L, 0.0
    if scale > 0.0:
        miss /= scale
    fa, fb, tn, ta, tb = exerted
    v = wall_to_world(axes, inv_mass * push, inv_mass * fa, ratio * (inv_mass * fb), v)
    return True, v, wall_to_world(axes, tn, ta, tb / ratio, L), miss
