"""Impulses of impacts, and of leaps where no force is consistent, from contact problems."""

from __future__ import annotations

from physics.compiler.decorators import inlined, kernel
from physics.kernels.contact_law.restitution_energy import IMPACT_ENERGY_ROUNDING, limit_rebound_energy
from physics.kernels.contact_solver.sliding_patch import TRY_SLIDING
from physics.kernels.contact_solver.solve import rows_per_contact, solve_contacts
from physics.kernels.event_driven.acceleration_problem import set_up_contact
from physics.kernels.event_driven.contact_forces import free_angular_motion
from physics.kernels.event_driven.extrapolated_midpoint import put_state_row
from physics.kernels.event_driven.guards import compute_feature_gaps
from physics.kernels.event_driven.workspace import ROW_START
from physics.kernels.forces.held_loads import refresh_loads
from physics.kernels.half_space.contact_point import contact_arm_and_rate, feature_of, wall_normal, wall_of
from physics.kernels.math import quaternion as qt
from physics.kernels.math.vector import as_vector
from physics.kernels.state import layout as at
from physics.kernels.state.body import angular_velocity, kinetic_energy, principal_attitude, report_solve
from physics.kernels.state.contact_law_dispatch import LAW_TANGENTIAL, if_law
from physics.kernels.state.groups import has_friction
from physics.kernels.time_stepping import event_log as ev
from physics.kernels.time_stepping.impact import set_plastic_targets
from physics.kernels.time_stepping.tangential_restitution import reject_energy_gain, set_tangential_target

# Impacts in turn at one moment at most. Speeds fall by a constant factor from round to round where they do not end:
# cos²φ between two plastic walls whose normals are φ apart or π - φ.
_MAX_SEQUENTIAL_IMPACTS = 1000

# Residual of a contact problem that is as good as none: rounding of forces that differ by five orders.
_ROUNDING_RESIDUAL = 1.0e-11

# Residual of what is no solution, relative to the largest free contact speed.
_FAILED_RESIDUAL = 1.0e-3

# No contact alone.
_ALL_AT_ONCE = -1


@inlined
def rebound_target(speed, normal, r, rate, w, alpha, body, motion):
    """Target velocity of a contact that approaches with `speed`; stores the time of bounces that are too short.

    A leaving contact may be reversed, to approach at e times its speed and collide next. If it were only stopped, its
    impulse would do work on it, and the energy would grow.

    With the free acceleration b towards the wall a bounce at e times the speed takes t = 2 e speed / b, and all that
    follow it t e/(1 - e).
    """
    thresholds, pace = motion.thresholds, motion.pace
    if speed < -thresholds.rest_speed:
        return body.restitution * speed
    if not speed > thresholds.rest_speed:
        return 0.0
    goal = body.restitution * speed
    if goal > thresholds.rest_speed:
        return goal
    a, c, g = as_vector(body.free_acceleration), qt.cross(alpha, r), qt.cross(w, rate)
    b = -(qt.dot(normal, a) + qt.dot(normal, c) + qt.dot(normal, g))
    if b > 0.0 and body.restitution < 1.0:
        pace.skipped_bounce_time = max(pace.skipped_bounce_time, 2.0 * goal / (b * (1.0 - body.restitution)))
    return 0.0


@inlined
def takes_part_in_impact(s, motion):
    """True if feature s takes part in an impact: it touches, or would in no time."""
    smooth, thresholds = motion.smooth, motion.thresholds
    way = -smooth.gap_rate[ROW_START, s] * thresholds.simultaneity_time
    return smooth.gap[ROW_START, s] <= max(thresholds.touch_gap, way)


@inlined
def next_sequential_impact(body, motion, report):
    """Feature that collides alone because it approaches fastest; _ALL_AT_ONCE where all collide at once.

    All collide at once also after `_MAX_SEQUENTIAL_IMPACTS` at one moment; the report counts this as a problem not
    solved to its tolerance.
    """
    if not motion.thresholds.is_sequential:
        return _ALL_AT_ONCE
    motion.pace.sequential_impacts += 1
    if motion.pace.sequential_impacts > _MAX_SEQUENTIAL_IMPACTS:
        report[body.world, at.UNCONVERGED] += 1.0
        return _ALL_AT_ONCE
    fastest, found = 0.0, _ALL_AT_ONCE
    for s in range(motion.smooth.is_active.shape[0]):
        if takes_part_in_impact(s, motion) and motion.smooth.gap_rate[ROW_START, s] < fastest:
            fastest, found = motion.smooth.gap_rate[ROW_START, s], s
    return found


@kernel
def set_up_impact_problem(y, offset_frame, scratch, motion, report):
    """Write the contact problem of all touching contacts, or of the next in turn; return their number."""
    scene, body = scratch.scene, scratch.body
    smooth = motion.smooth
    put_state_row(smooth, ROW_START, y)
    compute_feature_gaps(ROW_START, offset_frame, scratch, smooth)
    R, _, w, alpha = free_angular_motion(y, offset_frame, body)
    n = 0
    motion.pace.skipped_bounce_time = 0.0
    only = next_sequential_impact(body, motion, report)
    for s in range(smooth.is_active.shape[0]):
        rate = smooth.gap_rate[ROW_START, s]
        if (
            not takes_part_in_impact(s, motion)
            or n >= scratch.contacts.slot.shape[0]
            or (only != _ALL_AT_ONCE and s != only)
        ):
            continue
        normal = wall_normal(scene.walls, wall_of(s, scene))
        r, r_rate = contact_arm_and_rate(
            body.shape, as_vector(body.dims), R, w, normal, feature_of(s, scene), offset_frame, body
        )
        goal = rebound_target(-rate, normal, r, r_rate, w, alpha, body, motion)
        set_up_contact(n, s, r, (goal, 0.0, 0.0), scratch.contacts)
        n += 1
        report[body.world, at.PENETRATION] = max(report[body.world, at.PENETRATION], -smooth.gap[ROW_START, s])
    scratch.stage.mode = TRY_SLIDING
    return n


def _no_tangential_target(*arguments):
    return None


@if_law((LAW_TANGENTIAL,), _no_tangential_target)
def set_tangential_rebound(n, y, offset_frame, motion, scratch):
    """Set targets along the wall of the single bouncing contact, as `tangential_restitution.set_tangential_targets`.

    A contact with a restitution but without a rebound is a bounce left out; it has no rebound along the wall either.
    """
    bouncing, found = 0, 0
    for i in range(n):
        speed = -motion.smooth.gap_rate[ROW_START, scratch.contacts.slot[i]]
        if speed > motion.thresholds.rest_speed and (
            scratch.contacts.target[i, 0] > 0.0 or not scratch.body.restitution > 0.0
        ):
            bouncing, found = bouncing + 1, i
    if bouncing == 1:
        set_tangential_target(found, y, offset_frame, scratch)


@inlined
def report_impact_solve(solved, report, scratch):
    """Add a contact problem, solved to rounding, to the world's report."""
    report_solve(report, scratch.body.world, *solved[2:], max(scratch.settings.tolerance, _ROUNDING_RESIDUAL))


@inlined
def _solve_plastic_impact(n, contact, v, L, solved, P, scratch, report):
    """Solve the same collision without any rebound; the cost of `solved` goes into the report."""
    report_impact_solve(solved, report, scratch)
    set_plastic_targets(n, scratch.contacts)
    return solve_contacts(n, contact, v, L, P, scratch)


@kernel
def fall_back_to_plastic(n, contact, v, L, solved, P, scratch, report):
    """Result of `solve_contacts` for a collision; of an impact without rebound if that is no solution.

    With friction two contacts may hold any stress along the line between them, and no impulse moves one of them along
    it. If a rebound along the line is wanted and neither slides, Newton's law and Coulomb's have no common solution.
    """
    is_asked = False
    for i in range(n):
        is_asked = is_asked or scratch.contacts.target[i, 0] > 0.0
    if solved[2] <= _FAILED_RESIDUAL or not is_asked:
        return solved
    return _solve_plastic_impact(n, contact, v, L, solved, P, scratch, report)


@kernel
def cap_rebound_energy(n, y, contact, offset_frame, solved, P, scratch, contacts, report):
    """Result of `solve_contacts` for a collision with friction, its rebound limited to the available energy.

    The impulses in `scratch` are those of the result. See `physics.kernels.contact_law.restitution_energy`.
    """
    body = scratch.body
    _, q, v, L = y
    v_full, L_full = solved[0], solved[1]
    before, full = kinetic_energy(q, v, L, body, offset_frame), kinetic_energy(q, v_full, L_full, body, offset_frame)
    if not full > (1.0 + IMPACT_ENERGY_ROUNDING) * before:
        return solved
    for k in range(3 * n):
        contacts.rebound[k] = scratch.contacts.impulse[k]
    plastic = _solve_plastic_impact(n, contact, v, L, solved, P, scratch, report)
    v_plastic, L_plastic, residual, sweeps, method = plastic
    v, L, s = limit_rebound_energy(q, before, (v_plastic, L_plastic), (v_full, L_full), body, offset_frame)
    for k in range(3 * n):
        scratch.contacts.impulse[k] += s * (contacts.rebound[k] - scratch.contacts.impulse[k])
    return v, L, residual, sweeps, method


@kernel
def set_up_jump_problem(y, h, offset_frame, scratch, motion):
    """Write the contact problem of a first-order step over h into `scratch`: (contacts, velocity, angular momentum)."""
    scene, body = scratch.scene, scratch.body
    smooth = motion.smooth
    put_state_row(smooth, ROW_START, y)
    compute_feature_gaps(ROW_START, offset_frame, scratch, smooth)
    R, _, w, _ = free_angular_motion(y, offset_frame, body)
    count = 0
    for s in range(smooth.is_active.shape[0]):
        gap, rate = smooth.gap[ROW_START, s], smooth.gap_rate[ROW_START, s]
        if not gap <= motion.thresholds.touch_gap - min(0.0, rate) * h or count >= scratch.contacts.slot.shape[0]:
            continue
        n = wall_normal(scene.walls, wall_of(s, scene))
        r, _ = contact_arm_and_rate(body.shape, as_vector(body.dims), R, w, n, feature_of(s, scene), offset_frame, body)
        set_up_contact(count, s, r, (-max(gap, 0.0) / h, 0.0, 0.0), scratch.contacts)
        count += 1
    scratch.stage.mode = TRY_SLIDING
    a, torque, v, L = body.free_acceleration, body.torque, y[2], y[3]
    return (
        count,
        (v[0] + h * a[0], v[1] + h * a[1], v[2] + h * a[2]),
        (L[0] + h * torque[0], L[1] + h * torque[1], L[2] + h * torque[2]),
    )


@inlined
def principal_rotation(y, offset_frame, body):
    """Rotation matrix of the principal axes at y."""
    return qt.to_matrix(principal_attitude(y[1], body, offset_frame))


@kernel
def resolve_impacts(y, t, contact, offset_frame, scratch, motion, records):
    """State after the impulses of a collision at the time t, of all touching contacts or of the next in turn."""
    body = scratch.body
    refresh_loads(y, 0.0, offset_frame, body)
    n = set_up_impact_problem(y, offset_frame, scratch, motion, records.report)
    set_tangential_rebound(n, y, offset_frame, motion, scratch)
    x, q, v, L = y
    if n > 0:
        P = principal_rotation(y, offset_frame, body)
        solved = solve_contacts(n, contact, v, L, P, scratch)
        solved = fall_back_to_plastic(n, contact, v, L, solved, P, scratch, records.report)
        solved = reject_energy_gain(n, contact, v, L, solved, P, scratch)
        if has_friction(contact) and body.restitution > 0.0:
            solved = cap_rebound_energy(
                n, y, contact, offset_frame, solved, P, scratch, motion.contacts, records.report
            )
        report_impact_solve(solved, records.report, scratch)
        v, L = solved[0], solved[1]
    ev.log_wall_impacts(
        n,
        rows_per_contact(contact),
        x,
        body.mass * motion.thresholds.rounding_speed,
        t,
        scratch,
        records.log,
        records.counts,
    )
    return x, q, v, L


@kernel
def resolve_inconsistency(y, h, t, contact, offset_frame, scratch, motion, records):
    """State with the velocities of a first-order step over h from the time t, before a leap."""
    body = scratch.body
    refresh_loads(y, 0.0, offset_frame, body)
    n, v, L = set_up_jump_problem(y, h, offset_frame, scratch, motion)
    if n > 0:  # there may be nothing in reach
        P = principal_rotation(y, offset_frame, body)
        solved = solve_contacts(n, contact, v, L, P, scratch)
        report_impact_solve(solved, records.report, scratch)
        v, L = solved[0], solved[1]
    ev.log_wall_impacts(
        n,
        rows_per_contact(contact),
        y[0],
        body.mass * motion.thresholds.rounding_speed,
        t,
        scratch,
        records.log,
        records.counts,
    )
    return y[0], y[1], v, L


@kernel
def drift_at_velocity(y, h, offset_frame, body):
    """State after a moment h at constant velocities."""
    x, q, v, L = y
    w = angular_velocity(q, L, body, offset_frame)
    x = (x[0] + h * v[0], x[1] + h * v[1], x[2] + h * v[2])
    return x, qt.normalise(qt.multiply(qt.exp_map((h * w[0], h * w[1], h * w[2])), q)), v, L
