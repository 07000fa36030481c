"""Tangential restitution of round bodies: a target of the impact.

The point of contact leaves with -e_t times its tangential velocity, as far as Coulomb's cone lets it.

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

# Share by which rounding may let the energy of an impact grow.
_IMPACT_GAIN_ROUNDING = 1.0e-12


tangential_restitution = law_parameter(LAW_TANGENTIAL)


def _no_aim(*arguments):
    return None


@inlined
def set_tangential_target(k, y, offset_frame, work):
    """Target along the wall of contact k, from the velocity of its point."""
    _, q, v, L = y
    w = angular_velocity(q, L, work, offset_frame)
    u = qt.cross(w, (work.arm[k, 0], work.arm[k, 1], work.arm[k, 2]))
    u = (u[0] + v[0], u[1] + v[1], u[2] + v[2])
    share, wall = tangential_restitution(work), wall_of(work.slot[k], work)
    work.target[k, 1] = -share * qt.dot(wall_axis(work.walls, wall, WALL_TANGENT_1), u)
    work.target[k, 2] = -share * qt.dot(wall_axis(work.walls, wall, WALL_TANGENT_2), u)


@if_law((LAW_TANGENTIAL,), _no_aim)
def set_tangential_targets(n, bounce_speed, y, offset_frame, work):
    """Set targets along the wall of the single bouncing contact; with several, friction alone acts along them."""
    bouncing, found = 0, 0
    for i in range(n):
        if -work.speed[i] > bounce_speed:
            bouncing, found = bouncing + 1, i
    if bouncing == 1:
        set_tangential_target(found, y, offset_frame, work)


@inlined
def _energy(v, L, R, work):
    """Kinetic energy [J]."""
    return 0.5 * (work.mass * qt.dot(v, v) + qt.dot(L, apply_inv_inertia(R, L, work.J)))


@if_law((LAW_TANGENTIAL,), _as_solved)
def reject_energy_gain(n, contact, v, L, solved, R, work):
    """Result of `solve_contacts` for v and L, or the one without `set_tangential_targets` if that has gained energy.

    A sphere's only contact cannot gain energy, since its motions along and across the wall do not mix. A contact of a
    sphere that also rests on another wall can, because the coefficients differ.
    """
    if n == 1 or not _energy(solved[0], solved[1], R, work) > (1.0 + _IMPACT_GAIN_ROUNDING) * _energy(v, L, R, work):
        return solved
    for i in range(n):
        work.target[i, 1] = work.target[i, 2] = 0.0
        work.impulse[3 * i] = work.impulse[3 * i + 1] = work.impulse[3 * i + 2] = 0.0
    return solve_contacts(n, contact, v, L, R, work)
