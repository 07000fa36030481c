"""The contact problem of all bodies of a world at once: which method solves it, and what it says of it.

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

from physics.kernels.compile.decorators import inlined, kernel, standing
from physics.kernels.multibody.data.contact_set import put, vector
from physics.kernels.multibody.solver.block_lu import SIZE
from physics.kernels.multibody.solver.contact_operator import assemble, residual_of, velocity_missed
from physics.kernels.multibody.solver.gauss_seidel import sweep_contacts, sweep_normals
from physics.kernels.multibody.solver.interior_point import interior_point
from physics.kernels.multibody.solver.islands import find_islands
from physics.kernels.multibody.solver.near_rest_refinement import NEWTON, SWEEPS, calm, is_in_balance, point_speed
from physics.kernels.multibody.solver.proximal_newton import (
    LEAST_STEPS,
    WORTH_LYING,
    WORTH_MOVING,
    all_push,
    bring_back_best,
    guess_all_hold,
    newton_contacts,
    prepare_system,
    save_best,
)

# Share of the tolerance, or of this finer one, relative to the largest free velocity, that the guess that all
# holds is solved to: what stands finds nothing to do in the steps to come.
HOLD_SHARE = 1.0e-3
FINE = 1.0e-6

# Sweeps before the interior-point method.
FIRST_SWEEPS = 5

# A pile nearly lies where without impulses no contact would be faster than this many times what loads give in the
# stage.
LYING = 3.0

# Tolerance from which on impacts are swept first.
COARSE = 1.0e-4

# Residual that rounding leaves, relative to the largest free velocity: the smallest tolerance.
ROUNDING = 1.0e-12

# Where bodies of one velocity touch, all that is left to solve is the rounding of that velocity, and nothing can be
# solved relative to it: u is the difference of two sums v + ω x r of three products and three terms each, every one of
# them rounded, which makes 2 · 6 · ε of the largest, and the impulses round the velocities once more.
VELOCITY_ROUNDING = 16 * 2.0**-52

# An impulse is rounded, too, and with it the velocities, by up to this share of what it alone would give its bodies
# (half an ulp in it, in its moment, and in each of the sums): a light cube under a heavy one can be at rest no better.
IMPULSE_ROUNDING = 2 * 2.0**-52

# Bodies that wedge by friction hold any stress. Impulses that alone would give this many times the free velocities are
# one that a method ran into, not what holds a million times a body's weight: what they leave is rounding.
STRAINED = 1.0e9

# Sweeps without friction, where all else failed.
LAST_SWEEPS = 100

# Residual at which the interior-point method gives way to Newton's at the latest, relative to the largest velocity
# without impulses: below it, rounding does.
ROUGH = 1.0e-6

# Iterations of the first in a turn, steps of the second, and its ρ in units of the largest mass. Each turn goes on from
# the impulses that the one before ended with, the last one from none.
INTERIOR_STEPS = (30, 30, 40)
POLISH_STEPS = (20, 40, 40)
POLISH = (10.0, 1.0, 1.0)


@inlined
def keep_free(many):
    """`many.free`: the twists as they are, without any impulse."""
    for b in range(many.twist.shape[0]):
        for c in range(SIZE):
            many.free[b, c] = many.twist[b, c]


@inlined
def free_body(b, many):
    """The twist of body b without any impulse."""
    for c in range(SIZE):
        many.twist[b, c] = many.free[b, c]


@inlined
def forget_impulses(part, many):
    """No impulses in an island."""
    for i in range(part[0], part[1]):
        put(many.impulse, many.queue[i], 0, (0.0, 0.0, 0.0))
    for i in range(part[2], part[3]):
        free_body(many.order[i], many)


@inlined
def forget_all(n, many):
    """No impulses at all."""
    for k in range(n):
        put(many.impulse, k, 0, (0.0, 0.0, 0.0))
    for b in range(many.twist.shape[0]):
        free_body(b, many)


@kernel
def solve_hard(part, friction, scale, residual, goal, limit, many):
    """Interior point and Newton's method in turns: (iterations, residual)."""
    count, best, start, last = 0, residual, residual, len(POLISH) - 1
    save_best(part, many)
    for turn in range(last + 1):
        if turn == last:
            start = scale
            forget_impulses(part, many)
        count += interior_point(part, start, max(goal, ROUGH * scale), min(INTERIOR_STEPS[turn], limit - count), many)
        now = residual_of(part[0], part[1], friction, many)
        if now > goal and count < limit:
            more, now = newton_contacts(part, friction, now, goal, POLISH_STEPS[turn], POLISH[turn], many)
            count += more
        if now < best:
            best = now
            save_best(part, many)
        if not now > goal or count >= limit:
            break
        start = now
    if not now <= best:
        bring_back_best(part, many)
    return count, best


@kernel
def sweep_at_last(part, friction, residual, goal, limit, many):
    """Sweeps from the best impulses met, which stay where those do not lead to better ones: (sweeps, residual)."""
    save_best(part, many)
    count, now = sweep_contacts(part[0], part[1], friction, residual, goal, limit, many)
    if not now < residual:
        bring_back_best(part, many)
        return count, residual
    return count, now


@inlined
def none_pushes_or_parts(part, goal, many):
    """True if no contact of an island pushes, and none opens faster than `goal` [m/s] without that."""
    for i in range(part[0], part[1]):
        k = many.queue[i]
        if many.impulse[k, 0] > 0.0 or velocity_missed(k, many)[0] > goal:
            return False
    return True


@inlined
def _is_swept_first(part, goal, scale, many):
    """True if sweeps try an island first: it has one contact, or an impact at a coarse tolerance.

    An impact begins from no impulses, and asks something of the few contacts near it.
    """
    is_impact = many.settings[0].rests == 0
    return part[1] - part[0] == 1 or (is_impact and goal >= COARSE * scale)


@kernel
def solve_island(part, friction, scale, residual, goal, deep, many):
    """Solve one island from impulses of the given residual [m/s]: (iterations, residual, method).

    What holds is solved to `deep` [m/s].
    """
    first, last, _, _ = part
    limit, count = many.settings[0].sweeps, 0
    if _is_swept_first(part, goal, scale, many):
        limit = limit if last - first > 1 else 1
        count, residual = sweep_contacts(first, last, friction, residual, goal, limit, many)
        if residual <= goal or last - first == 1:
            return count, residual, SWEEPS
    may_hold = all_push(part, many) or none_pushes_or_parts(part, goal, many)
    worth = WORTH_LYING if scale <= LYING * many.settings[0].load else WORTH_MOVING
    steps = prepare_system(part, limit, worth, 1 if may_hold else LEAST_STEPS, many)
    if may_hold and steps > 0:
        residual = guess_all_hold(part, friction, residual, deep, many)
        if residual <= goal:
            return 1 + count, residual, NEWTON
    if steps < LEAST_STEPS:
        more, residual = sweep_contacts(first, last, friction, residual, goal, limit - count, many)
        return count + more, residual, SWEEPS
    if count == 0:
        count, residual = sweep_contacts(first, last, friction, residual, goal, FIRST_SWEEPS, many)
        if residual <= goal:
            return 1 + count, residual, NEWTON
    if not may_hold and all_push(part, many):
        residual = guess_all_hold(part, friction, residual, deep, many)
        if residual <= goal:
            return 1 + count, residual, NEWTON
    more, residual = solve_hard(part, friction, scale, residual, goal, max(1, steps - FIRST_SWEEPS - 1), many)
    count += 1 + more
    if residual > goal:
        more, residual = sweep_at_last(part, friction, residual, goal, limit, many)
        count += more
    return count, residual, NEWTON


@inlined
def strain(first, last, many):
    """Largest speed that a contact's impulse alone would give [m/s]."""
    most = 0.0
    for i in range(first, last):
        k = many.queue[i]
        p = vector(many.impulse, k, 0)
        most = max(most, many.block[k, 0] * max(abs(p[0]), max(abs(p[1]), abs(p[2]))))
    return most


@inlined
def fastest(many):
    """No point of a body is faster than this [m/s]."""
    most = 0.0
    for b in range(many.twist.shape[0]):
        most = max(most, point_speed(vector(many.twist, b, 0), vector(many.twist, b, 3), b, many))
    return most


@kernel
def solve_without_friction(part, friction, goal, many):
    """Impulses along the normals only, from none: the residual, which is that of the problem with friction [m/s].

    The last resort, where the methods for friction went astray: these sweeps never raise the energy.
    """
    first, last, _, _ = part
    forget_impulses(part, many)
    sweep_normals(first, last, math.inf, goal, LAST_SWEEPS, many)
    return residual_of(first, last, friction, many)


@standing
def solve_smoothly(n, many):
    """`solve_without_friction` of all n contacts, for what a solve with friction came out wrong: the residual [m/s]."""
    keep_free(many)
    forget_all(n, many)
    goal = many.settings[0].tolerance * assemble(n, many)
    return sweep_normals(0, n, math.inf, goal, LAST_SWEEPS, many)[1]


@standing
def solve_contacts(n, friction, many):
    """Solve for `many.impulse` from the warm start in it: (iterations, relative residual, method).

    `many.twist` holds the velocities without any contact impulse and receives those with them. The residual is
    measured on what is returned, relative to the largest velocity that a contact would have without any impulse; or,
    where all of those are next to rounding, to that speed of which the rounding of velocities or of impulses is the
    tolerance's share; or, in a part of a substep, to what loads give in half of it (`adaptive_substep`).
    Iterations are those of the island that took most.
    """
    keep_free(many)
    tolerance = many.settings[0].tolerance
    least = VELOCITY_ROUNDING * fastest(many) / tolerance
    scale = max(assemble(n, many), max(least, many.settings[0].half))
    if not scale > 0.0:
        return 0, 0.0, SWEEPS
    goal = max(min(tolerance * scale, many.settings[0].still), ROUNDING * scale)
    if strain(0, n, many) > STRAINED * scale:
        forget_all(n, many)
    rounding = IMPULSE_ROUNDING * strain(0, n, many)
    goal, least = max(goal, rounding), max(rounding, ROUNDING * scale)
    residual = residual_of(0, n, friction, many)
    if residual <= goal and is_in_balance(goal, least, many):
        return 0, residual / max(scale, rounding / tolerance), SWEEPS
    iterations, worst, method, deep = 0, 0.0, SWEEPS, HOLD_SHARE * min(goal, FINE * scale)
    for i in range(find_islands(n, many)):
        part = (many.first_contact[i], many.first_contact[i + 1], many.first_body[i], many.first_body[i + 1])
        residual = residual_of(part[0], part[1], friction, many)
        if not residual <= goal:
            count, residual, used = solve_island(part, friction, scale, residual, goal, deep, many)
            if not residual <= scale or strain(part[0], part[1], many) > STRAINED * scale:
                residual = solve_without_friction(part, friction, goal, many)
            iterations, method = max(iterations, count), max(method, used)
        count, residual, used = calm(part, friction, residual, goal, deep, least, many)
        iterations, method = max(iterations, count), max(method, used)
        if not residual <= worst:
            worst = residual
    return iterations, worst / max(scale, IMPULSE_ROUNDING * strain(0, n, many) / tolerance), method
