"""Keep the impulses of a resting stage from creating energy, by a second solve with dissipative targets."""

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
    """Square of the part of a body's velocity that n contacts may change [m²/s²].

    Contacts without friction at a single wall only change the normal velocity, so only its square counts.
    """
    scene = scratch.scene
    wall = wall_of(scratch.contacts.slot[0], scene)
    if not scratch.body.mu > 0.0 and wall_of(scratch.contacts.slot[n - 1], scene) == wall:
        normal_speed = qt.dot(wall_normal(scene.walls, wall), velocity)
        return normal_speed * normal_speed
    return qt.dot(velocity, velocity)


@inlined
def has_energy_gain(n, before, w, v, L, solved, R, h, scratch):
    """True if the impulses of a resting stage of length h raise the energy beyond the errors of solve and step.

    `before` and w are velocity and angular velocity before the stage. v and L are velocity and angular momentum with
    loads and without contact impulses, and `solved` is the result of `solve_contacts` for them. Let P be the sum of
    the impulses, Q their moment about the centre of mass, v' and ω' the velocities after the stage. The impulses change
    the energy by ½ P·(before + v') + ½ Q·(w + ω').
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
    """Set targets of n contacts with which impulses cannot raise the energy.

    A push p changes the energy by p·½(u + u'), with the normal velocities u and u' of its contact before and after. So
    the normal target is at most 0 for a contact that approaches, and at most -u for one that leaves. Tangential targets
    are 0. `before` and w are velocity and angular velocity before the stage.
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
    """Solve the contacts of a resting stage again, with dissipative targets, if their impulses create energy.

    `solved` is the result of `solve_contacts` for `free`, the (v, L) with loads and without impulses; it is returned,
    or the new result. `before` and w are velocity and angular velocity before the stage. If no method solves the
    contacts with dissipative targets either, their impulses are shortened until they create no energy.

    This function itself is for compliant contact, where springs may give back energy that they store, and returns
    `solved`. The decorator replaces it by `_calmed_if_it_gains` in scenes with rigid contact.
    """
    return solved
