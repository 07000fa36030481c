"""Solve islands that are nearly at rest below the tolerance, so that residual velocities decay instead of cycling.

A solve stops once its residual is within a goal, and so leaves small velocities. The next stage has to stop them, and
its impulses hold the loads and stop motion that is over afterwards. These impulses are the warm start of the stage that
follows. That stage begins with velocities 2 v' - v, for velocities v' now and v a stage ago. If sweeps leave a share s
of them, the velocities evolve like zᵏ over k stages, with z² - 2 s z + s = 0 and |z| = √s. They would vanish, but
within the goal nothing is swept, and they grow again. So a resting pile would go on moving at a few times the goal,
each body in a cycle of its own, and a hard problem would be solved anew in each cycle.

An island is left alone if every body keeps its velocity to a small share of the goal: loads and impulses balance. An
island in which every contact sticks reaches this by one linear system, and for long; other islands are swept. Under
error control there is no refinement: goals are close to rounding there, and a high arch at its limit, swept in every
part, was solved no better.
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

# Largest speed of a body in an island that counts as nearly at rest, in goals; share of the goal to which it is
# refined.
_NEAR_REST_SPEED = 100.0
BALANCE_SHARE = 1.0e-3

# Largest number of sweeps in a stage. Piles rest equally well with 2, 4 and 8.
_NEAR_REST_SWEEPS = 4


@inlined
def _refined_tolerance(goal, least):
    """Residual to which islands nearly at rest are refined [m/s]; balance allows velocity changes twice as large.

    `goal` is the residual of an ordinary solve, `least` the residual that rounding leaves [m/s].
    """
    return max(BALANCE_SHARE * goal, least)


@inlined
def point_speed_bound(v, w, b, many):
    """Bound of the speed of any point of body b with velocity v [m/s] and angular velocity w [rad/s]."""
    linear = max(abs(v[0]), max(abs(v[1]), abs(v[2])))
    return linear + many.bodies.body[b].radius * (abs(w[0]) + abs(w[1]) + abs(w[2]))


@inlined
def _keeps_velocity(b, most, many):
    """True if no point of body b has changed its velocity by more than `most` [m/s] in this resting stage.

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
    """True if no island needs refinement: each touching body keeps its velocity, or this is no resting stage.

    `goal` and `least` are as in `_refined_tolerance`.
    """
    if many.settings[0].is_resting_stage == 1:
        for b in range(many.bodies.twist.shape[0]):
            if many.bodies.touched[b] == 1 and not _keeps_velocity(b, 2.0 * _refined_tolerance(goal, least), many):
                return False
    return True


@inlined
def _needs_refinement(part, speed, change, many):
    """True if an island was nearly at rest before the stage, and does not keep its velocity.

    All its bodies were slower than `speed`, and one of them changed its velocity by more than `change` [m/s]. `part` is
    as in `proximal_newton.newton_contacts`.
    """
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
    """Refine an island that is solved to `goal` and nearly at rest: (iterations, residual [m/s], method).

    An island in which every contact pushes is first solved with all contacts sticking, to `deep` [m/s]. If the residual
    is still too large, a few sweeps refine it; `least` is the residual that rounding leaves [m/s]. Nothing changes
    outside resting stages, or if the residual would grow beyond the goal. `part` and `friction` are as in
    `proximal_newton.newton_contacts`.
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
