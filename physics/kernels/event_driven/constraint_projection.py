"""Take off what rounding and the tolerance leave in the contacts of a regime: a projection in the kinetic metric."""

from __future__ import annotations

from physics.kernels.compile.decorators import inlined, kernel
from physics.kernels.event_driven.contact_forces import free_turning, list_unknowns, place, plus, turned_by, vector
from physics.kernels.event_driven.force_system import solve_unknowns
from physics.kernels.half_space.contact_point import wall_normal, wall_of
from physics.kernels.math import quaternion as qt
from physics.kernels.state.layout import OFFSET

# Gaps and velocities of contacts below these shares of `motion.touch` and `motion.noise` are left as they are.
UNSEEN_GAP = 0.1
UNSEEN_SPEED = 0.01


@inlined
def _push_along(holding, P, work, motion):
    """Velocity and turn, both per kinetic metric, that take off `goal` along the rows of the regime."""
    k = list_unknowns(0.0, holding, work, motion)
    F, T = solve_unknowns(k, P, work, motion)
    s = 1.0 / work.mass
    return (s * F[0], s * F[1], s * F[2]), T


@inlined
def _speed_goals(motion, work):
    """`goal`: the velocities of the contacts that act; the largest that the regime does not allow [m/s]."""
    worst = 0.0
    for j in range(motion.count):
        n = wall_normal(work.walls, wall_of(motion.slot[j], work))
        u = vector(motion.velocity, j)
        worst = max(worst, abs(qt.dot(n, u)))
        if motion.holds[j]:
            worst = max(worst, max(abs(u[0]), max(abs(u[1]), abs(u[2]))))
        for c in range(3):
            motion.goal[j, c] = u[c]
    return worst


@inlined
def _cancel_speeds(holding, v, m, P, work, motion):
    """Velocity and angular momentum without the velocities of contacts that the regime does not allow (placed)."""
    worst = _speed_goals(motion, work)
    if not worst > UNSEEN_SPEED * motion.noise:
        return v, m
    change, turn = _push_along(holding, P, work, motion)
    return plus(v, change), plus(m, turn)


@kernel
def cancel_normal_speeds(y, tilted, work, motion):
    """State without the normal velocities of the contacts that act."""
    x, q, v, m = y
    R, P, w, alpha = free_turning(y, tilted, work)
    place(y, R, w, alpha, tilted, work, motion)
    v, m = _cancel_speeds(False, v, m, P, work, motion)
    return x, q, v, m


@kernel
def cancel(y, tilted, work, motion):
    """State without the gaps and velocities of contacts that the regime does not allow, where above rounding.

    Least change in the kinetic metric: along M⁻¹ Jᵀ.
    """
    if motion.count == 0:
        return y
    x, q, v, m = y
    R, P, w, alpha = free_turning(y, tilted, work)
    place(y, R, w, alpha, tilted, work, motion)
    worst = 0.0
    for j in range(motion.count):
        wall = wall_of(motion.slot[j], work)
        n = wall_normal(work.walls, wall)
        gap = qt.dot(n, x) + qt.dot(n, vector(motion.arm, j)) - work.walls[wall, OFFSET]
        worst = max(worst, abs(gap))
        for c in range(3):
            motion.goal[j, c] = gap * n[c]
    if worst > UNSEEN_GAP * motion.touch:
        move, turn = _push_along(False, P, work, motion)
        x = plus(x, move)
        q = qt.normalise(qt.multiply(qt.exponential(turned_by(P, work.J, turn)), q))
        R, P, w, alpha = free_turning((x, q, v, m), tilted, work)
        place((x, q, v, m), R, w, alpha, tilted, work, motion)
    v, m = _cancel_speeds(True, v, m, P, work, motion)
    return x, q, v, m
