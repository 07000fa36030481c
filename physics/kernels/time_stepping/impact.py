"""Resolve the impacts of a body with walls: its velocities jump by the impulses of contacts that approach."""

from __future__ import annotations

import math

from physics.compiler.decorators import inlined
from physics.kernels.contact_law.materials import has_different_walls
from physics.kernels.contact_law.restitution_energy import (
    IMPACT_ENERGY_ROUNDING,
    limit_rebound_energy,
    scale_impulses_to_dissipate,
)
from physics.kernels.contact_law.target_velocity import NO_IMPACT, TRUE_IMPACT, may_have_impact, set_impact_targets
from physics.kernels.contact_solver.sliding_patch import TRY_SLIDING
from physics.kernels.contact_solver.solve import rows_per_contact, solve_contacts
from physics.kernels.half_space.contact_point import place_arms
from physics.kernels.half_space.persistent_contacts import cancel_separation
from physics.kernels.math import quaternion as qt
from physics.kernels.state.body import apply_inv_inertia, kinetic_energy, principal_attitude, report_solve
from physics.kernels.state.groups import has_friction
from physics.kernels.state.layout import ELLIPSOID
from physics.kernels.time_stepping.event_log import log_wall_impacts
from physics.kernels.time_stepping.rolling_friction import apply_resistance_torques
from physics.kernels.time_stepping.tangential_restitution import reject_energy_gain, set_tangential_targets


@inlined
def set_plastic_targets(n, contacts):
    """Set zero targets and zero initial impulses for n contacts: an impact without rebound."""
    for k in range(3 * n):
        contacts.impulse[k] = 0.0
    for i in range(n):
        contacts.target[i, 0] = contacts.target[i, 1] = contacts.target[i, 2] = 0.0


@inlined
def resolve_impacts(n, y, t, h, contact, offset_frame, records, scratch):
    """Resolve the impacts of n contacts in the state y: (state after the impulses, is_persistent).

    The impact is t [s] after the start of the call, with h [s] left of the substep. Without an impact the state stays
    the same. `is_persistent` is true if only persistent contacts, which continue from the last stage, got impulses:
    then nothing was hit, and the impulses, in `contacts.rebound`, belong to the contact forces of the next stage.
    """
    settings, body, stage, contacts = scratch.settings, scratch.body, scratch.stage, scratch.contacts
    x, q, v, L = y
    bounce_speed = settings.rest_share * body.acceleration * h
    if body.restitution > 0.0:
        bounce_speed /= body.restitution
    slop_speed = body.slop / h
    if not may_have_impact(bounce_speed, slop_speed, scratch):
        if n == 1 and body.shape == ELLIPSOID and contacts.speed[0] > slop_speed:
            return cancel_separation(y, h, offset_frame, records.memory, scratch)
        return y, False
    found = set_impact_targets(n, bounce_speed, slop_speed, y, h, offset_frame, records.memory, scratch)
    if found == NO_IMPACT:
        return y, False
    place_arms(n, qt.to_matrix(q), offset_frame, scratch)
    set_tangential_targets(n, bounce_speed, y, offset_frame, scratch)
    for k in range(3 * n):
        contacts.impulse[k] = 0.0
    R = qt.to_matrix(principal_attitude(q, body, offset_frame))
    stage.mode, stage.residual_limit, stage.target_error_limit = TRY_SLIDING, math.inf, 0.0
    solved = solve_contacts(n, contact, v, L, R, scratch)
    if not solved[2] <= settings.tolerance:
        solved = scale_impulses_to_dissipate(
            n, contact.friction, v, apply_inv_inertia(R, L, body.J), solved, (v, L), R, scratch
        )
    solved = reject_energy_gain(n, contact, v, L, solved, R, scratch)
    v_new, L_new, residual, sweeps, method = apply_resistance_torques(n, contact, v, L, solved, R, scratch)
    report_solve(records.report, body.world, residual, sweeps, method, settings.tolerance)
    if (has_friction(contact) or has_different_walls(scratch)) and body.restitution > 0.0:
        before, full = kinetic_energy(q, v, L, body, offset_frame), kinetic_energy(q, v_new, L_new, body, offset_frame)
        if full > before + IMPACT_ENERGY_ROUNDING * before:
            for k in range(3 * n):
                contacts.rebound[k] = contacts.impulse[k]
            set_plastic_targets(n, contacts)
            solved = solve_contacts(n, contact, v, L, R, scratch)
            if not solved[2] <= settings.tolerance:
                solved = scale_impulses_to_dissipate(
                    n, contact.friction, v, apply_inv_inertia(R, L, body.J), solved, (v, L), R, scratch
                )
            v0, L0, residual, sweeps, method = solved
            report_solve(records.report, body.world, residual, sweeps, method, settings.tolerance)
            v_new, L_new, s = limit_rebound_energy(q, before, (v0, L0), (v_new, L_new), body, offset_frame)
            for k in range(3 * n):
                contacts.impulse[k] += s * (contacts.rebound[k] - contacts.impulse[k])
    if found == TRUE_IMPACT:
        if records.log.shape[1] > 0:
            log_wall_impacts(n, rows_per_contact(contact), x, 0.0, t, scratch, records.log, records.counts)
    else:
        for k in range(3 * n):
            contacts.rebound[k] = contacts.impulse[k]
    return (x, q, v_new, L_new), found != TRUE_IMPACT
