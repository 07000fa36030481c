"""Tangential restitution of round bodies, as a tangential target velocity of an impact.

The contact point leaves with -e_t times its tangential velocity, as far as Coulomb's friction cone allows.

References
----------
.. [1] O. R. Walton, *Numerical simulation of inelastic, frictional particle-particle interactions*, 1993, for e_t with
   friction.
.. [2] R. L. Garwin, *Kinematics of an ultraelastic rough ball*, Am. J. Phys. 37, 1969, for the superball.
"""

from __future__ import annotations

from physics.compiler.decorators import inlined
from physics.kernels.contact_solver.solve import solve_contacts
from physics.kernels.half_space.contact_point import wall_axis, wall_of
from physics.kernels.math import quaternion as qt
from physics.kernels.state.body import angular_velocity, apply_inv_inertia
from physics.kernels.state.contact_law_dispatch import LAW_TANGENTIAL, if_law, law_parameter
from physics.kernels.state.layout import WALL_TANGENT_1, WALL_TANGENT_2
from physics.kernels.time_stepping.rolling_friction import _as_solved

# Share by which rounding may raise the energy in an impact.
_IMPACT_GAIN_ROUNDING = 1.0e-12


tangential_restitution = law_parameter(LAW_TANGENTIAL)


def _no_aim(*arguments):
    return None


@inlined
def set_tangential_target(k, y, offset_frame, scratch):
    """Set the tangential target of contact k to -e_t times the tangential velocity of its point, in the state y."""
    scene, contacts = scratch.scene, scratch.contacts
    _, q, v, L = y
    w = angular_velocity(q, L, scratch.body, offset_frame)
    u = qt.cross(w, (contacts.arm[k, 0], contacts.arm[k, 1], contacts.arm[k, 2]))
    u = (u[0] + v[0], u[1] + v[1], u[2] + v[2])
    share, wall = tangential_restitution(scratch.body), wall_of(contacts.slot[k], scene)
    contacts.target[k, 1] = -share * qt.dot(wall_axis(scene.walls, wall, WALL_TANGENT_1), u)
    contacts.target[k, 2] = -share * qt.dot(wall_axis(scene.walls, wall, WALL_TANGENT_2), u)


@if_law((LAW_TANGENTIAL,), _no_aim)
def set_tangential_targets(n, bounce_speed, y, offset_frame, scratch):
    """Set the tangential target of the contact that bounces, if exactly one of the n contacts does.

    A contact bounces if it approaches faster than `bounce_speed` [m/s]. With several bouncing contacts, friction alone
    acts along their walls.
    """
    bouncing, found = 0, 0
    for i in range(n):
        if -scratch.contacts.speed[i] > bounce_speed:
            bouncing, found = bouncing + 1, i
    if bouncing == 1:
        set_tangential_target(found, y, offset_frame, scratch)


@inlined
def _energy(v, L, R, body):
    """Kinetic energy of a body with velocity v and angular momentum L [J]; R is the matrix of its principal axes."""
    return 0.5 * (body.mass * qt.dot(v, v) + qt.dot(L, apply_inv_inertia(R, L, body.J)))


@if_law((LAW_TANGENTIAL,), _as_solved)
def reject_energy_gain(n, contact, v, L, solved, R, scratch):
    """Solve an impact again, without tangential targets, if its n contacts have created energy.

    v and L are velocity and angular momentum before the impact, and `solved` is the result of `solve_contacts` for
    them; it is returned, or the new result. The only contact of a sphere cannot create energy, since its motions along
    and across the wall are independent. If the sphere also rests on another wall, the impact can, because the
    coefficients of the two contacts differ.
    """
    contacts = scratch.contacts
    if n == 1 or not _energy(solved[0], solved[1], R, scratch.body) > (1.0 + _IMPACT_GAIN_ROUNDING) * _energy(
        v, L, R, scratch.body
    ):
        return solved
    for i in range(n):
        contacts.target[i, 1] = contacts.target[i, 2] = 0.0
        contacts.impulse[3 * i] = contacts.impulse[3 * i + 1] = contacts.impulse[3 * i + 2] = 0.0
    return solve_contacts(n, contact, v, L, R, scratch)
