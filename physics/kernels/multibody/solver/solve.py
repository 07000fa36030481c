"""Solve the contact problem of all bodies of a world by a choice of methods, and report the method.

If the warm start solves the problem, only its residual is computed. Else the contacts are sorted into islands
(`islands`). An island that is not solved yet takes these methods in turn, until one reaches the tolerance:

1. An island of one contact takes one sweep, which is exact then.
2. Try all contacts as sticking, by one linear system. This solves resting islands far below the tolerance. It is left
   out if some, but not all, contacts of the warm start push, or if none does and contacts open. It is then tried after
   3, if all contacts push by then.
3. A few sweeps, which solve impacts and separations.
4. An interior-point method, which finds sticking, sliding and opening contacts from any start, and Newton's method on
   the twists from its result, in turns. Compliant contacts are left to Newton's method.
5. Sweeps up to their limit, from the best impulses so far.

Under error control Newton's method from evenly shared loads (`even_loads`) comes before 3, and once more after 4.

An impact with a coarse tolerance begins with sweeps up to their limit, since few of its contacts change.

In a resting stage, islands that are nearly at rest are solved below the tolerance (`near_rest_refinement`).

An island is solved without friction if its residual is larger than that of no impulses at all, or if its impulses are
unreasonably large.

If the linear system is too expensive (`proximal_newton.prepare_system`: many moving bodies that all lie on each other),
sweeps up to their limit take the place of 2 to 5. So the cost of a step is in proportion to its contacts, and a
residual above the tolerance is reported. Iterations with the linear system are at most as many as the allowed sweeps,
except those of the last method begun.
"""

from __future__ import annotations

import math

from physics.compiler.decorators import if_given, inlined, kernel, shared_kernel
from physics.kernels.math.vector import row_vector
from physics.kernels.multibody.data.compliance import rigid_mobility
from physics.kernels.multibody.data.contact_set import put_vector
from physics.kernels.multibody.solver.block_lu import TWIST_DOFS
from physics.kernels.multibody.solver.contact_operator import (
    assemble_contact_blocks,
    max_contact_residual,
    velocity_error,
)
from physics.kernels.multibody.solver.even_loads import even_loads
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

# Islands in which all contacts stick are solved to this share of the goal, or of this finer tolerance, whichever is
# less. So a resting island finds nothing to do in the steps to come.
STICKING_SHARE = 1.0e-3
FINE_TOLERANCE = 1.0e-6

# Sweeps before the interior-point method.
FIRST_SWEEPS = 5

# An island is nearly at rest if without impulses no contact would be faster than this many times the speed that loads
# give in the stage.
_RESTING_FACTOR = 3.0

# Tolerance at and above which impacts are swept first.
_COARSE_TOLERANCE = 1.0e-4

# Residual that rounding leaves, relative to the largest free velocity; smaller tolerances are raised to it.
_MIN_TOLERANCE = 1.0e-12

# Rounding of a relative velocity u, as a share of the bodies' speed. If bodies of the same velocity touch, u is nothing
# but rounding, and no residual can be small relative to it. u is the difference of two sums v + ω x r of three products
# and three terms each, all of them rounded, which makes 2 · 6 · ε of the largest. The impulses round the velocities
# once more.
_VELOCITY_ROUNDING = 16 * 2.0**-52

# Rounding of velocities by an impulse, as a share of the speed that the impulse alone would cause (half an ulp in the
# impulse, in its moment, and in each of the sums). So a light cube under a heavy one keeps a residual of that size.
_IMPULSE_ROUNDING = 2 * 2.0**-52

# Largest speed that an impulse alone may cause, in units of the free velocities. Bodies that wedge by friction hold any
# stress, and a method may run into a huge one, whose residual is mere rounding. The limit still allows impulses that
# hold a million times a body's weight.
_STRAIN_LIMIT = 1.0e9

# Largest number of Newton steps from evenly shared loads.
_EVEN_STEPS = 40

# Largest number of sweeps without friction, after all other methods have failed.
_FALLBACK_SWEEPS = 100

# Residual at which the interior-point method gives way to Newton's method, relative to the largest velocity without
# impulses. Below it rounding decides.
_INTERIOR_TOLERANCE = 1.0e-6

# Largest numbers of interior-point iterations and of Newton steps in each turn, and ρ of Newton's method in units of
# the largest mass. Each turn starts from the impulses of the turn before, the last one from zero.
_INTERIOR_STEPS = (30, 30, 40)
_NEWTON_STEPS = (20, 40, 40)
NEWTON_RHO = (10.0, 1.0, 1.0)


@inlined
def save_free_twists(many):
    """Save the present twists of all bodies as those without contact impulses, in `many.bodies.free_twist`."""
    for b in range(many.bodies.twist.shape[0]):
        for c in range(TWIST_DOFS):
            many.bodies.free_twist[b, c] = many.bodies.twist[b, c]


@inlined
def reset_body_to_free(b, many):
    """Reset the twist of body b to the one without contact impulses."""
    for c in range(TWIST_DOFS):
        many.bodies.twist[b, c] = many.bodies.free_twist[b, c]


@inlined
def clear_island_impulses(part, many):
    """Set the impulses of the island `part` to zero, and its twists to those without impulses.

    `part` is as in `proximal_newton.newton_contacts`.
    """
    for i in range(part[0], part[1]):
        put_vector(many.contacts.impulse, many.islands.contacts[i], 0, (0.0, 0.0, 0.0))
    for i in range(part[2], part[3]):
        reset_body_to_free(many.islands.bodies[i], many)


@inlined
def clear_all_impulses(n, many):
    """Set the impulses of the n contacts to zero, and all twists to those without impulses."""
    for k in range(n):
        put_vector(many.contacts.impulse, k, 0, (0.0, 0.0, 0.0))
    for b in range(many.bodies.twist.shape[0]):
        reset_body_to_free(b, many)


def _approach_inside_cones(part, start, goal, limit, many):
    return interior_point_contacts(part, start, goal, limit, many)


@if_given("many.compliance", _approach_inside_cones)
def _approach(part, start, goal, limit, many):
    """Take no interior-point iterations: that method knows rigid contacts only. Otherwise it is done here."""
    return 0


def _not_even(part, friction, residual, goal, many):
    return 0, residual


@if_given("many.even", _not_even)
def _solve_evenly(part, friction, residual, goal, many):
    """Share the loads of faces evenly, and take Newton's method from there: (Newton steps, residual [m/s]).

    Arguments are as of `newton_contacts`. If the goal is not reached, the impulses are as before.
    """
    save_best(part, many)
    start = even_loads(part, friction, residual, many)
    steps, after = newton_contacts(part, friction, start, goal, _EVEN_STEPS, NEWTON_RHO[0], many)
    if after <= goal:
        return steps, after
    restore_best(part, many)
    return steps, residual


def _all_sweeps(limit, many):
    return limit


@if_given("many.even", _all_sweeps)
def _last_sweeps(limit, many):
    """Largest number of sweeps after all other methods, at most `limit`: a part without a solution is soon refused."""
    return min(limit, _FALLBACK_SWEEPS)


@kernel
def alternate_second_order(part, friction, scale, residual, goal, limit, many):
    """Improve the impulses of an island by interior-point and Newton's method in turns: (iterations, residual [m/s]).

    All speeds are in m/s: `scale` is the reference of relative residuals, `residual` the residual at the start, and
    `goal` the residual to reach. There are at most `limit` iterations, except those of the last method begun. The best
    impulses are kept. `part` and `friction` are as in `proximal_newton.newton_contacts`.
    """
    count, best, start, last = 0, residual, residual, len(NEWTON_RHO) - 1
    save_best(part, many)
    for turn in range(last + 1):
        if turn == last:
            start = scale
            clear_island_impulses(part, many)
        count += _approach(
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
    """Improve the best impulses of an island by sweeps, and keep the better of both: (sweeps, residual [m/s]).

    `residual` is that of the start, `goal` the residual to reach [m/s], `limit` the number of sweeps allowed. `part`
    and `friction` are as in `proximal_newton.newton_contacts`.
    """
    save_best(part, many)
    count, now = sweep_contacts(part[0], part[1], friction, residual, goal, limit, many)
    if not now < residual:
        restore_best(part, many)
        return count, residual
    return count, now


@inlined
def is_island_inactive(part, goal, many):
    """True if no contact of the island `part` pushes, and none opens faster than `goal` [m/s] without impulses."""
    for i in range(part[0], part[1]):
        k = many.islands.contacts[i]
        if many.contacts.impulse[k, 0] > 0.0 or velocity_error(k, many)[0] > goal:
            return False
    return True


@inlined
def _is_swept_first(part, goal, scale, many):
    """True if the island `part` is first solved by sweeps: it has one contact, or is in a coarsely solved impact.

    `goal` is the residual to reach, `scale` the speed it is relative to [m/s]. Impacts are swept first if their
    tolerance is coarse. They start without impulses, and involve only the few contacts near them.
    """
    is_impact = many.settings[0].is_resting_stage == 0
    return part[1] - part[0] == 1 or (is_impact and goal >= _COARSE_TOLERANCE * scale)


@kernel
def solve_island(part, friction, scale, residual, goal, deep, many):
    """Solve the contact problem of one island: (iterations, residual [m/s], method).

    `residual` is that of the impulses to start from, `goal` the residual to reach, and `scale` the speed that residuals
    are relative to, all in m/s. If all contacts stick, the island is solved to `deep` [m/s]. `part` and `friction` are
    as in `proximal_newton.newton_contacts`.
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
    more, residual = _solve_evenly(part, friction, residual, goal, many)
    if residual <= goal:
        return 1 + count + more, residual, METHOD_NEWTON
    if count == 0:
        count, residual = sweep_contacts(first, last, friction, residual, goal, FIRST_SWEEPS, many)
        if residual <= goal:
            return 1 + count + more, residual, METHOD_NEWTON
    count += more
    if not may_hold and is_every_contact_pushing(part, many):
        residual = try_all_sticking(part, friction, residual, deep, many)
        if residual <= goal:
            return 1 + count, residual, METHOD_NEWTON
    more, residual = alternate_second_order(
        part, friction, scale, residual, goal, max(1, steps - FIRST_SWEEPS - 1), many
    )
    count += 1 + more
    if residual > goal:
        more, residual = sweep_as_fallback(part, friction, residual, goal, _last_sweeps(limit, many), many)
        return count + more, residual, METHOD_NEWTON
    more, residual = _solve_evenly(part, friction, residual, goal, many)
    return count + more, residual, METHOD_NEWTON


@inlined
def max_impulse_speed(first, last, many):
    """Largest change of a contact's velocity by its own impulse alone, over some contacts [m/s].

    The contacts are `many.islands.contacts[first:last]`.
    """
    most = 0.0
    for i in range(first, last):
        k = many.islands.contacts[i]
        p = row_vector(many.contacts.impulse, k, 0)
        most = max(most, rigid_mobility(k, many) * max(abs(p[0]), max(abs(p[1]), abs(p[2]))))
    return most


@inlined
def max_body_speed(many):
    """Bound of the speed of any point of the bodies in contact [m/s]."""
    most = 0.0
    for b in range(many.bodies.twist.shape[0]):
        if many.bodies.touched[b] == 1:
            v, w = row_vector(many.bodies.twist, b, 0), row_vector(many.bodies.twist, b, 3)
            most = max(most, point_speed_bound(v, w, b, many))
    return most


@kernel
def solve_island_frictionless(part, friction, goal, many):
    """Solve an island for impulses along the normals only; return its residual with friction [m/s].

    This is the last resort, after the methods for friction have failed: the sweeps start from zero impulses, and never
    raise the energy. `part` and `friction` are as in `proximal_newton.newton_contacts`; `goal` is the residual to reach
    [m/s].
    """
    first, last, _, _ = part
    clear_island_impulses(part, many)
    sweep_normals(first, last, math.inf, goal, _FALLBACK_SWEEPS, many)
    return max_contact_residual(first, last, friction, many)


@shared_kernel
def solve_all_frictionless(n, many):
    """Solve all n contacts for impulses along the normals only; return the residual without friction [m/s].

    This is the last resort, after a solve with friction has created energy.
    """
    save_free_twists(many)
    clear_all_impulses(n, many)
    goal = many.settings[0].tolerance * assemble_contact_blocks(n, many)
    return sweep_normals(0, n, math.inf, goal, _FALLBACK_SWEEPS, many)[1]


@shared_kernel
def solve_contacts(n, friction, many):
    """Solve for the impulses of the n contacts, from the warm start: (iterations, relative residual, method).

    `many.contacts.impulse` holds the warm start and receives the result. `many.bodies.twist` holds the velocities
    without contact impulses and receives those with them. `friction` is None if the scene has no friction.

    Iterations are the largest number of any island. The residual is that of the returned impulses, relative to a speed:
    the largest velocity error that a contact would have without impulses. If all of these are close to rounding, it is
    the speed at which the tolerance equals the rounding of velocities or impulses. Under error control it is at least
    the speed that loads give in half a substep (`adaptive_substep`).
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
