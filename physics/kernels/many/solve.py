"""The contact problem of all bodies of a world at once: which method solves it, and what it says of it.

A warm start that still solves the problem costs one look at the residual. Else a few sweeps; where they do not reach
the tolerance, Newton's method on all twists; and where that leaves a residual, sweeps up to their limit.
"""

from __future__ import annotations

from physics.kernels.compiler import kernel
from physics.kernels.many.newton import newton_contacts
from physics.kernels.many.sweeps import assemble, sweep_contacts

# Sweeps before Newton's method is tried.
FIRST_SWEEPS = 10

# The strongest method that was needed: codes of `physics.report.Solver`.
SWEEPS, NEWTON = 2, 4


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
    sweeps, residual = sweep_contacts(n, friction, goal, min(FIRST_SWEEPS, limit), many)
    if residual <= goal or sweeps == limit:
        return sweeps, residual / scale, SWEEPS
    steps, residual = newton_contacts(n, friction, residual, goal, limit, many)
    if residual <= goal:
        return sweeps + steps, residual / scale, NEWTON
    more, residual = sweep_contacts(n, friction, goal, limit - sweeps, many)
    return sweeps + steps + more, residual / scale, NEWTON
