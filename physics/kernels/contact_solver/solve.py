"""Solve the contact problem of one body: directly, else by sweeps and Newton's method, else by pivoting.

See the package docstring for the problem and the order of the solvers.
"""

from __future__ import annotations

from physics.compiler.decorators import if_given, inlined, kernel, shared_kernel
from physics.compiler.simd import LANE_COUNT
from physics.kernels.contact_law.anisotropic_friction import stretch_tangents, unstretch_tangents
from physics.kernels.contact_law.compliance import add_delassus_compliance, contact_stiffness
from physics.kernels.contact_law.materials import friction_at, friction_of
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

# Pivoting is tried only for residuals above this share of the largest free contact speed. The pyramid's octagon is
# wrong by up to 1 - cos(π/8) = 8 % of the friction, so a smaller residual of sweeps is more exact.
_PIVOTING_THRESHOLD = 0.01

# Residual by rounding, relative to the largest free contact speed: the smallest tolerance.
_ROUNDING = 1.0e-12

# Sweeps before each turn of Newton's method: most problems that are left for sweeps need fewer than ten.
_SWEEPS_PER_ROUND = 12

# The first turns of Newton's method end early if it does not converge soon; later turns, and the last one, do not.
_QUICK_NEWTON_ROUNDS = 10

# Largest number of pivots of the fallback: several times the unknowns of a dozen contacts.
MAX_PIVOTS = 500


@if_given("contact.friction", 1)
def rows_per_contact(contact):
    """Number of unknown impulses of a contact: 1 without friction, 3 with it; `contact` is a `ContactSwitches`."""
    return 3


@inlined
def _largest_free_speed(rows, bias):
    """Largest size of the first `rows` free contact velocities `bias` [m/s]: the scale of the relative residual."""
    largest = 0.0
    for r in range(rows):
        largest = max(largest, abs(bias[r]))
    return largest


def _pivot_normals(n, contact, scratch):
    """Solve the assembled contact problem without friction by pivoting; return its residual [m/s]."""
    contacts = scratch.contacts
    p, W, b, u = contacts.impulse, contacts.delassus, contacts.bias, contacts.velocity
    solve_normal_lcp(W, b, n, p, scratch.solver.fallback_float, scratch.solver.fallback_int, MAX_PIVOTS)
    update_contact_velocities(n, W, p, b, u)
    return normal_residual(n, p, u, W)


@if_given("contact.friction", _pivot_normals)
def _pivot(n, contact, scratch):
    """Solve the assembled contact problem by pivoting, with a friction pyramid; return the friction cone's residual."""
    contacts, solver = scratch.contacts, scratch.solver
    p, W, b, u = contacts.impulse, contacts.delassus, contacts.bias, contacts.velocity
    solve_pyramid_lcp(W, b, contacts.friction, n, p, solver.fallback_float, solver.fallback_int, MAX_PIVOTS)
    update_contact_velocities(3 * n, W, p, b, u)
    return cone_residual(n, p, u, contacts.friction, solver.local)


@kernel
def _solve_by_pivoting(n, contact, residual, scratch):
    """Solve by pivoting, and keep the impulses if their residual is below `residual`, that of the sweeps.

    Returns the residual of the impulses that are kept [m/s].
    """
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
    """Solve by pivoting if the residual of the sweeps is above `limit` [m/s]: (residual [m/s], method)."""
    if residual <= limit:
        return residual, METHOD_SWEEPS
    return _solve_by_pivoting(n, contact, residual, scratch), METHOD_PIVOTING


@inlined
def _apply_impulses(n, width, v, L, scratch):
    """Velocity v + Σ P/m and angular momentum L + Σ r x P after the impulses of n contacts, `width` numbers each."""
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
    """Call `solve_all_sticking`; as a kernel of its own it is compiled once for both calls in `_solve_directly`."""
    return solve_all_sticking(n, R, v, L, scratch)


@shared_kernel
def _solve_directly(n, friction, R, v, L, scratch):
    """Try the direct solvers `solve_all_sticking` and `solve_single_wall`: (found, v, L, residual).

    The one that is more likely to succeed comes first. For a single contact this is `solve_single_wall`. For three or
    four contacts of one wall `may_stick` decides. For two contacts, and for contacts of several walls, it is the
    one that succeeded last. Compliant contacts never stick; one or two of them go to `solve_single_wall`.

    The attempts are written without a loop: before a loop LLVM would compute numbers that only one attempt needs, even
    if this attempt is not made.
    """
    scene, stage = scratch.scene, scratch.stage
    wall, is_soft = wall_of(scratch.contacts.slot[0], scene), contact_stiffness(scratch.body) > 0.0
    is_one_wall = n <= LANE_COUNT and wall_of(scratch.contacts.slot[n - 1], scene) == wall
    may_all_hold, holds_first = friction is not None and not is_soft, False
    if may_all_hold and n > 1:
        holds_first = stage.mode == TRY_STICKING
        if is_one_wall and n > 2:
            holds_first = may_stick(n, friction_at(wall, scratch.body), wall_axes(scene.walls, wall), v, L, scratch)
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
    """Assemble the contact problem of n contacts in `scratch.contacts`; return the largest free contact speed [m/s]."""
    J = scratch.body.J
    mb = qt.transposed_matvec(R, L)
    assemble_delassus(n, width, R, v, qt.matvec(R, (J[0] * mb[0], J[1] * mb[1], J[2] * mb[2])), scratch)
    stretch_tangents(n, scratch)
    add_delassus_compliance(n, width, scratch)
    return _largest_free_speed(width * n, scratch.contacts.bias)


def _sweep_normals(n, contact, goal, scratch):
    """Solve the assembled problem without friction by sweeps, to the residual `goal` [m/s]: (sweeps, residual)."""
    contacts = scratch.contacts
    if contact_stiffness(scratch.body) > 0.0:
        # W is positive definite, but sweeps converge slowly if the compliance γ is small: a few pivots first.
        floats, index = scratch.solver.fallback_float, scratch.solver.fallback_int
        solve_normal_lcp(contacts.delassus, contacts.bias, n, contacts.impulse, floats, index, MAX_PIVOTS)
    return normal_sweeps(n, goal, scratch.settings.sweeps, contacts)


@if_given("contact.friction", _sweep_normals)
def _sweep_and_newton(n, contact, goal, scratch):
    """Solve the assembled problem with friction by sweeps and Newton's method in turn, to the residual `goal` [m/s].

    Returns (sweeps and Newton steps, residual [m/s]).
    """
    steps, residual = 0, 0.0
    invert_contact_blocks(n, scratch)
    for i in range(n):
        scratch.contacts.friction[i] = friction_of(scratch.contacts.slot[i], scratch)
    left, at_once, turns = scratch.settings.sweeps, _SWEEPS_PER_ROUND, 0
    if contact_stiffness(scratch.body) > 0.0:
        # Newton's method first: it distributes tangential impulses evenly, and normal impulses are unique here.
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
    """Solve the contact problem by sweeps, Newton's method and pivoting; arguments and result of `solve_contacts`.

    It is not inlined, since few problems need it.
    """
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
    """Solve the contact problem of n contacts in `scratch`: impulses that bring them to their targets, within friction.

    Solvers are tried in this order: the direct ones `solve_all_sticking` and `solve_single_wall`; sweeps in turn with
    Newton's method; pivoting. The first whose residual is within the tolerance gives the result.

    Parameters
    ----------
    n : int
        Number of contacts in `scratch.contacts`, one at least. Their slot, arm and target are read. Their impulses are
        the warm start, and are overwritten by the solution.
    contact : ContactSwitches
        Without friction there is one row per contact; without pivots there is no pivoting fallback.
    v, L : tuples of 3 floats
        Velocity [m/s] and angular momentum [kg m²/s] without contact impulses.
    R : tuple of 9 floats
        Principal frame to world.

    Returns
    -------
    v, L : tuples of 3 floats
        Velocity and angular momentum after the impulses.
    residual : float
        Residual, relative to the largest free contact speed.
    sweeps : int
        Sweeps and Newton steps made.
    method : int
        METHOD_DIRECT, METHOD_SWEEPS or METHOD_PIVOTING, the last one tried.
    """
    found, v_new, L_new, residual = _solve_directly(n, contact.friction, R, v, L, scratch)
    if found:
        return v_new, L_new, residual, 0, METHOD_DIRECT
    return _solve_iteratively(n, contact, v, L, R, scratch)
