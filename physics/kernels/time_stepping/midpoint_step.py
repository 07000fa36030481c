"""Advance a body in contact over a stage by Moreau's midpoint step.

The stage has three parts: half a free drift, the contact problem at the middle, half a free drift.
"""

from __future__ import annotations

import math

from physics.compiler.decorators import if_given, inlined
from physics.kernels.contact_law.compliance import (
    predict_end_gaps,
    set_spring_targets,
    split_stage_by_theta,
)
from physics.kernels.contact_law.target_velocity import (
    StageMotion,
    set_resting_targets,
)
from physics.kernels.contact_solver.solve import rows_per_contact, solve_contacts
from physics.kernels.flight.free_flight import drift_attitude
from physics.kernels.half_space.contact_point import place_arms
from physics.kernels.half_space.persistent_contacts import (
    WALL_MEMORY_MODE,
    WALL_MEMORY_STAGE,
)
from physics.kernels.math import quaternion as qt
from physics.kernels.state.body import apply_inv_inertia, principal_matrix, report_solve
from physics.kernels.time_stepping.midpoint_friction import (
    cap_friction_work,
    has_slip_reversed,
    oppose_end_slip,
    oppose_mean_slip,
)
from physics.kernels.time_stepping.rolling_friction import apply_resistance_torques
from physics.kernels.time_stepping.stage_energy import limit_stage_energy
from physics.kernels.time_stepping.warm_start import load_warm_start, store_warm_start

# Share of a slop by which a body that strong loads press against a wall may move in a stage.
CREEP_SLOP_SHARE = 0.01

# Share of a slop by which errors in the targets of sticking contacts may move them in a stage.
TARGET_ERROR_SLOP_SHARE = 0.01


@inlined
def rest_residual(h, scratch):
    """Limit of the contact residual in a resting stage of length h [m/s], in addition to the tolerance ε.

    Under loads of acceleration a the tolerance allows a residual of ε a h, by which a body drifts by ε a h² per stage.
    Under strong loads this is more than a slop, and a body pressed against a wall would creep. Then the residual is
    limited so that the drift is a small share of a slop; otherwise the limit is infinite.
    """
    slop_speed = scratch.body.slop / h
    if scratch.settings.tolerance * scratch.body.acceleration * h > slop_speed:
        return CREEP_SLOP_SHARE * slop_speed
    return math.inf


def _no_acceleration(flight, R, m, wb, J):
    return (0.0, 0.0, 0.0)


@if_given("flight.gyroscopic", _no_acceleration)
def _gyroscopic_acceleration(flight, R, m, wb, J):
    """Angular acceleration of free turning, J (m x wb), world frame [rad/s²]; zero if all moments are equal.

    m and wb are angular momentum and angular velocity in the principal frame, R is the matrix of that frame, and J the
    inverse moments.
    """
    g = qt.cross(m, wb)
    return qt.matvec(R, (J[0] * g[0], J[1] * g[1], J[2] * g[2]))


@inlined
def midpoint_step(n, y, h, contact, flight, records, scratch):
    """State after Moreau's midpoint step of length h [s] from y, with the n contacts of the contact set.

    Warm starts are read from `records.memory`; the new impulses are stored there, and the solve goes to the report.
    """
    body, stage, contacts = scratch.body, scratch.stage, scratch.contacts
    x, q, v, L = y
    a, torque = body.free_acceleration, body.torque
    before, after = split_stage_by_theta(n, y, h, flight.offset_frame, scratch)
    x = (x[0] + before * v[0], x[1] + before * v[1], x[2] + before * v[2])
    q = drift_attitude(q, L, body, before, flight.gyroscopic, flight.offset_frame)
    middle = qt.to_matrix(q)
    place_arms(n, middle, flight.offset_frame, scratch)
    R = principal_matrix(q, middle, body, flight.offset_frame)
    w, alpha = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    if L[0] != 0.0 or L[1] != 0.0 or L[2] != 0.0:
        m, J = qt.transposed_matvec(R, L), body.J
        wb = (J[0] * m[0], J[1] * m[1], J[2] * m[2])
        w = qt.matvec(R, wb)
        alpha = _gyroscopic_acceleration(flight, R, m, wb, J)
    motion = StageMotion(middle, v, w, alpha)
    set_resting_targets(n, motion, h, flight.offset_frame, scratch)
    set_spring_targets(n, x, motion, before, after, flight.offset_frame, scratch)
    v0, opposes_mean = v, False
    if n <= scratch.settings.mean_slip:
        last = max(h, records.memory[body.i, WALL_MEMORY_STAGE])
        opposes_mean = oppose_mean_slip(n, contact, v, w, last, scratch)
    width = rows_per_contact(contact)
    load_warm_start(n, width, records.memory, body.i, h, contacts)
    v = (v[0] + h * a[0], v[1] + h * a[1], v[2] + h * a[2])
    L = (L[0] + h * torque[0], L[1] + h * torque[1], L[2] + h * torque[2])
    stage.mode, stage.residual_limit = int(records.memory[body.i, WALL_MEMORY_MODE]), rest_residual(h, scratch)
    stage.target_error_limit = TARGET_ERROR_SLOP_SHARE * body.slop / h
    solved = solve_contacts(n, contact, v, L, R, scratch)
    if opposes_mean and has_slip_reversed(n, solved[0], apply_inv_inertia(R, solved[1], body.J), scratch):
        oppose_end_slip(n, contacts)
        solved = solve_contacts(n, contact, v, L, R, scratch)
    solved = cap_friction_work(n, contact, v0, w, solved, (v, L), R, h, scratch)
    solved = limit_stage_energy(n, contact, v0, w, solved, (v, L), R, h, scratch)
    v_new, L_new, residual, sweeps, method = apply_resistance_torques(n, contact, v, L, solved, R, scratch)
    records.memory[body.i, WALL_MEMORY_MODE] = stage.mode
    report_solve(records.report, body.world, residual, sweeps, method, scratch.settings.tolerance)
    store_warm_start(n, width, records.memory, body.i, h, contacts)
    predict_end_gaps(n, v_new, apply_inv_inertia(R, L_new, body.J), after, scratch)
    x = (x[0] + after * v_new[0], x[1] + after * v_new[1], x[2] + after * v_new[2])
    return x, drift_attitude(q, L_new, body, after, flight.gyroscopic, flight.offset_frame), v_new, L_new
