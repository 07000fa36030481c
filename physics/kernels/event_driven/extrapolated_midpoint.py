"""Make one step of smooth motion in a contact mode by the extrapolated midpoint rule, of order up to 16.

A step of length h is made by Gragg's midpoint rule with 2, 4, 6, ... parts. The error of the rule is a series in the
square of the parts' length, so each further number of parts raises the order by two (Bulirsch and Stoer). The step is
done when two successive orders agree to the tolerance. If order 16 is not enough, the step is made shorter. Constant
forces need two rules.

States are rows of `motion.smooth.y`: ROW_START at the start of the step, ROW_END at its end.

Hairer, Nørsett and Wanner, *Solving Ordinary Differential Equations I*, II.9, for the rule, its smoothing step and
the table.
"""

from __future__ import annotations

import math

from physics.compiler.decorators import inlined, kernel
from physics.kernels.contact_law.materials import friction_of
from physics.kernels.event_driven.contact_forces import free_angular_motion, set_contact_kinematics
from physics.kernels.event_driven.force_system import solve_mode_forces
from physics.kernels.event_driven.slip_onset import (
    contact_velocity_rate,
    friction_turn_stiffness,
    has_one_sliding_contact,
    is_creeping,
    sliding_velocity,
)
from physics.kernels.event_driven.workspace import (
    MAX_MIDPOINT_RULES,
    ROW_CURRENT,
    ROW_END,
    ROW_PREVIOUS,
    ROW_START,
    Y_ANGULAR_MOMENTUM,
    Y_POSITION,
    Y_QUATERNION,
    Y_SIZE,
    Y_VELOCITY,
)
from physics.kernels.forces.held_loads import has_fields, refresh_loads
from physics.kernels.half_space.contact_point import wall_normal, wall_of
from physics.kernels.math import quaternion as qt
from physics.kernels.math.vector import row_vector
from physics.kernels.state.layout import SPHERE

# A step is cut to this share if the extrapolation does not converge; the shortest step is the second share of the time
# requested.
SEGMENT_STEP_CUT = 0.25
SEGMENT_SHORTEST_STEP = 1.0e-12

# The next step is this many times as long if at most so many rules were needed.
SEGMENT_STEP_GROWTH = 4.0
SEGMENT_EASY_RULES = 4

# The direction of sliding turns if the acceleration a differs from it by more than _BENT_SHARE of |a|. Then a step is
# at most _BENT_STEP |u|/|a| long. Sliding that is nearly straight still turns just before it stops, unless it differs
# by less than _STRAIGHT_SHARE. So a step ends at _SHORT_OF_STOP of the time of the stop.
_BENT_SHARE = 1.0e-4
_BENT_STEP = 0.5
_STRAIGHT_SHARE = 1.0e-14
_SHORT_OF_STOP = 0.75

# The direction of a slip u follows the loads within the time |u|/K, with the acceleration K that friction gives across
# it for each radian. No step is longer than this many such times: a longer one is unstable, and the error of the speed
# would not show it.
_STIFF_STEP = 1.5

# In contact an extrapolation goes on to this share of the tolerance, but not below _FINEST_TOLERANCE, rounding. The
# time at which a force or a slip vanishes may have an error many times as large as that of the state.
_CONTACT_TOLERANCE_SHARE = 1.0e-2
_FINEST_TOLERANCE = 1.0e-13

# From this rule on an extrapolation is given up if it will not converge: if its error, falling from rule to rule twice
# as fast as it did last, would still be too large at the last rule.
_FIRST_CONVERGENCE_CHECK = 3

# Largest turn of a body with corners in a step [rad]. With it the gaps and their rates at both ends of the step show
# whether a corner dipped into a wall in between.
_MAX_STEP_ROTATION = 0.25


@inlined
def get_state_row(smooth, row):
    """Read the state (x, q, v, L) from a row of `smooth.y`."""
    y = smooth.y
    return (
        (y[row, Y_POSITION], y[row, Y_POSITION + 1], y[row, Y_POSITION + 2]),
        (y[row, Y_QUATERNION], y[row, Y_QUATERNION + 1], y[row, Y_QUATERNION + 2], y[row, Y_QUATERNION + 3]),
        (y[row, Y_VELOCITY], y[row, Y_VELOCITY + 1], y[row, Y_VELOCITY + 2]),
        (y[row, Y_ANGULAR_MOMENTUM], y[row, Y_ANGULAR_MOMENTUM + 1], y[row, Y_ANGULAR_MOMENTUM + 2]),
    )


@inlined
def put_state_row(smooth, row, state):
    """Write `state` = (x, q, v, L) to a row of `smooth.y`."""
    x, q, v, m = state
    y = smooth.y
    y[row, Y_POSITION], y[row, Y_POSITION + 1], y[row, Y_POSITION + 2] = x
    y[row, Y_QUATERNION], y[row, Y_QUATERNION + 1], y[row, Y_QUATERNION + 2], y[row, Y_QUATERNION + 3] = q
    y[row, Y_VELOCITY], y[row, Y_VELOCITY + 1], y[row, Y_VELOCITY + 2] = v
    y[row, Y_ANGULAR_MOMENTUM], y[row, Y_ANGULAR_MOMENTUM + 1], y[row, Y_ANGULAR_MOMENTUM + 2] = m


@kernel
def compute_state_rate(row, later, offset_frame, scratch, motion):
    """Compute the rate of change of the state in a row of `smooth.y`, and write it to `smooth.rate`.

    The state is that of a time `later` [s] than the start of the step. The contact forces are left in
    `motion.unknowns`.
    """
    body = scratch.body
    state = get_state_row(motion.smooth, row)
    refresh_loads(state, later, offset_frame, body)
    q, v = state[1], state[2]
    F, T, w, _, _ = solve_mode_forces(state, offset_frame, scratch, motion)
    inv_mass = 1.0 / body.mass
    turn = qt.multiply((0.0, w[0], w[1], w[2]), q)
    rate = motion.smooth.rate
    for c in range(3):
        rate[Y_POSITION + c] = v[c]
        rate[Y_VELOCITY + c] = body.free_acceleration[c] + inv_mass * F[c]
        rate[Y_ANGULAR_MOMENTUM + c] = body.torque[c] + T[c]
    rate[Y_QUATERNION], rate[Y_QUATERNION + 1], rate[Y_QUATERNION + 2], rate[Y_QUATERNION + 3] = (
        0.5 * turn[0],
        0.5 * turn[1],
        0.5 * turn[2],
        0.5 * turn[3],
    )


@kernel
def set_error_scale(h, body, smooth):
    """Set `smooth.scale`, the units in which the errors of a step of length h are measured.

    `prepare_extrapolated_step` must have prepared the start of the step.
    """
    x, _, v, _ = get_state_row(smooth, ROW_START)
    speed = math.sqrt(qt.dot(v, v)) + body.radius * smooth.start_angular_speed + body.acceleration * h
    place_size = body.radius + max(abs(x[0]), max(abs(x[1]), abs(x[2])))
    for c in range(3):
        smooth.scale[Y_POSITION + c] = place_size
        smooth.scale[Y_VELOCITY + c] = speed
        smooth.scale[Y_ANGULAR_MOMENTUM + c] = speed * body.mass * body.radius
    for c in range(4):
        smooth.scale[Y_QUATERNION + c] = 1.0


@kernel
def _midpoint_rule(parts, h, offset_frame, scratch, motion):
    """Make one midpoint rule with `parts` parts over h [s], from ROW_START into ROW_END of `smooth.y`, smoothed."""
    y, rate = motion.smooth.y, motion.smooth.rate
    s = h / parts
    for c in range(Y_SIZE):
        y[ROW_PREVIOUS, c] = y[ROW_START, c]
        y[ROW_CURRENT, c] = y[ROW_START, c] + s * motion.smooth.first_rate[c]
    for k in range(1, parts):
        compute_state_rate(ROW_CURRENT, k * s, offset_frame, scratch, motion)
        for c in range(Y_SIZE):
            old = y[ROW_PREVIOUS, c]
            y[ROW_PREVIOUS, c] = y[ROW_CURRENT, c]
            y[ROW_CURRENT, c] = old + 2.0 * s * rate[c]
    compute_state_rate(ROW_CURRENT, h, offset_frame, scratch, motion)
    for c in range(Y_SIZE):
        y[ROW_END, c] = 0.5 * (y[ROW_CURRENT, c] + y[ROW_PREVIOUS, c] + s * rate[c])


@inlined
def extrapolation_aim(goal, contacts):
    """Error to which an extrapolation goes on, for the largest error `goal` of a step."""
    return max(_CONTACT_TOLERANCE_SHARE * goal, min(goal, _FINEST_TOLERANCE)) if contacts.count > 0 else goal


@kernel
def try_extrapolated_step(h, offset_frame, scratch, motion):
    """Make a step of length h [s] from ROW_START to ROW_END of `smooth.y`: (relative error, midpoint rules used).

    `prepare_extrapolated_step` must have prepared the start. The step fails if the error is above the tolerance.
    """
    smooth = motion.smooth
    table, y = smooth.extrapolation_table, smooth.y
    goal = scratch.settings.tolerance
    aim = extrapolation_aim(goal, motion.contacts)
    set_error_scale(h, scratch.body, smooth)
    error = math.inf
    used = MAX_MIDPOINT_RULES
    for k in range(MAX_MIDPOINT_RULES):
        _midpoint_rule(2 * (k + 1), h, offset_frame, scratch, motion)
        before = error
        error = total = 0.0
        for c in range(Y_SIZE):
            new, change = y[ROW_END, c], math.inf
            for j in range(1, k + 1):
                ratio = (k + 1.0) / (k + 1.0 - j)
                old = table[j - 1, c]
                change = (new - old) / (ratio * ratio - 1.0)
                table[j - 1, c] = new
                new += change
            table[k, c] = new
            y[ROW_END, c] = new
            total += new
            if smooth.scale[c] > 0.0:
                error = max(error, abs(change) / smooth.scale[c])
        if not math.isfinite(total):
            return math.inf, MAX_MIDPOINT_RULES
        if error <= aim:
            used = k + 1
            break
        if k >= _FIRST_CONVERGENCE_CHECK and error * (error / before) ** (2 * (MAX_MIDPOINT_RULES - 1 - k)) > (
            aim if error <= goal else goal
        ):
            break
    x, q, v, m = get_state_row(smooth, ROW_END)
    put_state_row(smooth, ROW_END, (x, qt.normalise(q), v, m))
    return error, used


@kernel
def prepare_extrapolated_step(left, offset_frame, scratch, motion):
    """Prepare a step from ROW_START of `smooth.y` for `try_extrapolated_step`; return the longest useful step [s].

    The step is limited by the time `left`, by the length that the last step's errors suggest, by a turn of
    `_MAX_STEP_ROTATION`, and by the time at which a contact with its present deceleration stops sliding. In flight
    through a force field it is also limited by the time in which the body moves by its radius, so that no wall is
    reached and left again unseen.
    """
    body = scratch.body
    contacts = motion.contacts
    state = get_state_row(motion.smooth, ROW_START)
    R, P, w, alpha = free_angular_motion(state, offset_frame, body)
    for j in range(contacts.count):
        for c in range(3):
            contacts.start_slip_direction[j, c] = contacts.slip_direction[j, c]
    set_contact_kinematics(state, R, w, alpha, offset_frame, scratch, motion)
    for j in range(contacts.count):
        t, speed = sliding_velocity(j, scratch.scene, contacts)
        contacts.is_starting[j] = 1 if speed <= motion.thresholds.slip_stop_speed else 0
        if speed > motion.thresholds.slip_stop_speed:
            for c in range(3):
                contacts.start_slip_direction[j, c] = t[c] / speed
    contacts.slip_turn_rate = contacts.friction_turn_stiffness = 0.0
    _set_first_rate(offset_frame, scratch, motion)
    turn = motion.smooth.start_angular_speed = math.sqrt(qt.dot(w, w))
    if has_one_sliding_contact(scratch, contacts):
        _begin_slide(P, offset_frame, scratch, motion)
    motion.smooth.weight = body.mass * (body.acceleration + body.radius * turn * turn)
    h = min(left, motion.pace.step_length)
    if body.shape != SPHERE and h * turn > _MAX_STEP_ROTATION:
        h = _MAX_STEP_ROTATION / turn
    if contacts.count == 0 and has_fields(body):
        h = min(h, body.radius / (math.sqrt(qt.dot(state[2], state[2])) + math.sqrt(body.radius * body.acceleration)))
    return _limit_to_slip_stop(h, P, scratch, motion)


@inlined
def _set_first_rate(offset_frame, scratch, motion):
    """Set `smooth.first_rate`, the rate of change of the state at the start of the step."""
    compute_state_rate(ROW_START, 0.0, offset_frame, scratch, motion)
    for c in range(Y_SIZE):
        motion.smooth.first_rate[c] = motion.smooth.rate[c]


@kernel
def _begin_slide(P, offset_frame, scratch, motion):
    """Prepare a step with a single contact, which slides; P is the matrix of the principal axes.

    If the contact begins to slide, or is still as slow (`is_creeping`), its direction is that of `slip_onset`, and the
    turning rate of this direction is set.
    """
    contacts = motion.contacts
    contacts.friction_turn_stiffness = friction_turn_stiffness(P, scratch, motion)
    _, contacts.start_slip_speed = sliding_velocity(0, scratch.scene, contacts)
    contacts.slip_growth = qt.dot(
        contact_velocity_rate(0, P, scratch.body, motion), row_vector(contacts.start_slip_direction, 0, 0)
    )
    if contacts.slip_growth >= 0.0 and is_creeping(
        contacts.slip_growth, contacts.start_slip_speed, scratch.body, motion
    ):
        contacts.is_starting[0] = 1
        _set_first_rate(offset_frame, scratch, motion)
    if contacts.is_starting[0]:
        _set_slip_turn_rate(offset_frame, scratch, motion)
        _set_first_rate(offset_frame, scratch, motion)


@inlined
def _set_slip_turn_rate(offset_frame, scratch, motion):
    """Set `slip_turn_rate`, the rate at which the slip direction of the only contact turns [rad/s].

    It is computed from the slip direction at a state shortly after the start of the step.
    """
    contacts, pace, smooth = motion.contacts, motion.pace, motion.smooth
    d = row_vector(contacts.slip_direction, 0, 0)
    for c in range(Y_SIZE):
        smooth.y[ROW_CURRENT, c] = smooth.y[ROW_START, c] + pace.min_look_ahead * smooth.first_rate[c]
    compute_state_rate(ROW_CURRENT, pace.min_look_ahead, offset_frame, scratch, motion)
    n = wall_normal(scratch.scene.walls, wall_of(contacts.slot[0], scratch.scene))
    contacts.slip_turn_rate = qt.dot(qt.cross(n, d), row_vector(contacts.slip_direction, 0, 0)) / pace.min_look_ahead


@inlined
def _limit_to_slip_stop(h, P, scratch, motion):
    """Shorten a step of length h [s], so that sliding does not stop or turn far within it; return its length.

    The step ends at the latest when a contact stops sliding at the deceleration of its start. Where the direction of
    sliding turns, the step is a share of |u|/|a|: the direction of a velocity u + a t is analytic up to this time
    (where it vanishes at a complex t), and a much longer step has no high order. P is the matrix of the principal axes.
    """
    contacts = motion.contacts
    for j in range(contacts.count):
        if contacts.sticks[j] or contacts.is_starting[j] or not friction_of(contacts.slot[j], scratch) > 0.0:
            continue
        d = row_vector(contacts.start_slip_direction, j, 0)
        _, speed = sliding_velocity(j, scratch.scene, contacts)
        change = contact_velocity_rate(j, P, scratch.body, motion)
        along, size = qt.dot(d, change), math.sqrt(qt.dot(change, change))
        bend = size - abs(along)
        if along < 0.0 and -along * h > speed:
            h = -speed / along
            if bend > _STRAIGHT_SHARE * size:
                h *= _SHORT_OF_STOP
        if bend > _BENT_SHARE * size:
            h = min(h, _BENT_STEP * speed / size)
        if bend > _STRAIGHT_SHARE * size and contacts.friction_turn_stiffness > 0.0:  # 0 for several contacts
            h = min(h, _STIFF_STEP * speed / contacts.friction_turn_stiffness)
    return h
