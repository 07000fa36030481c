"""Solve islands that are nearly at rest below the tolerance, so that residual velocities decay instead of cycling.

A solve leaves velocities within a goal, and stops. What stands would have no velocity; so the next stage has to stop
that, and its impulses hold the load and stop motion that is over afterwards. They start the solve of the stage that
follows, which then begins with 2 v' - v for velocities v' now and v a stage ago. If sweeps leave a share s of that, the
velocities go like zᵏ with z² - 2 s z + s = 0, |z| = √s: they would vanish, but that nothing is swept within the goal,
where they grow again. So a pile that lies would go on at some goals of speed, each body in its own cycle, and a problem
that is hard would be solved anew in each of them.

An island is left alone where every body keeps its velocity to a small share of the goal: loads and impulses balance.
One that holds as a whole does after one linear system, and for long; others are swept. Under error control
nothing is: goals are next to rounding there, and a high arch at its limit, swept in every part, was solved no more.
"""

from __future__ import annotations

from physics.compiler.decorators import inlined, kernel
from physics.kernels.math.vector import row_vector
from physics.kernels.multibody.data.arrays import PRE_LOAD_VELOCITY
from physics.kernels.multibody.data.contact_set import subtract
from physics.kernels.multibody.solver.gauss_seidel import sweep_contacts
from physics.kernels.multibody.solver.proximal_newton import (
    RESTING_BUDGET,
    is_every_contact_pushing,
    prepare_system,
    restore_best,
    save_best,
    try_all_sticking,
)
from physics.kernels.state.layout import METHOD_NEWTON, METHOD_SWEEPS

# Goals of speed within which all bodies of an island have to be before a stage, and the share of the goal that is swept
# to.
_NEAR_REST_SPEED = 100.0
BALANCE_SHARE = 1.0e-3

# Sweeps in a stage. With 2, 4 and 8 of them piles lie as still.
_NEAR_REST_SWEEPS = 4


@inlined
def _refined_tolerance(goal, least):
    """Tolerance of the sweeps [m/s]; a balance of loads and impulses allows changes of velocity twice as large."""
    return max(BALANCE_SHARE * goal, least)


@inlined
def point_speed_bound(v, w, b, many):
    """Bound of the speed of any point of body b that moves with v and turns with w [m/s]."""
    linear = max(abs(v[0]), max(abs(v[1]), abs(v[2])))
    return linear + many.bodies.body[b].radius * (abs(w[0]) + abs(w[1]) + abs(w[2]))


@inlined
def _keeps_velocity(b, most, many):
    """True if the velocity of body b has changed by at most `most` in this resting stage [m/s].

    Velocities before the stage are in `many.bodies.momenta`, those after it in `many.bodies.twist`.
    """
    v, w = (
        row_vector(many.bodies.momenta, b, PRE_LOAD_VELOCITY),
        row_vector(many.bodies.momenta, b, PRE_LOAD_VELOCITY + 3),
    )
    return (
        point_speed_bound(
            subtract(row_vector(many.bodies.twist, b, 0), v), subtract(row_vector(many.bodies.twist, b, 3), w), b, many
        )
        <= most
    )


@kernel
def is_in_balance(goal, least, many):
    """True if no island needs `near_rest_refinement`."""
    if many.settings[0].is_resting_stage == 1:
        for b in range(many.bodies.twist.shape[0]):
            if many.bodies.touched[b] == 1 and not _keeps_velocity(b, 2.0 * _refined_tolerance(goal, least), many):
                return False
    return True


@inlined
def _needs_refinement(part, speed, change, many):
    """True if all bodies of an island were slower than `speed`, and one changed by more than `change` [m/s]."""
    is_balanced = True
    for i in range(part[2], part[3]):
        b = many.islands.bodies[i]
        if (
            point_speed_bound(
                row_vector(many.bodies.momenta, b, PRE_LOAD_VELOCITY),
                row_vector(many.bodies.momenta, b, PRE_LOAD_VELOCITY + 3),
                b,
                many,
            )
            > speed
        ):
            return False
        is_balanced = is_balanced and _keeps_velocity(b, change, many)
    return not is_balanced


@kernel
def refine_near_rest(part, friction, residual, goal, deep, least, many):
    """Refine an island that is solved to the goal and nearly at rest: (iterations, residual [m/s], method).

    An island of sticking contacts is solved to `deep`, another one by some sweeps as far as `least`. Nothing happens
    outside resting stages, or if the residual would grow beyond the goal.
    """
    fine = _refined_tolerance(goal, least)
    if many.settings[0].is_resting_stage == 0 or not fine < residual <= goal:
        return 0, residual, METHOD_SWEEPS
    if not _needs_refinement(part, _NEAR_REST_SPEED * goal, 2.0 * fine, many):
        return 0, residual, METHOD_SWEEPS
    count, method = 0, METHOD_SWEEPS
    if (
        is_every_contact_pushing(part, many)
        and prepare_system(part, many.settings[0].sweeps, RESTING_BUDGET, 1, many) > 0
    ):
        count, method, residual = 1, METHOD_NEWTON, try_all_sticking(part, friction, residual, deep, many)
    if not residual > fine:
        return count, residual, method
    save_best(part, many)
    more, now = sweep_contacts(part[0], part[1], friction, residual, fine, _NEAR_REST_SWEEPS, many)
    if not now <= goal:
        restore_best(part, many)
        return count + more, residual, method
    return count + more, now, method
