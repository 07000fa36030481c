"""Solve the contact problem of all bodies of a world at once, by a choice of methods, and report it.

A warm start that still solves the problem costs one look at the residual. Else the contacts fall into islands
(`islands`), and each that is not solved yet takes, in this order, as far as it is needed:

1. where there is one contact one sweep, which is exact then;
2. the guess that everything holds, unless the warm start says otherwise or, where there is none, contacts part by
   themselves: one linear system, the answer for what stands still, far below what is asked; once more after 3, where
   all contacts push only then;
3. a few sweeps, the answer for what meets and parts;
4. an interior-point method, which finds what holds, slides and opens whatever the start, and Newton's method on the
   twists from there, in turns;
5. sweeps up to their limit, from the best that was met.

An impact that is not to be solved finely begins with sweeps up to their limit: few contacts have anything to do in it.

In a resting stage, what is nearly at rest is solved a little further (`near_rest_refinement`).

What has a residual then that no impulses at all would beat, or a stress beyond reason, is solved without friction.

Where the linear system is dear for what it is worth (`proximal_newton.prepare_system`: many bodies that all lie on each
other, and move), sweeps up to their limit take the place of 2 to 5, so that what a step costs is in proportion to its
contacts; what they leave is reported. Iterations with the system are at most the sweeps allowed, either, but for those
of the last method begun.
"""

from __future__ import annotations

import math

from physics.compiler.decorators import inlined, kernel, shared_kernel
from physics.kernels.math.vector import row_vector
from physics.kernels.multibody.data.contact_set import put_vector
from physics.kernels.multibody.solver.block_lu import TWIST_DOFS
from physics.kernels.multibody.solver.contact_operator import (
    assemble_contact_blocks,
    max_contact_residual,
    velocity_error,
)
from physics.kernels.multibody.solver.gauss_seidel import sweep_contacts, sweep_normals
from physics.kernels.multibody.solver.interior_point import interior_point_contacts
from physics.kernels.multibody.solver.islands import find_islands
from physics.kernels.multibody.solver.near_rest_refinement import (
    is_in_balance,
    point_speed_bound,
    refine_near_rest,
)
from physics.kernels.multibody.solver.proximal_newton import (
    MIN_NEWTON_STEPS,
    MOVING_BUDGET,
    RESTING_BUDGET,
    is_every_contact_pushing,
    newton_contacts,
    prepare_system,
    restore_best,
    save_best,
    try_all_sticking,
)
from physics.kernels.state.layout import METHOD_NEWTON, METHOD_SWEEPS

# Share of the tolerance, or of this finer one, relative to the largest free velocity, that the guess that all
# holds is solved to: what stands finds nothing to do in the steps to come.
STICKING_SHARE = 1.0e-3
FINE_TOLERANCE = 1.0e-6

# Sweeps before the interior-point method.
FIRST_SWEEPS = 5

# A pile nearly lies where without impulses no contact would be faster than this many times what loads give in the
# stage.
_RESTING_FACTOR = 3.0

# Tolerance from which on impacts are swept first.
_COARSE_TOLERANCE = 1.0e-4

# Residual that rounding leaves, relative to the largest free velocity: the smallest tolerance.
_MIN_TOLERANCE = 1.0e-12

# Where bodies of one velocity touch, all that is left to solve is the rounding of that velocity, and nothing can be
# solved relative to it: u is the difference of two sums v + ω x r of three products and three terms each, every one of
# them rounded, which makes 2 · 6 · ε of the largest, and the impulses round the velocities once more.
_VELOCITY_ROUNDING = 16 * 2.0**-52

# An impulse is rounded, too, and with it the velocities, by up to this share of what it alone would give its bodies
# (half an ulp in it, in its moment, and in each of the sums): a light cube under a heavy one can be at rest no better.
_IMPULSE_ROUNDING = 2 * 2.0**-52

# Bodies that wedge by friction hold any stress. Impulses that alone would give this many times the free velocities are
# one that a method ran into, not what holds a million times a body's weight: what they leave is rounding.
_STRAIN_LIMIT = 1.0e9

# Sweeps without friction, where all else failed.
_FALLBACK_SWEEPS = 100

# Residual at which the interior-point method gives way to Newton's at the latest, relative to the largest velocity
# without impulses: below it, rounding does.
_INTERIOR_TOLERANCE = 1.0e-6

# Iterations of the first in a turn, steps of the second, and its ρ in units of the largest mass. Each turn goes on from
# the impulses that the one before ended with, the last one from none.
_INTERIOR_STEPS = (30, 30, 40)
_NEWTON_STEPS = (20, 40, 40)
NEWTON_RHO = (10.0, 1.0, 1.0)


@inlined
def save_free_twists(many):
    """Save the present twists, without any impulse (`many.bodies.free_twist`)."""
    for b in range(many.bodies.twist.shape[0]):
        for c in range(TWIST_DOFS):
            many.bodies.free_twist[b, c] = many.bodies.twist[b, c]


@inlined
def reset_body_to_free(b, many):
    """Reset the twist of body b to that without any impulse."""
    for c in range(TWIST_DOFS):
        many.bodies.twist[b, c] = many.bodies.free_twist[b, c]


@inlined
def clear_island_impulses(part, many):
    """Clear the impulses of an island."""
    for i in range(part[0], part[1]):
        put_vector(many.contacts.impulse, many.islands.contacts[i], 0, (0.0, 0.0, 0.0))
    for i in range(part[2], part[3]):
        reset_body_to_free(many.islands.bodies[i], many)


@inlined
def clear_all_impulses(n, many):
    """Clear all impulses."""
    for k in range(n):
        put_vector(many.contacts.impulse, k, 0, (0.0, 0.0, 0.0))
    for b in range(many.bodies.twist.shape[0]):
        reset_body_to_free(b, many)


@kernel
def alternate_second_order(part, friction, scale, residual, goal, limit, many):
    """Alternate interior point and Newton's method: (iterations, residual)."""
    count, best, start, last = 0, residual, residual, len(NEWTON_RHO) - 1
    save_best(part, many)
    for turn in range(last + 1):
        if turn == last:
            start = scale
            clear_island_impulses(part, many)
        count += interior_point_contacts(
            part, start, max(goal, _INTERIOR_TOLERANCE * scale), min(_INTERIOR_STEPS[turn], limit - count), many
        )
        now = max_contact_residual(part[0], part[1], friction, many)
        if now > goal and count < limit:
            more, now = newton_contacts(part, friction, now, goal, _NEWTON_STEPS[turn], NEWTON_RHO[turn], many)
            count += more
        if now < best:
            best = now
            save_best(part, many)
        if not now > goal or count >= limit:
            break
        start = now
    if not now <= best:
        restore_best(part, many)
    return count, best


@kernel
def sweep_as_fallback(part, friction, residual, goal, limit, many):
    """Sweep from the best impulses so far, and keep the better ones: (sweeps, residual)."""
    save_best(part, many)
    count, now = sweep_contacts(part[0], part[1], friction, residual, goal, limit, many)
    if not now < residual:
        restore_best(part, many)
        return count, residual
    return count, now


@inlined
def is_island_inactive(part, goal, many):
    """True if no contact of an island pushes, and none opens faster than `goal` [m/s] without impulses."""
    for i in range(part[0], part[1]):
        k = many.islands.contacts[i]
        if many.contacts.impulse[k, 0] > 0.0 or velocity_error(k, many)[0] > goal:
            return False
    return True


@inlined
def _is_swept_first(part, goal, scale, many):
    """True if an island is first solved by sweeps: it has one contact, or an impact at a coarse tolerance.

    An impact starts without impulses, and involves only the few contacts near it.
    """
    is_impact = many.settings[0].is_resting_stage == 0
    return part[1] - part[0] == 1 or (is_impact and goal >= _COARSE_TOLERANCE * scale)


@kernel
def solve_island(part, friction, scale, residual, goal, deep, many):
    """Solve one island from impulses of the given residual [m/s]: (iterations, residual, method).

    Islands of sticking contacts are solved to `deep` [m/s].
    """
    first, last, _, _ = part
    limit, count = many.settings[0].sweeps, 0
    if _is_swept_first(part, goal, scale, many):
        limit = limit if last - first > 1 else 1
        count, residual = sweep_contacts(first, last, friction, residual, goal, limit, many)
        if residual <= goal or last - first == 1:
            return count, residual, METHOD_SWEEPS
    may_hold = is_every_contact_pushing(part, many) or is_island_inactive(part, goal, many)
    worth = RESTING_BUDGET if scale <= _RESTING_FACTOR * many.settings[0].load_speed else MOVING_BUDGET
    steps = prepare_system(part, limit, worth, 1 if may_hold else MIN_NEWTON_STEPS, many)
    if may_hold and steps > 0:
        residual = try_all_sticking(part, friction, residual, deep, many)
        if residual <= goal:
            return 1 + count, residual, METHOD_NEWTON
    if steps < MIN_NEWTON_STEPS:
        more, residual = sweep_contacts(first, last, friction, residual, goal, limit - count, many)
        return count + more, residual, METHOD_SWEEPS
    if count == 0:
        count, residual = sweep_contacts(first, last, friction, residual, goal, FIRST_SWEEPS, many)
        if residual <= goal:
            return 1 + count, residual, METHOD_NEWTON
    if not may_hold and is_every_contact_pushing(part, many):
        residual = try_all_sticking(part, friction, residual, deep, many)
        if residual <= goal:
            return 1 + count, residual, METHOD_NEWTON
    more, residual = alternate_second_order(
        part, friction, scale, residual, goal, max(1, steps - FIRST_SWEEPS - 1), many
    )
    count += 1 + more
    if residual > goal:
        more, residual = sweep_as_fallback(part, friction, residual, goal, limit, many)
        count += more
    return count, residual, METHOD_NEWTON


@inlined
def max_impulse_speed(first, last, many):
    """Largest speed that a contact's impulse alone would cause [m/s]."""
    most = 0.0
    for i in range(first, last):
        k = many.islands.contacts[i]
        p = row_vector(many.contacts.impulse, k, 0)
        most = max(most, many.contacts.block[k, 0] * max(abs(p[0]), max(abs(p[1]), abs(p[2]))))
    return most


@inlined
def max_body_speed(many):
    """Bound of the speed of any point of the bodies with neighbours [m/s]."""
    most = 0.0
    for b in range(many.bodies.twist.shape[0]):
        if many.bodies.touched[b] == 1:
            v, w = row_vector(many.bodies.twist, b, 0), row_vector(many.bodies.twist, b, 3)
            most = max(most, point_speed_bound(v, w, b, many))
    return most


@kernel
def solve_island_frictionless(part, friction, goal, many):
    """Solve for impulses along the normals only, from none; return the residual of the problem with friction [m/s].

    This is the last resort, after the methods for friction have failed: these sweeps never raise the energy.
    """
    first, last, _, _ = part
    clear_island_impulses(part, many)
    sweep_normals(first, last, math.inf, goal, _FALLBACK_SWEEPS, many)
    return max_contact_residual(first, last, friction, many)


@shared_kernel
def solve_all_frictionless(n, many):
    """Do `solve_island_frictionless` for all contacts, when friction found no solution; return the residual [m/s]."""
    save_free_twists(many)
    clear_all_impulses(n, many)
    goal = many.settings[0].tolerance * assemble_contact_blocks(n, many)
    return sweep_normals(0, n, math.inf, goal, _FALLBACK_SWEEPS, many)[1]


@shared_kernel
def solve_contacts(n, friction, many):
    """Solve for `many.contacts.impulse` from the warm start in it: (iterations, relative residual, method).

    `many.bodies.twist` holds the velocities without contact impulses, and receives those with them. The residual is
    measured on the returned impulses, relative to a speed. This speed is the largest velocity that a contact would have
    without impulses. If all of those are close to rounding, it is the speed at which the tolerance equals the rounding
    of velocities or impulses. In a part of a substep it is the speed that loads give in half of it
    (`adaptive_substep`). Iterations are the largest number of any island.
    """
    save_free_twists(many)
    tolerance = many.settings[0].tolerance
    least = _VELOCITY_ROUNDING * max_body_speed(many) / tolerance
    scale = max(assemble_contact_blocks(n, many), max(least, many.settings[0].half_load_speed))
    if not scale > 0.0:
        return 0, 0.0, METHOD_SWEEPS
    goal = max(min(tolerance * scale, many.settings[0].residual_limit), _MIN_TOLERANCE * scale)
    if max_impulse_speed(0, n, many) > _STRAIN_LIMIT * scale:
        clear_all_impulses(n, many)
    rounding = _IMPULSE_ROUNDING * max_impulse_speed(0, n, many)
    goal, least = max(goal, rounding), max(rounding, _MIN_TOLERANCE * scale)
    residual = max_contact_residual(0, n, friction, many)
    if residual <= goal and is_in_balance(goal, least, many):
        return 0, residual / max(scale, rounding / tolerance), METHOD_SWEEPS
    iterations, worst, method, deep = 0, 0.0, METHOD_SWEEPS, STICKING_SHARE * min(goal, FINE_TOLERANCE * scale)
    for i in range(find_islands(n, many)):
        part = (
            many.islands.first_contact[i],
            many.islands.first_contact[i + 1],
            many.islands.first_body[i],
            many.islands.first_body[i + 1],
        )
        residual = max_contact_residual(part[0], part[1], friction, many)
        if not residual <= goal:
            count, residual, used = solve_island(part, friction, scale, residual, goal, deep, many)
            if not residual <= scale or max_impulse_speed(part[0], part[1], many) > _STRAIN_LIMIT * scale:
                residual = solve_island_frictionless(part, friction, goal, many)
            iterations, method = max(iterations, count), max(method, used)
        count, residual, used = refine_near_rest(part, friction, residual, goal, deep, least, many)
        iterations, method = max(iterations, count), max(method, used)
        if not residual <= worst:
            worst = residual
    return iterations, worst / max(scale, _IMPULSE_ROUNDING * max_impulse_speed(0, n, many) / tolerance), method
