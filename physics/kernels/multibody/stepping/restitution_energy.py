"""Impacts among bodies with the largest rebound that creates no energy; see `contact_law.restitution_energy`."""

from __future__ import annotations

from physics.compiler.decorators import inlined, kernel
from physics.kernels.contact_law.restitution_energy import IMPACT_ENERGY_ROUNDING, rebound_share
from physics.kernels.math import quaternion as qt
from physics.kernels.math.vector import row_vector
from physics.kernels.multibody.data.contact_set import add_scaled, put_vector
from physics.kernels.multibody.data.driven_bodies import driven_work
from physics.kernels.multibody.stepping.bouncing import aims_along, clear_tangential_target
from physics.kernels.multibody.stepping.solve_and_apply import (
    leave_moments,
    solve_and_apply,
    solve_frictionless_and_apply,
)
from physics.kernels.state import layout as at
from physics.kernels.state.body import angular_velocity, read_state
from physics.kernels.state.fixed_body import is_fixed

# First columns of the momenta before an impact, and after its full rebound, in `many.bodies.momenta`.
_PRE_IMPACT, _FULL_REBOUND = 0, 6

# Largest relative gain of energy in a plastic impact, in tolerances of its solve.
_ENERGY_TOLERANCES = 4.0


@inlined
def _save_momenta(first, many):
    """Copy velocities and angular momenta of all bodies to `many.bodies.momenta`, from column `first` on."""
    for b in range(many.bodies.state.shape[0]):
        put_vector(many.bodies.momenta, b, first, row_vector(many.bodies.state, b, at.LINVEL))
        put_vector(many.bodies.momenta, b, first + 3, row_vector(many.bodies.state, b, at.ANGMOM))


@inlined
def _update_twists(offset_frame, many):
    """Compute the twists of all bodies from their momenta."""
    for b in range(many.bodies.state.shape[0]):
        _, q, v, L = read_state(many.bodies.state, b)
        put_vector(many.bodies.twist, b, 0, v)
        put_vector(many.bodies.twist, b, 3, angular_velocity(q, L, many.bodies.body[b], offset_frame))


@kernel
def world_kinetic_energy(offset_frame, many):
    """Kinetic energy of all bodies of the world [J]; their twists are computed anew."""
    _update_twists(offset_frame, many)
    total = 0.0
    for b in range(many.bodies.state.shape[0]):
        if is_fixed(b, many.bodies):
            continue
        v, L = row_vector(many.bodies.state, b, at.LINVEL), row_vector(many.bodies.state, b, at.ANGMOM)
        total += 0.5 * (qt.dot(v, v) / many.bodies.inv_mass[b] + qt.dot(L, row_vector(many.bodies.twist, b, 3)))
    return total


@inlined
def _blend_momenta(s, many):
    """Move the momenta of all bodies by the share s towards those after the full rebound (column `_FULL_REBOUND`)."""
    for b in range(many.bodies.state.shape[0]):
        v, L = row_vector(many.bodies.state, b, at.LINVEL), row_vector(many.bodies.state, b, at.ANGMOM)
        v_full, L_full = (
            row_vector(many.bodies.momenta, b, _FULL_REBOUND),
            row_vector(many.bodies.momenta, b, _FULL_REBOUND + 3),
        )
        put_vector(many.bodies.state, b, at.LINVEL, add_scaled(add_scaled(v, -s, v), s, v_full))
        put_vector(many.bodies.state, b, at.ANGMOM, add_scaled(add_scaled(L, -s, L), s, L_full))


@inlined
def _save_impulses(n, many):
    """Copy the impulses of the n contacts to `many.contacts.rebound_impulse`."""
    for k in range(n):
        put_vector(many.contacts.rebound_impulse, k, 0, row_vector(many.contacts.impulse, k, 0))


@inlined
def _blend_impulses(n, s, many):
    """Move the impulses of the n contacts by the share s towards those of the full rebound."""
    for k in range(n):
        p = row_vector(many.contacts.impulse, k, 0)
        put_vector(
            many.contacts.impulse,
            k,
            0,
            add_scaled(add_scaled(p, -s, p), s, row_vector(many.contacts.rebound_impulse, k, 0)),
        )


@inlined
def _is_to_rebound(k, many):
    """True if the target of contact k is a rebound by Newton's law, or one along its plane, and not 0."""
    goal = many.contacts.target[k, 0]
    is_normal = goal != 0.0 and goal == -many.contacts.restitution[k] * many.contacts.speed[k]
    return is_normal or aims_along(k, many, many.bodies.body[0])


@inlined
def _set_plastic_targets(n, many):
    """Set up the n contacts as a plastic impact: rebound targets become 0, and momenta those before the impact."""
    for k in range(n):
        put_vector(many.contacts.impulse, k, 0, (0.0, 0.0, 0.0))
        if _is_to_rebound(k, many):
            many.contacts.target[k, 0] = 0.0
        clear_tangential_target(k, many, many.bodies.body[0])
    for b in range(many.bodies.state.shape[0]):
        put_vector(many.bodies.state, b, at.LINVEL, row_vector(many.bodies.momenta, b, _PRE_IMPACT))
        put_vector(many.bodies.state, b, at.ANGMOM, row_vector(many.bodies.momenta, b, _PRE_IMPACT + 3))


@inlined
def _has_rebound(n, many):
    """True if any of the n contacts has a rebound as its target."""
    for k in range(n):
        if _is_to_rebound(k, many):
            return True
    return False


@kernel
def _apply_frictionless(n, offset_frame, many):
    """Solve and apply a plastic impact of the n contacts without friction, from the momenta before the impact.

    This is the last resort, if all solves with friction would create energy.
    """
    _set_plastic_targets(n, many)
    _update_twists(offset_frame, many)
    leave_moments(n, many)
    solve_frictionless_and_apply(n, many)


@kernel
def apply_impact_within_energy(n, world, friction, offset_frame, report, many):
    """Solve and apply an impact of the n contacts, with the largest rebound that creates no energy.

    With friction, Newton's law may require more energy than the bodies have. Without friction, a loose solve may create
    some. `world` is the index of the world; `friction` is None if the scene has no friction. Work of driven bodies is
    no energy that the impact creates.
    """
    _save_momenta(_PRE_IMPACT, many)
    before = world_kinetic_energy(offset_frame, many)
    has_rebound = _has_rebound(n, many)
    solve_and_apply(n, world, friction, report, many)
    work = driven_work(n, many)
    full, size = world_kinetic_energy(offset_frame, many) - work, before + abs(work)
    most = before + _ENERGY_TOLERANCES * many.settings[0].tolerance * size
    if not full > (before + IMPACT_ENERGY_ROUNDING * size if has_rebound else most):
        return
    plastic, least_work = full, work
    if has_rebound:
        _save_momenta(_FULL_REBOUND, many)
        _save_impulses(n, many)
        _set_plastic_targets(n, many)
        _update_twists(offset_frame, many)
        solve_and_apply(n, world, friction, report, many)
        least_work = driven_work(n, many)
        plastic = world_kinetic_energy(offset_frame, many) - least_work
    if plastic > most:
        _apply_frictionless(n, offset_frame, many)
        return
    _blend_momenta(0.5, many)
    middle = world_kinetic_energy(offset_frame, many) - 0.5 * (work + least_work)
    s = rebound_share(before, plastic, full, middle)
    _blend_momenta(2.0 * s - 1.0, many)  # momenta are at the middle between plastic impact and full rebound
    _blend_impulses(n, s, many)
    _update_twists(offset_frame, many)
