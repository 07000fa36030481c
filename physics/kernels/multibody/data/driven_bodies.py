"""Driven bodies: fixed bodies with a prescribed motion (`flight.prescribed_motion`), as ends of contacts.

A driven body is a wall to the solver, as every fixed body (`fixed_bodies`). Its contact point moves with the velocity
w = V + Ω x r + s. V and Ω are the prescribed velocity and spin, r is the arm, and s is the velocity of the surface
along the body, without its component along the normal. Stages set targets for the velocity relative to w
(`take_driven_velocities`). For a solve w is added to them (`aim_at_driven_ends`), so that no solver knows of it.

Impulses p and torques T of rolling and spin friction do the work Σ p·w + Σ T·Ω on the other bodies (`driven_work`),
which is no gain of energy by an error. The report of a step has the work of its impacts, with the velocities of their
moment, and of its stages, with those at the middle of each.

All of this is left out of kernels whose scene has no body with a motion: `many.driven` is None there.
"""

from __future__ import annotations

import math

from physics.compiler.decorators import if_given, inlined, kernel
from physics.kernels.flight.free_flight import drift_attitude, fly
from physics.kernels.flight.prescribed_motion import KIND, STILL, SURFACE, TABLE, pose_after, twist_at
from physics.kernels.forces.held_loads import call_start
from physics.kernels.math import quaternion as qt
from physics.kernels.math.vector import minus, plus, row_vector, times
from physics.kernels.state import layout as at
from physics.kernels.state.body import angular_velocity, read_state

# Entry of `many.driven.clock` with the present time of the world [s]. Entry 0 is that at the start of the call.
NOW = 1


def _zero_at_contact(k, many):
    return (0.0, 0.0, 0.0)


def _unchanged(end, many):
    return end


def _velocity(k, u, many):
    return u


@if_given("many.driven", False)
def is_driven(b, many):
    """True if body b has a prescribed motion now."""
    return many.driven.columns[b, KIND] != STILL


@if_given("many.driven", _unchanged)
def moving_body_at(end, many):
    """Index of the body at an end of a contact if it moves freely or is driven; below 0 for anything that is still."""
    b = end if end >= 0 else -1 - many.walls.shape[0] - end
    return b if b >= 0 and (end >= 0 or is_driven(b, many)) else end


def _end_of_columns(params, many):
    return params.shape[1]


@if_given("many.driven", _end_of_columns)
def motion_column(params, many):
    """First column of motions in `params`, which are the last ones; the end of the columns if no body has a motion."""
    return params.shape[1] - many.driven.columns.shape[1]


@if_given("many.driven")
def bind_motions(params, first, many):
    """Copy the motions of a world's bodies from `params`, whose rows for this world begin at row `first`."""
    m = many.driven.columns
    column = params.shape[1] - m.shape[1]
    for b in range(m.shape[0]):
        for c in range(m.shape[1]):
            m[b, c] = params[first + b, column + c]


@inlined
def _put_twist(b, twist, many):
    for c in range(3):
        many.bodies.twist[b, c], many.bodies.twist[b, 3 + c] = twist[0][c], twist[1][c]


@inlined
def _size(a):
    return math.sqrt(qt.dot(a, a))


@inlined
def _acceleration_bound(b, h, many):
    """Acceleration of the points of driven body b over the next h [s], from three moments: a bound if it is smooth.

    A point at the distance r has the acceleration V' + Ω' x r + Ω x (Ω x r).
    """
    m, t, r = many.driven.columns, many.driven.clock[NOW], many.bodies.body[b].radius
    v, w = twist_at(m, b, t)
    fastest, most = qt.dot(w, w) * r, 0.0
    if m[b, KIND] == TABLE:
        for k in range(1, 3):
            v_new, w_new = twist_at(m, b, t + 0.5 * k * h)
            most = max(most, 2.0 / h * (_size(minus(v_new, v)) + r * _size(minus(w_new, w))))
            fastest = max(fastest, qt.dot(w_new, w_new) * r)
            v, w = v_new, w_new
    return most + fastest


@if_given("many.driven")
def bind_driven_twists(start, h, many):
    """Write twists and accelerations of the driven bodies for a stage of up to h [s], `start` [s] into the call."""
    many.driven.clock[NOW] = call_start(many.driven.clock, many.bodies.body[0]) + start
    many.driven.work[0] = 0.0
    for b in range(many.bodies.state.shape[0]):
        if is_driven(b, many):
            _put_twist(b, twist_at(many.driven.columns, b, many.driven.clock[NOW]), many)
            many.bodies.body[b].acceleration = _acceleration_bound(b, h, many)


@if_given("many.driven")
def drift_driven_bodies(h, many):
    """Move all driven bodies by the time h [s]; write the velocities at its end into their states and twists."""
    t = many.driven.clock[NOW]
    for b in range(many.bodies.state.shape[0]):
        if is_driven(b, many):
            x, q, _, _ = read_state(many.bodies.state, b)
            x, q = pose_after(many.driven.columns, b, x, q, t, h)
            twist = twist_at(many.driven.columns, b, t + h)
            for c in range(3):
                many.bodies.state[b, at.POS + c], many.bodies.state[b, at.LINVEL + c] = x[c], twist[0][c]
            for c in range(4):
                many.bodies.state[b, at.QUAT + c] = q[c]
            _put_twist(b, twist, many)
    many.driven.clock[NOW] = t + h


@if_given("many.driven")
def write_driven_velocities(state, first, many):
    """Write the spins of the driven bodies into `state`, whose rows for this world begin at row `first`."""
    for b in range(many.bodies.state.shape[0]):
        if is_driven(b, many):
            w = twist_at(many.driven.columns, b, many.driven.clock[NOW])[1]
            for c in range(3):
                state[first + b, at.ANGVEL + c] = w[c]


def _no_acceleration(b, many):
    return 0.0


@if_given("many.driven", _no_acceleration)
def acceleration_of(b, many):
    """Bound of the acceleration of the points of fixed body b in this stage [m/s²]: 0 unless it is driven."""
    return many.bodies.body[b].acceleration if is_driven(b, many) else 0.0


def _free_spin(b, q, L, offset_frame, many):
    return angular_velocity(q, L, many.bodies.body[b], offset_frame)


@if_given("many.driven", _free_spin)
def spin_of(b, q, L, offset_frame, many):
    """Angular velocity of body b [rad/s], of attitude q and angular momentum L if it moves freely."""
    if is_driven(b, many):
        return twist_at(many.driven.columns, b, many.driven.clock[NOW])[1]
    return angular_velocity(q, L, many.bodies.body[b], offset_frame)


def _free_attitude(b, q, L, h, gyroscopic, offset_frame, many):
    return drift_attitude(q, L, many.bodies.body[b], h, gyroscopic, offset_frame)


@if_given("many.driven", _free_attitude)
def attitude_after(b, q, L, h, gyroscopic, offset_frame, many):
    """Attitude of body b after h [s], from q now, if no contact turns it; L is its angular momentum."""
    if is_driven(b, many):
        return pose_after(many.driven.columns, b, (0.0, 0.0, 0.0), q, many.driven.clock[NOW], h)[1]
    return drift_attitude(q, L, many.bodies.body[b], h, gyroscopic, offset_frame)


def _free_flight(b, y, gone, h, gyroscopic, offset_frame, many):
    return fly(y, many.bodies.body[b], h, gyroscopic, offset_frame)


@if_given("many.driven", _free_flight)
def state_after(b, y, gone, h, gyroscopic, offset_frame, many):
    """State of body b after h [s] without contact, from its state y at `gone` [s] from now."""
    if is_driven(b, many):
        t = many.driven.clock[NOW] + gone
        x, q = pose_after(many.driven.columns, b, y[0], y[1], t, h)
        return x, q, twist_at(many.driven.columns, b, t + h)[0], y[3]
    return fly(y, many.bodies.body[b], h, gyroscopic, offset_frame)


@inlined
def _point_velocity(b, arm, n, later, many):
    """Velocity w of the surface of driven body b at the end of `arm`, world frame; n is the normal of the contact.

    The twist of the body is that of `later` [s] after its pose, so the velocity along the surface has turned on.
    """
    v, w = row_vector(many.bodies.twist, b, 0), row_vector(many.bodies.twist, b, 3)
    _, q, _, _ = read_state(many.bodies.state, b)
    s = qt.rotate(q, row_vector(many.driven.columns, b, SURFACE))
    s = plus(s, times(later, qt.cross(w, s)))
    s = minus(s, times(qt.dot(s, n), n))
    return plus(plus(v, qt.cross(w, arm)), s)


@inlined
def _take_velocity(k, later, many):
    b, w = -1 - many.walls.shape[0] - many.contacts.bodies[k, 1], (0.0, 0.0, 0.0)
    if b >= 0 and is_driven(b, many):
        w = _point_velocity(b, row_vector(many.contacts.arm, k, 3), row_vector(many.contacts.frame, k, 0), later, many)
    for c in range(3):
        many.driven.velocity[k, c] = w[c]


@inlined
def _normal_velocity(k, many):
    return qt.dot(row_vector(many.contacts.frame, k, 0), row_vector(many.driven.velocity, k, 0))


@if_given("many.driven")
def take_driven_velocity(k, many):
    """Store the present velocity w of the second end of contact k; 0 unless it is driven."""
    _take_velocity(k, 0.0, many)


@if_given("many.driven")
def take_later_velocities(n, h, many):
    """Store the velocities w of the second ends of the n contacts in h [s], with the present arms; write the twists.

    `many.driven.gain` becomes what their normal components gain until then.
    """
    for k in range(n):
        _take_velocity(k, 0.0, many)
        many.driven.gain[k] = -_normal_velocity(k, many)
    for b in range(many.bodies.state.shape[0]):
        if is_driven(b, many):
            _put_twist(b, twist_at(many.driven.columns, b, many.driven.clock[NOW] + h), many)
    for k in range(n):
        _take_velocity(k, h, many)
        many.driven.gain[k] += _normal_velocity(k, many)


def _no_gain(k, many):
    return 0.0


@if_given("many.driven", _no_gain)
def driven_gain(k, many):
    """Gain of the second end's velocity along the normal of contact k, from the middle of a stage to its end [m/s]."""
    return many.driven.gain[k]


@if_given("many.driven", _velocity)
def relative_to_driven(k, u, many):
    """Velocity u of contact k's first end, world frame, relative to its second end if that is driven [m/s]."""
    return minus(u, row_vector(many.driven.velocity, k, 0))


@if_given("many.driven", _zero_at_contact)
def driven_velocity(k, many):
    """Velocity w of the second end of contact k, world frame [m/s]; 0 unless it is driven."""
    return row_vector(many.driven.velocity, k, 0)


@if_given("many.driven")
def copy_driven_velocity(k, to, many):
    """Copy the stored velocity of contact k to contact `to`."""
    for c in range(3):
        many.driven.velocity[to, c] = many.driven.velocity[k, c]


@if_given("many.driven")
def aim_at_driven_ends(n, many):
    """Add to the targets of the n contacts the velocity of their driven ends, until `aim_at_relative_velocities`."""
    E = many.contacts.frame
    for k in range(n):
        w = row_vector(many.driven.velocity, k, 0)
        for c in range(3):
            many.driven.target[k, c] = many.contacts.target[k, c]
            many.contacts.target[k, c] += qt.dot(row_vector(E, k, 3 * c), w)


@if_given("many.driven")
def aim_at_relative_velocities(n, many):
    """Restore the targets that the n contacts had before `aim_at_driven_ends`."""
    for k in range(n):
        for c in range(3):
            many.contacts.target[k, c] = many.driven.target[k, c]


def _no_work(n, many):
    return 0.0


@if_given("many.resistance", _no_work)
def _work_of_torques(n, many):
    """Work that the driven ends of the n contacts do by torques of rolling and spin friction [J]."""
    total = 0.0
    for k in range(n):
        b = -1 - many.walls.shape[0] - many.contacts.bodies[k, 1]
        if many.resistance.answer[k] > 0.0 and b >= 0 and is_driven(b, many):
            total += qt.dot(row_vector(many.resistance.torque, k, 0), row_vector(many.bodies.twist, b, 3))
    return total


@kernel
def _work(n, many):
    E, total = many.contacts.frame, 0.0
    for k in range(n):
        w = row_vector(many.driven.velocity, k, 0)
        for c in range(3):
            total += many.contacts.impulse[k, c] * qt.dot(row_vector(E, k, 3 * c), w)
    return total + _work_of_torques(n, many)


@if_given("many.driven", _no_work)
def driven_work(n, many):
    """Work that the driven ends of the n contacts do on the other bodies by the present impulses and torques [J]."""
    return _work(n, many)


@if_given("many.driven")
def note_stage_work(n, h, many):
    """Note the work of driven bodies in a stage, with their velocities at present; these are taken in h [s] again."""
    take_later_velocities(n, 0.0, many)
    many.driven.work[0] = _work(n, many)
    take_later_velocities(n, h, many)


@if_given("many.driven")
def report_stage_work(world, report, many):
    """Add the work of the present stage to the world's report."""
    report[world, at.DRIVEN_WORK] += many.driven.work[0]


@if_given("many.driven")
def report_impact_work(n, world, report, many):
    """Add the work of driven bodies in an impact of the n contacts to the world's report."""
    report[world, at.DRIVEN_WORK] += _work(n, many)


@if_given("many.driven")
def extrapolate_reported_work(world, coarse, report, many):
    """Add to the work after two half steps a third of its difference from that of a whole step, in row `coarse`."""
    work = report[world, at.DRIVEN_WORK]
    report[world, at.DRIVEN_WORK] += (work - coarse[at.DRIVEN_WORK]) / 3.0
