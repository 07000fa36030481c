"""Energy of a resting stage: impulses that raise it are replaced by those of dissipative targets."""

from __future__ import annotations

from physics.compiler.decorators import inlined
from physics.kernels.contact_law.compliance import ENERGY_GAIN_TOLERANCE
from physics.kernels.contact_law.restitution_energy import scale_impulses_to_dissipate
from physics.kernels.contact_solver.one_contact import point_velocity
from physics.kernels.contact_solver.solve import solve_contacts
from physics.kernels.half_space.contact_point import contact_arm, wall_normal, wall_of
from physics.kernels.math import quaternion as qt
from physics.kernels.state.body import apply_inv_inertia
from physics.kernels.state.contact_law_dispatch import LAW_STIFFNESS, if_law


@inlined
def motion_square(n, velocity, scratch):
    """Square of the velocity that contacts may change: without friction at one wall, only the normal part.

    The result must not depend on the velocity of a body along a frictionless wall.
    """
    scene = scratch.scene
    wall = wall_of(scratch.contacts.slot[0], scene)
    if not scratch.body.mu > 0.0 and wall_of(scratch.contacts.slot[n - 1], scene) == wall:
        normal_speed = qt.dot(wall_normal(scene.walls, wall), velocity)
        return normal_speed * normal_speed
    return qt.dot(velocity, velocity)


@inlined
def has_energy_gain(n, before, w, v, L, solved, R, h, scratch):
    """True if the impulses of a resting stage raise the energy beyond the errors of its solve and its step.

    Impulses P at the centre of mass and moments Q about it change it by ½ P·(v + v') + ½ Q·(ω + ω'), v and ω before
    the stage (`before`, w), v' and ω' after it. `v`, `L` are those with loads and without impulses.
    """
    body = scratch.body
    v_new, L_new, _, _, _ = solved
    if (qt.dot(v_new, v_new) + qt.dot(before, before)) + (qt.dot(L_new, L_new) + qt.dot(w, w)) == 0.0:  # at rest
        return False
    w_new, a = apply_inv_inertia(R, L_new, body.J), body.free_acceleration
    push = body.mass * (
        (v_new[0] - v[0]) * (before[0] + v_new[0])
        + (v_new[1] - v[1]) * (before[1] + v_new[1])
        + (v_new[2] - v[2]) * (before[2] + v_new[2])
    )
    turn = (
        (L_new[0] - L[0]) * (w[0] + w_new[0])
        + (L_new[1] - L[1]) * (w[1] + w_new[1])
        + (L_new[2] - L[2]) * (w[2] + w_new[2])
    )
    if not push + turn > 0.0:
        return False
    square = h * h * (a[0] * a[0] + a[1] * a[1] + a[2] * a[2])
    size = body.mass * (motion_square(n, before, scratch) + square) + abs(qt.dot(L_new, w_new))
    return push + turn > max(scratch.settings.tolerance, ENERGY_GAIN_TOLERANCE) * size


@inlined
def set_dissipative_targets(n, before, w, scratch):
    """Set targets that cannot raise the energy: none lets a contact gain speed, and leaving contacts are reversed.

    A push p changes the energy by p·½(u + u'), with u and u' the normal velocities of its contact before and after. So
    a leaving contact, u > 0, that loads bring back within the stage comes back as fast as it left. It is not stopped
    above its wall.
    """
    contacts = scratch.contacts
    for i in range(n):
        normal = wall_normal(scratch.scene.walls, wall_of(contacts.slot[i], scratch.scene))
        u = qt.dot(normal, point_velocity(contact_arm(contacts, i), before, w))
        contacts.target[i, 0] = min(contacts.target[i, 0], -max(u, 0.0))
        contacts.target[i, 1] = contacts.target[i, 2] = 0.0


def _calmed_if_it_gains(n, contact, before, w, solved, free, R, h, scratch):
    if has_energy_gain(n, before, w, free[0], free[1], solved, R, h, scratch):
        set_dissipative_targets(n, before, w, scratch)
        solved = solve_contacts(n, contact, free[0], free[1], R, scratch)
        if not solved[2] <= scratch.settings.tolerance and has_energy_gain(
            n, before, w, free[0], free[1], solved, R, h, scratch
        ):
            return scale_impulses_to_dissipate(n, contact.friction, before, w, solved, free, R, scratch)
    return solved


@if_law((LAW_STIFFNESS,), _calmed_if_it_gains)
def limit_stage_energy(n, contact, before, w, solved, free, R, h, scratch):
    """Result of `solve_contacts` for `free` (v, L), or of dissipative targets if that raises the energy.

    If even dissipative targets raise it, because no method solved them, the impulses are shortened until they do not.
    Springs may give back the energy that they store.
    """
    return solved
