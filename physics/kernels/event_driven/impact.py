"""Solve the impulses of impacts, and of velocity jumps where no contact force is consistent (Painlevé's paradox)."""

from __future__ import annotations

from physics.compiler.decorators import inlined, kernel
from physics.kernels.contact_law.materials import has_different_walls, restitution_at, restitution_of
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

# Largest number of sequential impacts at one moment. If the impacts do not end, speeds fall by a constant factor from
# round to round: cos²φ between two plastic walls whose normals are at the angle φ or π - φ.
_MAX_SEQUENTIAL_IMPACTS = 1000

# Relative residual of a contact problem that counts as rounding, of forces that differ by five orders of magnitude.
_ROUNDING_RESIDUAL = 1.0e-11

# Relative residual above which impulses are no solution.
_FAILED_RESIDUAL = 1.0e-3

# Result of `next_sequential_impact`: all contacts collide at once.
_ALL_AT_ONCE = -1


@inlined
def rebound_target(speed, e, normal, r, rate, w, alpha, body, motion):
    """Target normal velocity of a contact that approaches with `speed` [m/s] in an impact; e is its restitution.

    A contact rebounds at e times its speed. A rebound below `thresholds.rest_speed` counts as zero. A leaving contact
    (speed < 0) may be reversed: it then approaches at e times its speed, and collides next. If it were only stopped,
    its impulse would do work on it, and the energy would grow.

    Bounces too low to be made are left out, and their time is stored in `pace.skipped_bounce_time`. With the free
    acceleration b towards the wall a bounce takes t = 2 e speed / b, and it and all that follow take t/(1 - e). r and
    `rate` are the contact's arm and its rate, alpha the angular acceleration.
    """
    thresholds, pace = motion.thresholds, motion.pace
    if speed < -thresholds.rest_speed:
        return e * speed
    if not speed > thresholds.rest_speed:
        return 0.0
    goal = e * speed
    if goal > thresholds.rest_speed:
        return goal
    a, c, g = as_vector(body.free_acceleration), qt.cross(alpha, r), qt.cross(w, rate)
    b = -(qt.dot(normal, a) + qt.dot(normal, c) + qt.dot(normal, g))
    if b > 0.0 and e < 1.0:
        pace.skipped_bounce_time = max(pace.skipped_bounce_time, 2.0 * goal / (b * (1.0 - e)))
    return 0.0


@inlined
def takes_part_in_impact(s, motion):
    """True if the feature of slot s takes part in an impact: it touches, or will within `simultaneity_time`."""
    smooth, thresholds = motion.smooth, motion.thresholds
    way = -smooth.gap_rate[ROW_START, s] * thresholds.simultaneity_time
    return smooth.gap[ROW_START, s] <= max(thresholds.touch_gap, way)


@inlined
def next_sequential_impact(body, motion, report):
    """Slot of the contact that collides next, the one that approaches fastest; _ALL_AT_ONCE for simultaneous impacts.

    After `_MAX_SEQUENTIAL_IMPACTS` at one moment all contacts collide at once, too. The report then counts a problem
    not solved to its tolerance.
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
    """Write the contact problem of an impact in the state y into `scratch`; return its number of contacts.

    It has all touching contacts, or only the next one if impacts are sequential.
    """
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
        wall = wall_of(s, scene)
        normal, e = wall_normal(scene.walls, wall), restitution_at(wall, body)
        r, r_rate = contact_arm_and_rate(
            body.shape, as_vector(body.dims), R, w, normal, feature_of(s, scene), offset_frame, body
        )
        goal = rebound_target(-rate, e, normal, r, r_rate, w, alpha, body, motion)
        set_up_contact(n, s, r, (goal, 0.0, 0.0), scratch.contacts)
        n += 1
        report[body.world, at.PENETRATION] = max(report[body.world, at.PENETRATION], -smooth.gap[ROW_START, s])
    scratch.stage.mode = TRY_SLIDING
    return n


def _no_tangential_target(*arguments):
    return None


@if_law((LAW_TANGENTIAL,), _no_tangential_target)
def set_tangential_rebound(n, y, offset_frame, motion, scratch):
    """Set the tangential target of the contact that bounces, if exactly one of the n contacts does.

    As in `tangential_restitution.set_tangential_targets`, this is for round bodies with tangential restitution. A
    contact whose bounce is too low to be made has no tangential rebound either.
    """
    bouncing, found = 0, 0
    for i in range(n):
        speed = -motion.smooth.gap_rate[ROW_START, scratch.contacts.slot[i]]
        if speed > motion.thresholds.rest_speed and (
            scratch.contacts.target[i, 0] > 0.0 or not restitution_of(scratch.contacts.slot[i], scratch) > 0.0
        ):
            bouncing, found = bouncing + 1, i
    if bouncing == 1:
        set_tangential_target(found, y, offset_frame, scratch)


@inlined
def report_impact_solve(solved, report, scratch):
    """Add `solved`, a result of `solve_contacts` for a problem to be solved to rounding, to the world's report."""
    report_solve(report, scratch.body.world, *solved[2:], max(scratch.settings.tolerance, _ROUNDING_RESIDUAL))


@inlined
def _solve_plastic_impact(n, contact, v, L, solved, P, scratch, report):
    """Solve an impact of n contacts again, without any rebound; `solved`, its result with rebounds, is only reported.

    v and L are velocity and angular momentum before the impact. The result is that of `solve_contacts`.
    """
    report_impact_solve(solved, report, scratch)
    set_plastic_targets(n, scratch.contacts)
    return solve_contacts(n, contact, v, L, P, scratch)


@kernel
def fall_back_to_plastic(n, contact, v, L, solved, P, scratch, report):
    """Solve an impact again, without rebound, if `solved`, the result of `solve_contacts` with rebounds, has failed.

    With friction two contacts may hold any stress along the line between them, and then no impulse moves one of them
    along it. If Newton's law wants a rebound along this line and neither contact slides, it has no common solution with
    Coulomb's law. The result is that of `solve_contacts`.
    """
    is_asked = False
    for i in range(n):
        is_asked = is_asked or scratch.contacts.target[i, 0] > 0.0
    if solved[2] <= _FAILED_RESIDUAL or not is_asked:
        return solved
    return _solve_plastic_impact(n, contact, v, L, solved, P, scratch, report)


@kernel
def cap_rebound_energy(n, y, contact, offset_frame, solved, P, scratch, contacts, report):
    """Limit the rebound of an impact with friction, so that it gains no energy.

    `solved` is the result of `solve_contacts` for the state y before the impact, with the full rebound. The limited
    result is returned, with its impulses in `scratch.contacts`. See `physics.kernels.contact_law.restitution_energy`.
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
    """Write the contact problem of a first-order step of h [s] from y into `scratch`.

    It has all contacts that may reach their walls within h. Returns (number of contacts, velocity, angular momentum),
    both at the end of the step, without contact impulses.
    """
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
    """Rotation matrix of the principal axes of a body in the state y."""
    return qt.to_matrix(principal_attitude(y[1], body, offset_frame))


@kernel
def resolve_impacts(y, t, contact, offset_frame, scratch, motion, records):
    """State after an impact in the state y, t [s] after the start of the call; its impulses are logged and reported.

    All touching contacts collide, or only the next one if impacts are sequential.
    """
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
        if (has_friction(contact) or has_different_walls(scratch)) and body.restitution > 0.0:
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
    """State y with new velocities that contacts allow, where no contact force is consistent (Painlevé's paradox).

    They are the velocities at the end of a first-order step of h [s], with inelastic impulses; a leap of this length
    follows. t is the time after the start of the call.
    """
    body = scratch.body
    refresh_loads(y, 0.0, offset_frame, body)
    n, v, L = set_up_jump_problem(y, h, offset_frame, scratch, motion)
    if n > 0:  # perhaps no contact is within reach
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
    """State after a motion of h [s] from y at constant velocity and angular velocity."""
    x, q, v, L = y
    w = angular_velocity(q, L, body, offset_frame)
    x = (x[0] + h * v[0], x[1] + h * v[1], x[2] + h * v[2])
    return x, qt.normalise(qt.multiply(qt.exp_map((h * w[0], h * w[1], h * w[2])), q)), v, L
