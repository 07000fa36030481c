"""Find the direction in which a contact begins to slide, at a speed that is too small to define it.

A contact at the limit of friction begins to slide without a jump: the acceleration grows from zero, and the slip speed
|u| with the square of the time. Its direction follows the loads at the rate K/|u|, where K is the acceleration that
friction gives across the slip for each radian. This rate has no bound as |u| vanishes, so the equation of motion is
stiff. But the direction can be found without the speed. Let φ be the angle of u, d⊥ the unit vector across u, and a(φ)
the acceleration under friction opposite to u. Then

    a(φ)·d⊥ = |u| φ'.

With 0 on the right-hand side this gives the direction that loads and friction do not turn. φ' is the rate at which this
direction turns. The right-hand side is divided by 1 + |u|'/K, since φ lags behind by |u| φ'/K, which grows. The
relative error is of the order (|u|'/K)². A contact *creeps* while its slip is so slow that this direction holds.
"""

from __future__ import annotations

import math

from physics.compiler.decorators import inlined, kernel
from physics.kernels.contact_law.materials import friction_at, friction_of
from physics.kernels.event_driven.contact_forces import apply_inverse_inertia, sliding_force_direction
from physics.kernels.event_driven.workspace import Y_ANGULAR_MOMENTUM, Y_VELOCITY
from physics.kernels.half_space.contact_point import wall_axes, wall_normal, wall_of
from physics.kernels.math import quaternion as qt
from physics.kernels.math.vector import plus, row_vector, times

# Newton's method for the angle: largest number of steps (the angle is known to about 1e-3 before), difference for its
# derivative [rad], tolerance [rad], and largest step [rad]; a larger one leads to another direction.
_ANGLE_NEWTON_STEPS = 6
_ANGLE_DIFFERENCE = 1.0e-5
_ANGLE_TOLERANCE = 1.0e-15
_MAX_ANGLE_STEP = 0.5

# A contact creeps if its slip grows at less than _CREEP_GROWTH of K, and its speed is less than _CREEP_SPEED of K times
# the time in which the body turns or falls. A step in which it begins to slide may exceed both limits by the third
# factor.
_CREEP_GROWTH = 2.0e-3
_CREEP_SPEED = 1.0e-5
_CREEP_OVERSHOOT = 2.0


@inlined
def sliding_velocity(j, scene, contacts):
    """Tangential velocity of the acting contact j, world frame [m/s], and its size."""
    n = wall_normal(scene.walls, wall_of(contacts.slot[j], scene))
    u = row_vector(contacts.velocity, j, 0)
    un = qt.dot(n, u)
    t = (u[0] - un * n[0], u[1] - un * n[1], u[2] - un * n[2])
    return t, math.sqrt(qt.dot(t, t))


@inlined
def contact_velocity_rate(j, P, body, motion):
    """Acceleration of the acting contact j at the start of the step, world frame [m/s²].

    It is that without contact, in `constraint_error`, plus that by contact forces, from `first_rate`. P is the matrix
    of the principal axes.
    """
    rate, a, torque = motion.smooth.first_rate, body.free_acceleration, body.torque
    T = (
        rate[Y_ANGULAR_MOMENTUM] - torque[0],
        rate[Y_ANGULAR_MOMENTUM + 1] - torque[1],
        rate[Y_ANGULAR_MOMENTUM + 2] - torque[2],
    )
    F = (rate[Y_VELOCITY] - a[0], rate[Y_VELOCITY + 1] - a[1], rate[Y_VELOCITY + 2] - a[2])
    return plus(
        plus(
            row_vector(motion.contacts.constraint_error, j, 0),
            qt.cross(apply_inverse_inertia(P, body.J, T), row_vector(motion.contacts.arm, j, 0)),
        ),
        F,
    )


@inlined
def friction_turn_stiffness(P, scratch, motion):
    """Turning stiffness K of the only acting contact, from `first_rate`: acceleration across per radian [m/s²]."""
    body, wall = scratch.body, wall_of(motion.contacts.slot[0], scratch.scene)
    n = wall_normal(scratch.scene.walls, wall)
    across = qt.cross(n, row_vector(motion.contacts.start_slip_direction, 0, 0))
    moment = qt.cross(row_vector(motion.contacts.arm, 0, 0), across)
    a, rate = body.free_acceleration, motion.smooth.first_rate
    push = body.mass * (
        n[0] * (rate[Y_VELOCITY] - a[0]) + n[1] * (rate[Y_VELOCITY + 1] - a[1]) + n[2] * (rate[Y_VELOCITY + 2] - a[2])
    )
    return friction_at(wall, body) * push * (1.0 / body.mass + qt.dot(moment, apply_inverse_inertia(P, body.J, moment)))


@inlined
def has_one_sliding_contact(scratch, contacts):
    """True if exactly one contact acts, and it slides with friction."""
    return contacts.count == 1 and contacts.sticks[0] == 0 and friction_of(contacts.slot[0], scratch) > 0.0


@inlined
def _is_small(share, speed, body, motion):
    """True if the slip speed [m/s] of the only contact is below `share` times the limit of creeping (_CREEP_SPEED)."""
    return (
        speed * (motion.smooth.start_angular_speed + math.sqrt(body.acceleration / body.radius))
        < share * _CREEP_SPEED * motion.contacts.friction_turn_stiffness
    )


@inlined
def is_creeping(growth, speed, body, motion):
    """True if the only contact creeps: it begins to slide so slowly that loads alone determine its direction.

    Its slip `speed` [m/s] and the `growth` of this speed [m/s²] must be below their limits.
    """
    return growth < _CREEP_GROWTH * motion.contacts.friction_turn_stiffness and _is_small(1.0, speed, body, motion)


@inlined
def has_outrun_creep(h, scratch, motion):
    """True if the only contact begins to slide in a step of h [s], but is too fast at its end to creep (`is_creeping`).

    `set_contact_kinematics` must have been called for the end of the step.
    """
    contacts = motion.contacts
    if not has_one_sliding_contact(scratch, contacts) or not contacts.is_starting[0]:
        return False
    _, speed = sliding_velocity(0, scratch.scene, contacts)
    if not speed > _CREEP_OVERSHOOT * motion.thresholds.slip_stop_speed:
        return False
    if not _is_small(_CREEP_OVERSHOOT * _CREEP_OVERSHOOT, speed, scratch.body, motion):
        return True
    limit = _CREEP_GROWTH * contacts.friction_turn_stiffness
    return contacts.slip_growth < limit and speed - contacts.start_slip_speed > _CREEP_OVERSHOOT * limit * h


@inlined
def _slip_accelerations(angle, first, second, axes, P, scratch, contacts):
    """Accelerations of contact 0 across and along a sliding direction d, under the friction opposite to d [m/s²].

    d is at the `angle` from the unit vector `first` towards `second`; it is written to `slip_direction`.
    """
    body, c, s = scratch.body, math.cos(angle), math.sin(angle)
    d = plus(times(c, first), times(s, second))
    for k in range(3):
        contacts.slip_direction[0, k] = d[k]
    n, r, b = axes[0], row_vector(contacts.arm, 0, 0), row_vector(contacts.constraint_error, 0, 0)
    f = sliding_force_direction(friction_of(contacts.slot[0], scratch), axes, 0, body, contacts)
    a = plus(times(1.0 / body.mass, f), qt.cross(apply_inverse_inertia(P, body.J, qt.cross(r, f)), r))
    a = plus(b, times(-qt.dot(n, b) / qt.dot(n, a), a))
    return c * qt.dot(second, a) - s * qt.dot(first, a), qt.dot(d, a)


@kernel
def set_slip_onset_direction(P, scratch, contacts):
    """Set `slip_direction` of the only acting contact, if it begins to slide, to the direction of the module docstring.

    Several contacts begin to slide in the directions that the search of the contact mode has found.
    """
    if not has_one_sliding_contact(scratch, contacts) or not contacts.is_starting[0]:
        return
    axes = wall_axes(scratch.scene.walls, wall_of(contacts.slot[0], scratch.scene))
    n, u, first = axes[0], row_vector(contacts.velocity, 0, 0), row_vector(contacts.start_slip_direction, 0, 0)
    second, speed = qt.cross(n, first), math.sqrt(max(0.0, qt.dot(u, u) - qt.dot(n, u) * qt.dot(n, u)))
    angle = 0.0
    for _ in range(_ANGLE_NEWTON_STEPS):
        across, along = _slip_accelerations(angle, first, second, axes, P, scratch, contacts)
        nudged, _ = _slip_accelerations(angle + _ANGLE_DIFFERENCE, first, second, axes, P, scratch, contacts)
        stiffness = (across - nudged) / _ANGLE_DIFFERENCE
        if not stiffness > 0.0:
            angle = 0.0
            break
        step = (across - speed * contacts.slip_turn_rate / (1.0 + along / stiffness)) / stiffness
        if not abs(step) < _MAX_ANGLE_STEP:
            angle = 0.0
            break
        angle += step
        if abs(step) <= _ANGLE_TOLERANCE:
            break
    _slip_accelerations(angle, first, second, axes, P, scratch, contacts)
