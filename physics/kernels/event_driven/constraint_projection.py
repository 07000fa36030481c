"""Remove gaps and velocities that a contact mode forbids, by a projection in the kinetic metric.

They are errors of rounding and of the tolerance. An acting contact must have no gap and no normal velocity, and a
sticking one no tangential velocity.
"""

from __future__ import annotations

from physics.compiler.decorators import inlined, kernel
from physics.kernels.event_driven.contact_forces import (
    apply_inverse_inertia,
    assemble_unknowns,
    free_angular_motion,
    set_contact_kinematics,
)
from physics.kernels.event_driven.force_system import solve_contact_forces
from physics.kernels.half_space.contact_point import wall_normal, wall_of
from physics.kernels.math import quaternion as qt
from physics.kernels.math.vector import plus, row_vector
from physics.kernels.state.layout import WALL_OFFSET

# Gaps and velocities of contacts below these shares of `touch_gap` and `rounding_speed` are not removed.
_UNSEEN_GAP = 0.1
_UNSEEN_SPEED = 0.01


@inlined
def _projection_step(holding, P, scratch, motion):
    """Smallest change in the kinetic metric that removes `constraint_error`: (change of velocity, of angular momentum).

    For gaps in place of velocities it is (change of position, moment of inertia times turn). `holding` is true if
    sticking contacts are also to keep their place along the wall. P is the matrix of the principal axes.
    """
    k = assemble_unknowns(0.0, holding, scratch, motion)
    F, T = solve_contact_forces(k, P, scratch.body, motion.unknowns)
    s = 1.0 / scratch.body.mass
    return (s * F[0], s * F[1], s * F[2]), T


@inlined
def _set_velocity_errors(contacts, scene):
    """Write the velocities of the acting contacts to `constraint_error`; return the largest forbidden one [m/s]."""
    worst = 0.0
    for j in range(contacts.count):
        n = wall_normal(scene.walls, wall_of(contacts.slot[j], scene))
        u = row_vector(contacts.velocity, j, 0)
        worst = max(worst, abs(qt.dot(n, u)))
        if contacts.sticks[j]:
            worst = max(worst, max(abs(u[0]), max(abs(u[1]), abs(u[2]))))
        for c in range(3):
            contacts.constraint_error[j, c] = u[c]
    return worst


@inlined
def _project_velocities(holding, v, m, P, scratch, motion):
    """Velocity v and angular momentum m, changed so that contacts have no velocities that the mode forbids.

    `set_contact_kinematics` must have been called. `holding` is true if sticking contacts are to have no tangential
    velocity either.
    """
    worst = _set_velocity_errors(motion.contacts, scratch.scene)
    if not worst > _UNSEEN_SPEED * motion.thresholds.rounding_speed:
        return v, m
    change, turn = _projection_step(holding, P, scratch, motion)
    return plus(v, change), plus(m, turn)


@kernel
def project_normal_speeds(y, offset_frame, scratch, motion):
    """State y, with velocities changed so that the acting contacts have no normal velocity."""
    x, q, v, m = y
    R, P, w, alpha = free_angular_motion(y, offset_frame, scratch.body)
    set_contact_kinematics(y, R, w, alpha, offset_frame, scratch, motion)
    v, m = _project_velocities(False, v, m, P, scratch, motion)
    return x, q, v, m


@kernel
def project_state(y, offset_frame, scratch, motion):
    """State y, changed so that the acting contacts have no gaps and no velocities that the contact mode forbids.

    Rounding is left. The change is the smallest in the kinetic metric, along M⁻¹ Jᵀ.
    """
    scene, body = scratch.scene, scratch.body
    contacts = motion.contacts
    if contacts.count == 0:
        return y
    x, q, v, m = y
    R, P, w, alpha = free_angular_motion(y, offset_frame, body)
    set_contact_kinematics(y, R, w, alpha, offset_frame, scratch, motion)
    worst = 0.0
    for j in range(contacts.count):
        wall = wall_of(contacts.slot[j], scene)
        n = wall_normal(scene.walls, wall)
        gap = qt.dot(n, x) + qt.dot(n, row_vector(contacts.arm, j, 0)) - scene.walls[wall, WALL_OFFSET]
        worst = max(worst, abs(gap))
        for c in range(3):
            contacts.constraint_error[j, c] = gap * n[c]
    if worst > _UNSEEN_GAP * motion.thresholds.touch_gap:
        move, turn = _projection_step(False, P, scratch, motion)
        x = plus(x, move)
        q = qt.normalise(qt.multiply(qt.exp_map(apply_inverse_inertia(P, body.J, turn)), q))
        R, P, w, alpha = free_angular_motion((x, q, v, m), offset_frame, body)
        set_contact_kinematics((x, q, v, m), R, w, alpha, offset_frame, scratch, motion)
    v, m = _project_velocities(True, v, m, P, scratch, motion)
    return x, q, v, m
