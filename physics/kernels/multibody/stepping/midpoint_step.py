"""Stage between impacts: exact flight of bodies without contact, Moreau's midpoint step of all others."""

from __future__ import annotations

import math

from physics.compiler.decorators import if_given, inlined, kernel
from physics.kernels.contact_law.target_velocity import (
    GAP_CLOSING_SHARE,
    MAX_TARGET_TURN,
    NEGLIGIBLE_SLOP_SHARE,
    clamp_target_to_energy,
)
from physics.kernels.flight.free_flight import drift_attitude, integrate_flight
from physics.kernels.forces.held_loads import hold_contact_loads, hold_loads
from physics.kernels.forces.two_body_spring import hold_linked_loads
from physics.kernels.forces.world_energy_budget import grant_energy, limit_world_energy_gain, note_stage_energy
from physics.kernels.half_space.contact_point import ellipsoid_point_and_rate
from physics.kernels.math import quaternion as qt
from physics.kernels.math.vector import as_vector, row_vector
from physics.kernels.multibody.data import warm_start as kept
from physics.kernels.multibody.data.capsule_axes import less_turn_of_axes
from physics.kernels.multibody.data.capsules import is_capsule
from physics.kernels.multibody.data.clipped_points import follow_edges
from physics.kernels.multibody.data.contact_set import (
    add_scaled,
    pair_slop,
    parted_slack,
    put_vector,
    relative_acceleration_bound,
    row_matrix,
    slip_velocity,
    subtract,
    update_contacts,
)
from physics.kernels.multibody.data.cylinder_balls import is_beside_cylinder, less_turn_beside_cylinder
from physics.kernels.multibody.data.cylinders import has_cylinders, plus_free_turn
from physics.kernels.multibody.data.driven_bodies import (
    driven_gain,
    driven_work,
    moving_body_at,
    note_stage_work,
    take_later_velocities,
)
from physics.kernels.multibody.data.driven_faces import coriolis_of_owner
from physics.kernels.multibody.data.fixed_bodies import body_at, has_fixed
from physics.kernels.multibody.data.kinematics import move_driven_bodies, update_body_pose
from physics.kernels.multibody.data.parts import (
    acting_bodies,
    body_of,
    center_velocity,
    first_part,
    plus_turning,
    second_part,
)
from physics.kernels.multibody.data.rolling_points import (
    may_roll,
    rolling_acceleration,
    rolling_rate,
    rolls_on_rim,
)
from physics.kernels.multibody.stepping.compliant_stage import aim_at_springs, foretell_end_gaps, split_stage
from physics.kernels.multibody.stepping.energy_budget import (
    has_gained_energy,
    revert_to_dissipative,
    save_loaded_momenta,
    save_pre_load_velocity,
    update_twist,
)
from physics.kernels.multibody.stepping.foretold_twists import gap_to_close, is_foretold, is_held
from physics.kernels.multibody.stepping.impact import FORETOLD
from physics.kernels.multibody.stepping.lone_stage import (
    closing_time,
    exchange_twists,
    foretell_twist,
    mean_slip_target,
    residual_of_lone,
)
from physics.kernels.multibody.stepping.solve_and_apply import (
    leave_moments,
    solve_and_apply,
    solve_frictionless_and_apply,
)
from physics.kernels.multibody.stepping.spring_switches import note_switches
from physics.kernels.state import layout as at
from physics.kernels.state.body import angular_velocity, read_state, write_state
from physics.kernels.state.fixed_body import is_fixed
from physics.kernels.state.groups import FlightSwitches, has_friction
from physics.kernels.state.layout import ELLIPSOID, SPHERE
from physics.kernels.state.sleeping import is_asleep
from physics.kernels.time_stepping.midpoint_step import CREEP_SLOP_SHARE


@inlined
def drift_body(b, h, gyroscopic, offset_frame, many):
    """Move body b by a drift over h [s]: position and attitude change, momenta stay.

    `gyroscopic` and `offset_frame` are switches of `state.groups.FlightSwitches`.
    """
    x, q, v, L = read_state(many.bodies.state, b)
    write_state(
        many.bodies.state,
        b,
        (add_scaled(x, h, v), drift_attitude(q, L, many.bodies.body[b], h, gyroscopic, offset_frame), v, L),
    )


@inlined
def _centripetal(b, k, first, side, h, many):
    """Acceleration ω x ṙ of part b's point in contact k, world frame [m/s²].

    Of a sphere it is that of its centre, under which the contact point stays: 0 unless it is a part of a compound. Of a
    capsule it is that of the ball's centre, since its point stays under a point of its axis. That of a cylinder
    includes α x r for the angular acceleration α of free turning, which points of thin disks feel. It is also 0 if the
    body turns by more than `MAX_TARGET_TURN` in a stage of length h [s], or its point rolls so far, since it then says
    nothing about the stage's end.
    `first` is the column of the body's arm; `side` is -1 for the first body of the contact, 1 for the second.
    """
    shape, w = many.bodies.body[b].shape, row_vector(many.bodies.twist, body_of(b, many), 3)
    if qt.dot(w, w) * h * h > MAX_TARGET_TURN * MAX_TARGET_TURN:
        return (0.0, 0.0, 0.0)
    if shape == SPHERE:
        return plus_turning(b, (0.0, 0.0, 0.0), many)
    if shape == ELLIPSOID:
        d, n = many.bodies.body[b].dims, row_vector(many.contacts.frame, k, 0)
        n = (-side * n[0], -side * n[1], -side * n[2])
        _, rate = ellipsoid_point_and_rate((d[0], d[1], d[2]), row_matrix(many.bodies.rotation, b), w, n)
        return plus_turning(b, qt.cross(w, rate), many)
    if rolls_on_rim(k, b, many):
        rate = rolling_rate(k, b, first, side, many)
        if qt.dot(rate, rate) * h * h > (MAX_TARGET_TURN * many.bodies.body[b].radius) ** 2:
            return (0.0, 0.0, 0.0)
        return plus_free_turn(k, b, first, plus_turning(b, rolling_acceleration(k, b, first, side, many), many), many)
    arm = row_vector(many.contacts.arm, k, first)
    if is_capsule(b, many) or is_beside_cylinder(k, b, first, many):
        arm = add_scaled(arm, -side * many.bodies.body[b].dims[0], row_vector(many.contacts.frame, k, 0))
    return plus_free_turn(k, b, first, qt.cross(w, qt.cross(w, arm)), many)


@inlined
def _coriolis(k, many):
    """Acceleration n·(ω x u) of contact k along its normal, because the normal turns [m/s²].

    The point of one body slides with velocity u on a face of the other, the owner of the normal, which turns at ω. The
    gap's second derivative contains 2 n·(u x ω) beside the accelerations of the points; this is half of it, reversed.
    It is 0 if the normal has no owner.
    """
    owner, n = many.contacts.owner[k], row_vector(many.contacts.frame, k, 0)
    if owner < 0:
        return 0.0
    return coriolis_of_owner(k, owner, n, slip_velocity(k, many), many)


@if_given("many.bodies.fixed", 0.0)
def _turn_of_line(a, b, many):
    """Acceleration |u|²/d of the gap of spheres a and b because the line of their centres turns [m/s²]; else 0.

    u is the relative velocity of the centres across that line, d their distance; `b` is below 0 for a wall.
    """
    if b < 0 or not many.bodies.body[a].shape == SPHERE == many.bodies.body[b].shape:
        return 0.0
    d = subtract(row_vector(many.bodies.center, a, 0), row_vector(many.bodies.center, b, 0))
    u = subtract(center_velocity(a, many), center_velocity(b, many))
    square, along = qt.dot(d, d), qt.dot(u, d)
    return (qt.dot(u, u) - along * along / square) / math.sqrt(square) if square > 0.0 else 0.0


@inlined
def _turning(k, b, h, many):
    """Velocity that contact k loses until the end of a stage of length h [s] by turning, in the contact frame [m/s].

    Its points turn with their bodies, and the normal turns, too. `b` is the second end as of `moving_body_at`.
    """
    half = 0.5 * h
    one, other = first_part(k, many), second_part(body_at(many.contacts.bodies[k, 1], many), k, many)
    c = _centripetal(one, k, 0, -1.0, h, many)
    if b >= 0:
        c = subtract(c, _centripetal(other, k, 3, 1.0, h, many))
    t = qt.matvec(row_matrix(many.contacts.frame, k), (-half * c[0], -half * c[1], -half * c[2]))
    exchange_twists(many.contacts.bodies[k, 0], 0, many)
    t = (t[0] - half * _turn_of_line(one, other, many), t[1], t[2])
    t = less_turn_of_axes(k, one, other, half, t, many)
    exchange_twists(many.contacts.bodies[k, 0], 0, many)
    t = less_turn_beside_cylinder(k, one, other, half, t, many)
    if many.settings[0].is_error_controlled == 1 or has_fixed(many):
        t = (t[0] + h * _coriolis(k, many), t[1], t[2])
    return t


@inlined
def set_resting_targets(n, h, many):
    """Set the target velocities of the n contacts in a resting stage of length h [s], with gaps at its middle.

    They follow `contact_law.target_velocity.set_resting_targets`. A contact with a gap at the start may close the rest
    of it, measured at the middle, in the second half of the stage. Under error control, the gap that a point gains only
    by its motion on a circle is left out: it would cause an error of first order in the velocity. Targets of points
    that roll are not clamped: the clamp of one that hardly moves is on in one stage and off in the next. Such a stage
    is still checked for a gain of energy.
    """
    half, long = 0.5 * h, closing_time(h, many)
    for k in range(n):
        a, b = many.contacts.bodies[k, 0], moving_body_at(many.contacts.bodies[k, 1], many)
        slop = pair_slop(a, b, many)
        exchange_twists(a, 1, many)
        t = _turning(k, b, h, many)
        exchange_twists(a, 1, many)
        gap = many.contacts.gap[k]
        if many.settings[0].is_error_controlled == 1 or has_fixed(many) or has_cylinders(many):
            gap += 0.5 * half * (t[0] + driven_gain(k, many))
        u = qt.matvec(row_matrix(many.contacts.frame, k), slip_velocity(k, many))
        if not (may_roll(k, many) or is_foretold(many)):
            t = clamp_target_to_energy(t, u)
        t = mean_slip_target(k, t, u, many)
        if many.contacts.target[k, 0] == FORETOLD:
            t = (t[0] - (max(gap, 0.0) + slop) / half, t[1], t[2])
        elif gap > slop and not is_held(k, many):
            t = (t[0] - (gap + parted_slack(k, many)) / half, t[1], t[2])
        elif gap_to_close(k, gap, many) != 0.0:
            t = (t[0] - GAP_CLOSING_SHARE * gap_to_close(k, gap, many) / long, t[1], t[2])
        negligible = max(
            many.settings[0].tolerance * relative_acceleration_bound(k, many) * h, NEGLIGIBLE_SLOP_SHARE * slop / long
        )
        if max(abs(t[0]), max(abs(t[1]), abs(t[2]))) <= negligible:
            t = (0.0, 0.0, 0.0)
        put_vector(many.contacts.target, k, 0, t)


@if_given("many.compliance")
def set_spring_targets(n, before, after, many):
    """Set the normal targets of the n contacts in a stage with drifts of `before` and `after` [s] (`compliant_stage`).

    Those along the contact planes stay, as `set_resting_targets` has set them.
    """
    for k in range(n):
        turning = _turning(k, moving_body_at(many.contacts.bodies[k, 1], many), 2.0 * after, many)[0]
        aim_at_springs(k, -turning / after, before, after, many)


@inlined
def hold_all_loads(h, gyroscopic, offset_frame, many):
    """Evaluate the loads at the middle of a stage of length h [s], and hold them over the stage, for every body.

    Without force fields it does nothing. `gyroscopic` and `offset_frame` are switches of `state.groups.FlightSwitches`.
    """
    if hold_linked_loads(h, gyroscopic, offset_frame, acting_bodies(many)):
        return
    for b in range(many.bodies.state.shape[0]):
        if is_fixed(b, many.bodies):
            continue
        if many.bodies.touched[b] == 1:
            hold_contact_loads(read_state(many.bodies.state, b), h, gyroscopic, offset_frame, many.bodies.body[b])
        else:
            hold_loads(read_state(many.bodies.state, b), h, gyroscopic, offset_frame, many.bodies.body[b])


@inlined
def rest_residual(h, many):
    """Largest residual that a resting stage of length h [s] may have, whatever the tolerance is [m/s].

    It keeps strongly pressed bodies from creeping; see `time_stepping.midpoint_step.rest_residual`. It is infinite if
    the tolerance is fine enough for every touching body.
    """
    least = math.inf
    for b in range(many.bodies.state.shape[0]):
        slop_speed = many.bodies.body[b].slop / h
        if (
            many.bodies.touched[b] == 1
            and many.settings[0].tolerance * many.bodies.body[b].acceleration * h > slop_speed
        ):
            least = min(least, CREEP_SLOP_SHARE * slop_speed)
    return min(least, residual_of_lone(many))


@inlined
def max_load_speed(h, many):
    """Largest speed that loads alone give to a touching body in a stage of length h [s], as a bound [m/s]."""
    most = 0.0
    for b in range(many.bodies.state.shape[0]):
        if many.bodies.touched[b] == 1:
            most = max(most, many.bodies.body[b].acceleration * h)
    return most


@inlined
def step_under_held_loads(n, world, h, switches, sleep, records, many):
    """Do the work of `midpoint_step` after the loads are held: flights, drifts, contact problem, and its energy check.

    If the impulses raise the energy, the contact problem is solved again with targets that cannot, and then, if need
    be, without friction. Arguments are those of `midpoint_step`.
    """
    before, after = split_stage(n, world, h, records.memory, many)
    first = world * many.bodies.state.shape[0]
    for b in range(many.bodies.state.shape[0]):
        if is_asleep(first + b, sleep) or is_fixed(b, many.bodies):
            continue
        if many.bodies.touched[b] == 0:
            flight = FlightSwitches(switches.flight.gyroscopic, switches.flight.offset_frame, switches.flight.scheme)
            write_state(
                many.bodies.state,
                b,
                integrate_flight(read_state(many.bodies.state, b), h, flight, many.bodies.body[b]),
            )
            continue
        drift_body(b, before, switches.flight.gyroscopic, switches.flight.offset_frame, many)
        update_body_pose(b, switches.flight.offset_frame, many)
        _, q, _, L = read_state(many.bodies.state, b)
        put_vector(many.bodies.twist, b, 3, angular_velocity(q, L, many.bodies.body[b], switches.flight.offset_frame))
    move_driven_bodies(before, switches.flight.offset_frame, many)
    if n == 0:
        move_driven_bodies(after, switches.flight.offset_frame, many)
        kept.clear_awake_warm_start(world, h, sleep, records.memory, many)
        return
    update_contacts(many)
    follow_edges(n, before, many)
    take_later_velocities(n, after, many)
    foretell_twist(n, world, h, switches, records.memory, many)
    set_resting_targets(n, h, many)
    set_spring_targets(n, before, after, many)
    for b in range(many.bodies.state.shape[0]):
        if many.bodies.touched[b] == 1:
            body = many.bodies.body[b]
            a, torque = as_vector(body.free_acceleration), as_vector(body.torque)
            save_pre_load_velocity(b, row_vector(many.bodies.state, b, at.LINVEL), many)
            put_vector(many.bodies.state, b, at.LINVEL, add_scaled(row_vector(many.bodies.state, b, at.LINVEL), h, a))
            put_vector(
                many.bodies.state, b, at.ANGMOM, add_scaled(row_vector(many.bodies.state, b, at.ANGMOM), h, torque)
            )
            save_loaded_momenta(b, many)
            update_twist(b, switches.flight.offset_frame, many)
    kept.load_warm_impulses(n, world, h, switches.friction, records.memory, many)
    many.settings[0].residual_limit, many.settings[0].is_resting_stage = (
        rest_residual(h, many),
        1 - many.settings[0].is_error_controlled,
    )
    many.settings[0].load_speed = max_load_speed(h, many)
    solve_and_apply(n, world, switches.friction, records.report, many)
    foretell_end_gaps(n, after, many)
    if has_gained_energy(n, h, many):
        revert_to_dissipative(n, switches.flight.offset_frame, many)
        leave_moments(n, many)
        solve_and_apply(n, world, switches.friction, records.report, many)
        foretell_end_gaps(n, after, many)
        if has_friction(switches) and has_gained_energy(n, h, many):
            revert_to_dissipative(n, switches.flight.offset_frame, many)
            solve_frictionless_and_apply(n, many)
            foretell_end_gaps(n, after, many)
    note_stage_work(n, after, many)
    many.settings[0].residual_limit, many.settings[0].is_resting_stage, many.settings[0].load_speed = math.inf, 0, 0.0
    note_switches(n, h, many)
    kept.store_warm_impulses(n, world, h, sleep, records.memory, many)
    for b in range(many.bodies.state.shape[0]):
        if many.bodies.touched[b] == 1:
            drift_body(b, after, switches.flight.gyroscopic, switches.flight.offset_frame, many)
    move_driven_bodies(after, switches.flight.offset_frame, many)


@if_given("many.driven")
def _grant_driven_work(n, many):
    """Let the energy budget of the stage allow for the work of driven bodies by the impulses of the n contacts."""
    grant_energy(driven_work(n, many), many.bodies.body[0])


@kernel
def midpoint_step(n, world, h, switches, sleep, records, many):
    """Advance every body by h [s]: exact flight, or Moreau's midpoint step with the n contacts of the set.

    `world` is the index of the world. Loads are held over the stage, and energy that stiff fields create is taken away.
    Impulses are stored as the next warm start. `sleep` is None if the scene declares no sleep.
    """
    hold_all_loads(h, switches.flight.gyroscopic, switches.flight.offset_frame, many)
    note_stage_energy(switches.flight.offset_frame, acting_bodies(many), many.bodies.body[0])
    step_under_held_loads(n, world, h, switches, sleep, records, many)
    _grant_driven_work(n, many)
    limit_world_energy_gain(h, 0, switches.flight.offset_frame, acting_bodies(many), many.bodies.body[0])
