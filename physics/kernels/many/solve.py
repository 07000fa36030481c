"""The contact problem of all bodies of a world at once: which method solves it, and what it says of it.

A warm start that still solves the problem costs one look at the residual. Else, in this order, as far as it is needed:

1. where no body has two contacts one sweep, which is exact then;
2. the guess that everything holds: one linear system, the answer for what stands still;
3. a few sweeps, the answer for what meets and parts;
4. Newton's method on all twists;
5. sweeps up to their limit.

Where the linear system is dear (many bodies that all lie on each other), 2 to 4 are left out.
"""

from __future__ import annotations

from physics.kernels.compiler import inlined, kernel
from physics.kernels.many.newton import (
    AFTER_HOLD,
    AFTER_SWEEPS,
    guess_all_hold,
    newton_contacts,
    prepare_newton,
)
from physics.kernels.many.sweeps import assemble, sweep_contacts

# Sweeps before Newton's method is tried.
FIRST_SWEEPS = 10

# The strongest method that was needed: codes of `physics.report.Solver`.
SWEEPS, NEWTON = 2, 4


@inlined
def are_single(n, many):
    """Whether no body has more than one contact."""
    ends = touched = 0
    for k in range(n):
        ends += 2 if many.ends[k, 1] >= 0 else 1
    for b in range(many.touched.shape[0]):
        touched += many.touched[b]
    return ends == touched


@kernel
def solve_contacts(n, friction, many):
    """Solve for `many.impulse` from the warm start in it: (iterations, relative residual, method).

    `many.twist` holds the velocities without any contact impulse and receives those with them. The residual is
    measured on what is returned, relative to the largest velocity that a contact would have without any impulse.
    """
    for b in range(many.twist.shape[0]):
        for c in range(6):
            many.free[b, c] = many.twist[b, c]
    settings = many.settings[0]
    scale = assemble(n, many)
    if not scale > 0.0:
        return 0, 0.0, SWEEPS
    goal, limit = settings.tolerance * scale, settings.sweeps
    iterations, before = sweep_contacts(n, friction, goal, 1 if are_single(n, many) else 0, many)
    if before <= goal:
        return iterations, before / scale, SWEEPS
    count, steps = prepare_newton(n, limit, many)
    if steps == 0:
        more, residual = sweep_contacts(n, friction, goal, limit, many)
        return iterations + more, residual / scale, SWEEPS
    residual, rho = guess_all_hold(n, count, friction, before, goal, many), AFTER_HOLD
    if residual == before:
        more, residual = sweep_contacts(n, friction, goal, min(FIRST_SWEEPS, limit), many)
        rho, iterations = AFTER_SWEEPS, iterations + more
    more, residual = newton_contacts(n, count, friction, residual, goal, steps, rho, many)
    iterations += 1 + more
    if residual > goal:
        more, residual = sweep_contacts(n, friction, goal, limit, many)
        iterations += more
    return iterations, residual / scale, NEWTON
