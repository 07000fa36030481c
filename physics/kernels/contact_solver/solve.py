"""One contact problem: directly, else by sweeps and Newton, else by pivoting; with its residual."""

from __future__ import annotations

from physics.compiler.decorators import if_given, inlined, kernel, shared_kernel
from physics.compiler.simd import LANE_COUNT
from physics.kernels.contact_law.anisotropic_friction import stretch_tangents, unstretch_tangents
from physics.kernels.contact_law.compliance import add_delassus_compliance, contact_stiffness
from physics.kernels.contact_solver.friction_pyramid import solve_normal_lcp, solve_pyramid_lcp
from physics.kernels.contact_solver.gauss_seidel import (
    assemble_delassus,
    cone_residual,
    cone_sweeps,
    invert_contact_blocks,
    normal_residual,
    normal_sweeps,
    update_contact_velocities,
)
from physics.kernels.contact_solver.patch_start import may_stick
from physics.kernels.contact_solver.proximal_newton import proximal_newton
from physics.kernels.contact_solver.single_wall import solve_single_wall
from physics.kernels.contact_solver.sliding_patch import TRY_STICKING
from physics.kernels.contact_solver.sticking import solve_all_sticking
from physics.kernels.half_space.contact_point import wall_axes, wall_of
from physics.kernels.math import quaternion as qt
from physics.kernels.state.layout import METHOD_DIRECT, METHOD_PIVOTING, METHOD_SWEEPS

# The pyramid's octagon is off by up to 1 - cos(π/8) = 8 % of the friction. Sweeps that stall nearer to a
# solution than this share of the largest free contact speed know it better: their residual is reported as it
# is.
_PIVOTING_THRESHOLD = 0.01

# Residual that rounding leaves, relative to the largest free contact speed: the smallest tolerance.
_ROUNDING = 1.0e-12

# Sweeps before Newton's method has a turn: most problems that are left for sweeps need fewer than ten.
_SWEEPS_PER_ROUND = 12

# Turns of Newton's method that end early, unless there is no other; what they leave it is given its time for.
_QUICK_NEWTON_ROUNDS = 10

# Pivots of the fallback at most: several times the unknowns of a dozen contacts.
MAX_PIVOTS = 500


@if_given("contact.friction", 1)
def rows_per_contact(contact):
    """Number of unknowns of a contact: the normal impulse, and with friction two more."""
    return 3


@inlined
def _largest_free_speed(rows, bias):
    """Largest free contact speed [m/s]: the scale of the relative residual."""
    largest = 0.0
    for r in range(rows):
        largest = max(largest, abs(bias[r]))
    return largest


def _pivot_normals(n, contact, scratch):
    """Pivoting without friction; the residual [m/s]."""
    contacts = scratch.contacts
    p, W, b, u = contacts.impulse, contacts.delassus, contacts.bias, contacts.velocity
    solve_normal_lcp(W, b, n, p, scratch.solver.fallback_float, scratch.solver.fallback_int, MAX_PIVOTS)
    update_contact_velocities(n, W, p, b, u)
    return normal_residual(n, p, u, W)


@if_given("contact.friction", _pivot_normals)
def _pivot(n, contact, scratch):
    """Pivoting with the friction pyramid; the residual against the cone [m/s]."""
    contacts, solver = scratch.contacts, scratch.solver
    p, W, b, u = contacts.impulse, contacts.delassus, contacts.bias, contacts.velocity
    solve_pyramid_lcp(W, b, contacts.friction, n, p, solver.fallback_float, solver.fallback_int, MAX_PIVOTS)
    update_contact_velocities(3 * n, W, p, b, u)
    return cone_residual(n, p, u, contacts.friction, solver.local)


@kernel
def _solve_by_pivoting(n, contact, residual, scratch):
    """Solve by pivoting, and keep the result if it beats that of the sweeps. Returns the residual [m/s]."""
    rows = n * rows_per_contact(contact)
    for r in range(rows):
        scratch.solver.saved[r] = scratch.contacts.impulse[r]
    after = _pivot(n, contact, scratch)
    if not after < residual:
        for r in range(rows):
            scratch.contacts.impulse[r] = scratch.solver.saved[r]
        after = residual
    return after


def _keep_sweeps(n, contact, limit, residual, scratch):
    return residual, METHOD_SWEEPS


@if_given("contact.pivots", _keep_sweeps)
def _pivot_above(n, contact, limit, residual, scratch):
    """Solve by pivoting where sweeps left more than `limit` [m/s]: (residual, method)."""
    if residual <= limit:
        return residual, METHOD_SWEEPS
    return _solve_by_pivoting(n, contact, residual, scratch), METHOD_PIVOTING


@inlined
def _apply_impulses(n, width, v, L, scratch):
    """Velocity and angular momentum after the impulses: v + Σ P/m, L + Σ r x P."""
    contacts = scratch.contacts
    walls = scratch.scene.walls
    inv_mass = 1.0 / scratch.body.mass
    px = py = pz = lx = ly = lz = 0.0
    for i in range(n):
        wall = wall_of(contacts.slot[i], scratch.scene)
        x = y = z = 0.0
        for c in range(width):
            s = contacts.impulse[width * i + c]
            x += s * walls[wall, 3 * c]
            y += s * walls[wall, 3 * c + 1]
            z += s * walls[wall, 3 * c + 2]
        rx, ry, rz = contacts.arm[i, 0], contacts.arm[i, 1], contacts.arm[i, 2]
        px, py, pz = px + x, py + y, pz + z
        lx, ly, lz = lx + (ry * z - rz * y), ly + (rz * x - rx * z), lz + (rx * y - ry * x)
    return (
        (v[0] + inv_mass * px, v[1] + inv_mass * py, v[2] + inv_mass * pz),
        (L[0] + lx, L[1] + ly, L[2] + lz),
    )


@kernel
def _solve_sticking(n, R, v, L, scratch):
    """Call `solve_all_sticking`, in a function of its own, since its place varies and it is compiled once."""
    return solve_all_sticking(n, R, v, L, scratch)


@shared_kernel
def _solve_directly(n, friction, R, v, L, scratch):
    """Try all contacts sticking, and all sliding, the likelier first: (found, v, L, residual).

    `sliding_patch` solves any single contact. An edge, or contacts of several walls, begin with the attempt that
    succeeded last. Springs never stick, nor is their normal motion known beforehand; one or two of them go to
    `sliding_patch`.

    The attempts are written without a loop. LLVM would compute, before a loop, numbers that only one attempt needs,
    whether that is made or not.
    """
    scene, stage = scratch.scene, scratch.stage
    wall, is_soft = wall_of(scratch.contacts.slot[0], scene), contact_stiffness(scratch.body) > 0.0
    is_one_wall = n <= LANE_COUNT and wall_of(scratch.contacts.slot[n - 1], scene) == wall
    may_all_hold, holds_first = friction is not None and not is_soft, False
    if may_all_hold and n > 1:
        holds_first = stage.mode == TRY_STICKING
        if is_one_wall and n > 2:
            holds_first = may_stick(n, wall_axes(scene.walls, wall), v, L, scratch)
    found, v_new, L_new, residual = False, v, L, 0.0
    if holds_first:
        found, v_new, L_new, residual = _solve_sticking(n, R, v, L, scratch)
        if found:
            stage.mode = TRY_STICKING
    if not found and is_one_wall and not (is_soft and n > 2):
        found, v_new, L_new, residual = solve_single_wall(n, friction, wall, R, v, L, scratch)
    if not found and may_all_hold and not holds_first:
        found, v_new, L_new, residual = _solve_sticking(n, R, v, L, scratch)
        if found:
            stage.mode = TRY_STICKING
    return found, v_new, L_new, residual


@inlined
def _assemble_problem(n, width, R, v, L, scratch):
    """Assemble the contact problem; return the largest free contact speed."""
    J = scratch.body.J
    mb = qt.transposed_matvec(R, L)
    assemble_delassus(n, width, R, v, qt.matvec(R, (J[0] * mb[0], J[1] * mb[1], J[2] * mb[2])), scratch)
    stretch_tangents(n, scratch)
    add_delassus_compliance(n, width, scratch)
    return _largest_free_speed(width * n, scratch.contacts.bias)


def _sweep_normals(n, contact, goal, scratch):
    """Sweeps without friction: (sweeps, residual [m/s])."""
    contacts = scratch.contacts
    if contact_stiffness(scratch.body) > 0.0:
        # W is positive definite, but sweeps crawl where γ is small: a few pivots first.
        floats, index = scratch.solver.fallback_float, scratch.solver.fallback_int
        solve_normal_lcp(contacts.delassus, contacts.bias, n, contacts.impulse, floats, index, MAX_PIVOTS)
    return normal_sweeps(n, goal, scratch.settings.sweeps, contacts)


@if_given("contact.friction", _sweep_normals)
def _sweep_and_newton(n, contact, goal, scratch):
    """Alternate sweeps with Newton's method: (sweeps and steps, residual [m/s])."""
    steps, residual = 0, 0.0
    invert_contact_blocks(n, scratch)
    for i in range(n):
        scratch.contacts.friction[i] = scratch.body.mu
    left, at_once, turns = scratch.settings.sweeps, _SWEEPS_PER_ROUND, 0
    if contact_stiffness(scratch.body) > 0.0:
        # The normals are determined, and Newton's method shares tangents out evenly.
        at_once = 0
    while True:
        sweeps, residual = cone_sweeps(n, scratch.contacts.friction, goal, min(left, at_once), scratch)
        at_once = _SWEEPS_PER_ROUND
        steps += sweeps
        left -= sweeps
        if residual <= goal or left <= 0:
            break
        is_quick = turns < _QUICK_NEWTON_ROUNDS and left > _SWEEPS_PER_ROUND
        newtons, residual = proximal_newton(n, residual, goal, is_quick, scratch)
        turns += 1
        steps += newtons
        if residual <= goal:
            break
    return steps, residual


@shared_kernel
def _solve_iteratively(n, contact, v, L, R, scratch):
    """Solve as `solve_contacts` by sweeps and later solvers; not inlined, since few problems come to it."""
    width = rows_per_contact(contact)
    scale = _assemble_problem(n, width, R, v, L, scratch)
    goal = max(min(scratch.settings.tolerance * scale, scratch.stage.residual_limit), _ROUNDING * scale)
    sweeps, residual = _sweep_and_newton(n, contact, goal, scratch)
    residual, method = _pivot_above(n, contact, max(goal, _PIVOTING_THRESHOLD * scale), residual, scratch)
    unstretch_tangents(n, scratch)
    v, L = _apply_impulses(n, width, v, L, scratch)
    if scale > 0.0:
        residual /= scale
    return v, L, residual, sweeps, method


@kernel
def solve_contacts(n, contact, v, L, R, scratch):
    """Contact impulses that bring the contacts of `scratch` to their target velocities as far as they can.

    Tried in this order: `solve_all_sticking` and `solve_single_wall`, directly, the likelier one first; sweeps in turn
    with Newton's method; pivoting. The first whose residual is within the tolerance gives the result.

    Parameters
    ----------
    n : int
        Contacts in `scratch`, one at least: slot, arm, target are read, impulse (width * n, the warm start)
        overwritten.
    contact : ContactSwitches
        Without friction one row per contact; without pivots no pivoting fallback.
    v, L : tuples of 3 floats
        Velocity [m/s] and angular momentum [kg m²/s] without contact impulses.
    R : tuple of 9 floats
        Principal frame to world.

    Returns
    -------
    v, L : tuples of 3 floats
        After the impulses.
    residual : float
        Relative to the largest free contact speed.
    sweeps : int
    method : int
        METHOD_DIRECT, METHOD_SWEEPS or METHOD_PIVOTING.
    """
    found, v_new, L_new, residual = _solve_directly(n, contact.friction, R, v, L, scratch)
    if found:
        return v_new, L_new, residual, 0, METHOD_DIRECT
    return _solve_iteratively(n, contact, v, L, R, scratch)
