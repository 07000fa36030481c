"""Impact stage of a substep: velocities jump by the impulses of the contacts that approach."""

from __future__ import annotations

import math

from physics.compiler.decorators import inlined
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
def set_plastic_targets(n, work):
    """Targets and first guess of an impact without rebound."""
    for k in range(3 * n):
        work.impulse[k] = 0.0
    for i in range(n):
        work.target[i, 0] = work.target[i, 1] = work.target[i, 2] = 0.0


@inlined
def resolve_impacts(n, y, t, h, contact, offset_frame, records, work):
    """State after the impulses of the contacts that approach, unchanged without one; and whether nothing was hit.

    The impact is t [s] after the start of the call, with h [s] left of the substep. A contact that continues from the
    last stage has hit nothing: its impulses are in `work.rebound`, and belong to the forces of the next stage.
    """
    x, q, v, L = y
    bounce_speed = work.rest_share * work.acceleration * h
    if work.restitution > 0.0:
        bounce_speed /= work.restitution
    slop_speed = work.slop / h
    if not may_have_impact(bounce_speed, slop_speed, work):
        if n == 1 and work.shape == ELLIPSOID and work.speed[0] > slop_speed:
            return cancel_separation(y, h, offset_frame, records.memory, work)
        return y, False
    found = set_impact_targets(n, bounce_speed, slop_speed, y, h, offset_frame, records.memory, work)
    if found == NO_IMPACT:
        return y, False
    place_arms(n, qt.to_matrix(q), offset_frame, work)
    set_tangential_targets(n, bounce_speed, y, offset_frame, work)
    for k in range(3 * n):
        work.impulse[k] = 0.0
    R = qt.to_matrix(principal_attitude(q, work, offset_frame))
    work.mode, work.residual_limit, work.target_error_limit = TRY_SLIDING, math.inf, 0.0
    solved = solve_contacts(n, contact, v, L, R, work)
    if not solved[2] <= work.tolerance:
        solved = scale_impulses_to_dissipate(
            n, contact.friction, v, apply_inv_inertia(R, L, work.J), solved, (v, L), R, work
        )
    solved = reject_energy_gain(n, contact, v, L, solved, R, work)
    v_new, L_new, residual, sweeps, method = apply_resistance_torques(n, contact, v, L, solved, R, work)
    report_solve(records.report, work.world, residual, sweeps, method, work.tolerance)
    if has_friction(contact) and work.restitution > 0.0:
        before, full = kinetic_energy(q, v, L, work, offset_frame), kinetic_energy(q, v_new, L_new, work, offset_frame)
        if full > before + IMPACT_ENERGY_ROUNDING * before:
            for k in range(3 * n):
                work.rebound[k] = work.impulse[k]
            set_plastic_targets(n, work)
            solved = solve_contacts(n, contact, v, L, R, work)
            if not solved[2] <= work.tolerance:
                solved = scale_impulses_to_dissipate(
                    n, contact.friction, v, apply_inv_inertia(R, L, work.J), solved, (v, L), R, work
                )
            v0, L0, residual, sweeps, method = solved
            report_solve(records.report, work.world, residual, sweeps, method, work.tolerance)
            v_new, L_new, s = limit_rebound_energy(q, before, (v0, L0), (v_new, L_new), work, offset_frame)
            for k in range(3 * n):
                work.impulse[k] += s * (work.rebound[k] - work.impulse[k])
    if found == TRUE_IMPACT:
        if records.log.shape[1] > 0:
            log_wall_impacts(n, rows_per_contact(contact), x, 0.0, t, work, records.log, records.counts)
    else:
        for k in range(3 * n):
            work.rebound[k] = work.impulse[k]
    return (x, q, v_new, L_new), found != TRUE_IMPACT
