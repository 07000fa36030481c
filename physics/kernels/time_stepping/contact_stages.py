"""The two contact stages of a substep: impact (velocities jump) and touch (Moreau's midpoint step)."""

from __future__ import annotations

import math

from physics.kernels.compile.decorators import inlined, kernel
from physics.kernels.contact_law.compliance import (
    ENERGY_GAIN_TOLERANCE,
    predict_end_gaps,
    set_spring_targets,
    split_stage_by_theta,
)
from physics.kernels.contact_law.restitution_energy import (
    IMPACT_ENERGY_ROUNDING,
    limit_rebound_energy,
    scale_impulses_to_dissipate,
)
from physics.kernels.contact_law.target_velocity import (
    NO_IMPACT,
    TRUE_IMPACT,
    StageMotion,
    may_have_impact,
    set_impact_targets,
    set_resting_targets,
)
from physics.kernels.contact_solver.one_contact import point_velocity
from physics.kernels.contact_solver.sliding_patch import TRY_SLIDING
from physics.kernels.contact_solver.solve import solve_contacts
from physics.kernels.flight.free_flight import drift_attitude
from physics.kernels.half_space.contact_point import contact_arm, place_arms, wall_normal, wall_of
from physics.kernels.half_space.persistent_contacts import (
    WALL_MEMORY_COUNT,
    WALL_MEMORY_HEAD,
    WALL_MEMORY_MODE,
    WALL_MEMORY_STAGE,
    cancel_separation,
)
from physics.kernels.math import quaternion as qt
from physics.kernels.state import layout as at
from physics.kernels.state.body import apply_inv_inertia, kinetic_energy, principal_attitude
from physics.kernels.state.contact_law_dispatch import LAW_STIFFNESS, if_law
from physics.kernels.state.layout import ELLIPSOID, METHOD_PIVOTING
from physics.kernels.time_stepping.contact_resistance import (
    apply_resistance_torques,
    reject_energy_gain,
    set_tangential_targets,
)
from physics.kernels.time_stepping.event_log import log_wall_impacts
from physics.kernels.time_stepping.midpoint_friction import (
    cap_friction_work,
    has_slip_reversed,
    oppose_end_slip,
    oppose_mean_slip,
)

# Slops that what is pressed by strong loads may move in a step.
CREEP_SLOP_SHARE = 0.01

# Slops that contacts which hold may miss their targets by in a step.
TARGET_ERROR_SLOP_SHARE = 0.01


def wall_memory_size(slots: int) -> int:
    """Columns of `memory` for bodies with `slots` possible contacts."""
    return WALL_MEMORY_HEAD + 4 * slots


@inlined
def load_warm_start(n, width, memory, i, h, work):
    """Impulses of the last resting stage, by slot, scaled to a stage of length h."""
    first = WALL_MEMORY_HEAD + work.slot.shape[0]
    scale = 0.0
    if memory[i, WALL_MEMORY_STAGE] > 0.0:
        scale = h / memory[i, WALL_MEMORY_STAGE]
    for k in range(n):
        base = first + 3 * work.slot[k]
        for c in range(width):
            work.impulse[width * k + c] = memory[i, base + c] * scale


@inlined
def _are_kept(n, memory, i, work):
    """True if the contacts of the last resting stage are those of this one, in the same order."""
    if memory[i, WALL_MEMORY_COUNT] != n:
        return False
    for k in range(n):
        if memory[i, WALL_MEMORY_HEAD + k] != work.slot[k]:
            return False
    return True


@kernel
def _keep_slots(n, memory, i, work):
    """Forget the contacts of the last resting stage for those of this one, whose impulses are zero as yet."""
    first = WALL_MEMORY_HEAD + work.slot.shape[0]
    for k in range(int(memory[i, WALL_MEMORY_COUNT])):
        base = first + 3 * int(memory[i, WALL_MEMORY_HEAD + k])
        for c in range(3):
            memory[i, base + c] = 0.0
    memory[i, WALL_MEMORY_COUNT] = n
    for k in range(n):
        memory[i, WALL_MEMORY_HEAD + k] = work.slot[k]


@inlined
def store_warm_start(n, width, memory, i, h, work):
    """Keep the impulses of this resting stage by slot; what no longer touches is forgotten."""
    first = WALL_MEMORY_HEAD + work.slot.shape[0]
    memory[i, WALL_MEMORY_STAGE] = h
    if not _are_kept(n, memory, i, work):
        _keep_slots(n, memory, i, work)
    for k in range(n):
        base = first + 3 * work.slot[k]
        for c in range(width):
            memory[i, base + c] = work.impulse[width * k + c]


@inlined
def rest_residual(h, work):
    """Residual that a resting stage of length h is solved to whatever the tolerance allows [m/s].

    A share of the speed that loads give in h is a place error of that share of a h² in every step. Under loads so
    strong that this is more than a slop what is pressed against walls would creep: it is held to a small part of one.
    """
    slop_speed = work.slop / h
    if work.tolerance * work.acceleration * h > slop_speed:
        return CREEP_SLOP_SHARE * slop_speed
    return math.inf


@inlined
def report_solve(report, world, residual, sweeps, method, tolerance):
    """Add one contact solve to the world's report."""
    report[world, at.SOLVES] += 1.0
    report[world, at.ITERATIONS] += sweeps
    report[world, at.RESIDUAL] = max(report[world, at.RESIDUAL], residual)
    report[world, at.SOLVER] = max(report[world, at.SOLVER], float(method))
    if method == METHOD_PIVOTING:
        report[world, at.FALLBACKS] += 1.0
    if not residual <= tolerance:
        report[world, at.UNCONVERGED] += 1.0


@inlined
def motion_square(n, velocity, work):
    """Square of the velocity that the contacts may act on: without friction, of one wall, only that along its normal.

    A body that moves along a frictionless wall, however fast, does the same as one that does not.
    """
    wall = wall_of(work.slot[0], work)
    if not work.mu > 0.0 and wall_of(work.slot[n - 1], work) == wall:
        normal_speed = qt.dot(wall_normal(work.walls, wall), velocity)
        return normal_speed * normal_speed
    return qt.dot(velocity, velocity)


@inlined
def has_energy_gain(n, before, w, v, L, solved, R, h, work):
    """True if the impulses of a resting stage raise the energy by more than its solve and its step may be off.

    Impulses P at the centre of mass and moments Q about it change it by ½ P·(v + v') + ½ Q·(ω + ω'), v and ω before
    the stage (`before`, w), v' and ω' after it. `v`, `L` are those with loads and without impulses.
    """
    v_new, L_new, _, _, _ = solved
    zero = (0.0, 0.0, 0.0)
    if v_new == zero and before == zero and L_new == zero and w == zero:  # at rest, as most are
        return False
    w_new, a = apply_inv_inertia(R, L_new, work.J), work.free_acceleration
    push = work.mass * (
        (v_new[0] - v[0]) * (before[0] + v_new[0])
        + (v_new[1] - v[1]) * (before[1] + v_new[1])
        + (v_new[2] - v[2]) * (before[2] + v_new[2])
    )
    turn = (
        (L_new[0] - L[0]) * (w[0] + w_new[0])
        + (L_new[1] - L[1]) * (w[1] + w_new[1])
        + (L_new[2] - L[2]) * (w[2] + w_new[2])
    )
    square = h * h * (a[0] * a[0] + a[1] * a[1] + a[2] * a[2])
    size = work.mass * (motion_square(n, before, work) + square) + abs(qt.dot(L_new, w_new))
    return push + turn > max(work.tolerance, ENERGY_GAIN_TOLERANCE) * size


@inlined
def set_dissipative_targets(n, before, w, work):
    """Targets that cannot raise the energy: no contact is pushed off or along, and what leaves is turned round.

    A push p changes the energy by p·½(u + u'), with u and u' the normal velocities of its contact before and after. So
    one that loads bring back within the stage, u > 0, comes back as fast as it left, instead of being stopped above
    its wall.
    """
    for i in range(n):
        normal = wall_normal(work.walls, wall_of(work.slot[i], work))
        u = qt.dot(normal, point_velocity(contact_arm(work, i), before, w))
        work.target[i, 0] = min(work.target[i, 0], -max(u, 0.0))
        work.target[i, 1] = work.target[i, 2] = 0.0


def _calmed_if_it_gains(n, contact, before, w, solved, free, R, h, work):
    if has_energy_gain(n, before, w, free[0], free[1], solved, R, h, work):
        set_dissipative_targets(n, before, w, work)
        solved = solve_contacts(n, contact, free[0], free[1], R, work)
        if not solved[2] <= work.tolerance and has_energy_gain(n, before, w, free[0], free[1], solved, R, h, work):
            return scale_impulses_to_dissipate(n, contact.friction, before, w, solved, free, R, work)
    return solved


@if_law((LAW_STIFFNESS,), _calmed_if_it_gains)
def limit_stage_energy(n, contact, before, w, solved, free, R, h, work):
    """Result of `solve_contacts` for `free` (v, L); if that raises the energy, the one for calm targets.

    If even that does, since no method solved it, as much of it as does not. Springs give back what they hold.
    """
    return solved


@inlined
def set_plastic_targets(n, work):
    """Targets and first guess of an impact without rebound."""
    for k in range(3 * n):
        work.impulse[k] = 0.0
    for i in range(n):
        work.target[i, 0] = work.target[i, 1] = work.target[i, 2] = 0.0


@inlined
def resolve_impacts(n, y, t, h, contact, tilted, records, work):
    """State after the impulses of the contacts that approach; unchanged when none does.

    It happens t [s] after the start of the call, with h [s] left of the substep.
    """
    x, q, v, L = y
    bounce_speed = work.rest_share * work.acceleration * h
    if work.restitution > 0.0:
        bounce_speed /= work.restitution
    slop_speed = work.slop / h
    if not may_have_impact(bounce_speed, slop_speed, work):
        if n == 1 and work.shape == ELLIPSOID and work.speed[0] > slop_speed:
            return cancel_separation(y, h, tilted, records.memory, work)
        return y
    found = set_impact_targets(n, bounce_speed, slop_speed, y, h, tilted, records.memory, work)
    if found == NO_IMPACT:
        return y
    place_arms(n, qt.to_matrix(q), tilted, work)
    set_tangential_targets(n, bounce_speed, y, tilted, work)
    for k in range(3 * n):
        work.impulse[k] = 0.0
    R = qt.to_matrix(principal_attitude(q, work, tilted))
    work.mode, work.still, work.unseen = TRY_SLIDING, math.inf, 0.0
    solved = solve_contacts(n, contact, v, L, R, work)
    if not solved[2] <= work.tolerance:
        solved = scale_impulses_to_dissipate(
            n, contact.friction, v, apply_inv_inertia(R, L, work.J), solved, (v, L), R, work
        )
    solved = reject_energy_gain(n, contact, v, L, solved, R, work)
    v_new, L_new, residual, sweeps, method = apply_resistance_torques(n, contact, v, L, solved, R, work)
    report_solve(records.report, work.world, residual, sweeps, method, work.tolerance)
    if contact.friction is not None and work.restitution > 0.0:
        before, full = kinetic_energy(q, v, L, work, tilted), kinetic_energy(q, v_new, L_new, work, tilted)
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
            v_new, L_new, s = limit_rebound_energy(q, before, (v0, L0), (v_new, L_new), work, tilted)
            for k in range(3 * n):
                work.impulse[k] += s * (work.rebound[k] - work.impulse[k])
    if records.log.shape[1] > 0 and found == TRUE_IMPACT:
        log_wall_impacts(n, 1 if contact.friction is None else 3, x, 0.0, t, work, records.log, records.counts)
    return x, q, v_new, L_new


@inlined
def midpoint_step(n, y, h, contact, flight, records, work):
    """State after Moreau's midpoint step over h with the n contacts of the set."""
    x, q, v, L = y
    a, torque = work.free_acceleration, work.torque
    before, after = split_stage_by_theta(n, y, h, flight.tilted, work)
    x = (x[0] + before * v[0], x[1] + before * v[1], x[2] + before * v[2])
    q = drift_attitude(q, L, work, before, flight.gyroscopic, flight.tilted)
    middle = qt.to_matrix(q)
    place_arms(n, middle, flight.tilted, work)
    R = middle
    if flight.tilted is not None:
        R = qt.to_matrix(principal_attitude(q, work, flight.tilted))
    w, alpha = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    if L[0] != 0.0 or L[1] != 0.0 or L[2] != 0.0:
        m, J = qt.transposed_matvec(R, L), work.J
        wb = (J[0] * m[0], J[1] * m[1], J[2] * m[2])
        w = qt.matvec(R, wb)
        if flight.gyroscopic is not None:
            g = qt.cross(m, wb)
            alpha = qt.matvec(R, (J[0] * g[0], J[1] * g[1], J[2] * g[2]))
    motion = StageMotion(middle, v, w, alpha)
    set_resting_targets(n, motion, h, flight.tilted, work)
    set_spring_targets(n, x, motion, before, after, flight.tilted, work)
    v0, opposes_mean = v, False
    if contact.friction is not None and n <= work.mean_slip:
        opposes_mean = oppose_mean_slip(n, v, w, max(h, records.memory[work.i, WALL_MEMORY_STAGE]), work)
    width = 3
    if contact.friction is None:
        width = 1
    load_warm_start(n, width, records.memory, work.i, h, work)
    v = (v[0] + h * a[0], v[1] + h * a[1], v[2] + h * a[2])
    L = (L[0] + h * torque[0], L[1] + h * torque[1], L[2] + h * torque[2])
    work.mode, work.still = int(records.memory[work.i, WALL_MEMORY_MODE]), rest_residual(h, work)
    work.unseen = TARGET_ERROR_SLOP_SHARE * work.slop / h
    solved = solve_contacts(n, contact, v, L, R, work)
    if opposes_mean and has_slip_reversed(n, solved[0], apply_inv_inertia(R, solved[1], work.J), work):
        oppose_end_slip(n, work)
        solved = solve_contacts(n, contact, v, L, R, work)
    solved = cap_friction_work(n, contact, v0, w, solved, (v, L), R, h, work)
    solved = limit_stage_energy(n, contact, v0, w, solved, (v, L), R, h, work)
    v_new, L_new, residual, sweeps, method = apply_resistance_torques(n, contact, v, L, solved, R, work)
    records.memory[work.i, WALL_MEMORY_MODE] = work.mode
    report_solve(records.report, work.world, residual, sweeps, method, work.tolerance)
    store_warm_start(n, width, records.memory, work.i, h, work)
    predict_end_gaps(n, v_new, apply_inv_inertia(R, L_new, work.J), after, work)
    x = (x[0] + after * v_new[0], x[1] + after * v_new[1], x[2] + after * v_new[2])
    return x, drift_attitude(q, L_new, work, after, flight.gyroscopic, flight.tilted), v_new, L_new
