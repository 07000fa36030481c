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

from physics.kernels.compile.decorators import inlined, kernel
from physics.kernels.multibody.data.arrays import VELOCITY
from physics.kernels.multibody.data.contact_set import minus, vector
from physics.kernels.multibody.solver.gauss_seidel import sweep_contacts
from physics.kernels.multibody.solver.proximal_newton import (
    WORTH_LYING,
    all_push,
    bring_back_best,
    guess_all_hold,
    prepare_system,
    save_best,
)

# The strongest method that was needed: codes of `physics.world.report.Solver`.
SWEEPS, NEWTON = 2, 4

# Goals of speed within which all bodies of an island have to be before a stage, and the share of the goal that is swept
# to.
CALM_SPEED = 100.0
BALANCE_SHARE = 1.0e-3

# Sweeps in a stage. With 2, 4 and 8 of them piles lie as still.
CALM_SWEEPS = 4


@inlined
def _fine(goal, least):
    """Tolerance of the sweeps; velocities may change by twice as much where loads and impulses balance [m/s]."""
    return max(BALANCE_SHARE * goal, least)


@inlined
def point_speed(v, w, b, many):
    """No point of body b is faster than this if it moves with v and turns with w [m/s]."""
    linear = max(abs(v[0]), max(abs(v[1]), abs(v[2])))
    return linear + many.bodies[b].radius * (abs(w[0]) + abs(w[1]) + abs(w[2]))


@inlined
def _keeps_velocity(b, most, many):
    """True if the velocity of body b has changed by at most `most` in this resting stage [m/s].

    Velocities before the stage are in `many.momenta`, those after it in `many.twist`.
    """
    v, w = vector(many.momenta, b, VELOCITY), vector(many.momenta, b, VELOCITY + 3)
    return point_speed(minus(vector(many.twist, b, 0), v), minus(vector(many.twist, b, 3), w), b, many) <= most


@kernel
def is_in_balance(goal, least, many):
    """True if nothing is left for `near_rest_refinement` to do in any island."""
    if many.settings[0].rests == 1:
        for b in range(many.twist.shape[0]):
            if many.touched[b] == 1 and not _keeps_velocity(b, 2.0 * _fine(goal, least), many):
                return False
    return True


@inlined
def _may_calm(part, speed, change, many):
    """True if all bodies of an island were slower than `speed`, and one changed by more than `change` [m/s]."""
    is_balanced = True
    for i in range(part[2], part[3]):
        b = many.order[i]
        if point_speed(vector(many.momenta, b, VELOCITY), vector(many.momenta, b, VELOCITY + 3), b, many) > speed:
            return False
        is_balanced = is_balanced and _keeps_velocity(b, change, many)
    return not is_balanced


@kernel
def calm(part, friction, residual, goal, deep, least, many):
    """Solve an island that is solved to the goal and nearly at rest further: (iterations, residual [m/s], method).

    To `deep` where all of it holds, else by some sweeps as far as `least`. Nothing happens outside resting stages, and
    where that would make more of the residual than the goal.
    """
    fine = _fine(goal, least)
    if many.settings[0].rests == 0 or not fine < residual <= goal:
        return 0, residual, SWEEPS
    if not _may_calm(part, CALM_SPEED * goal, 2.0 * fine, many):
        return 0, residual, SWEEPS
    count, method = 0, SWEEPS
    if all_push(part, many) and prepare_system(part, many.settings[0].sweeps, WORTH_LYING, 1, many) > 0:
        count, method, residual = 1, NEWTON, guess_all_hold(part, friction, residual, deep, many)
    if not residual > fine:
        return count, residual, method
    save_best(part, many)
    more, now = sweep_contacts(part[0], part[1], friction, residual, fine, CALM_SWEEPS, many)
    if not now <= goal:
        bring_back_best(part, many)
        return count + more, residual, method
    return count + more, now, method
