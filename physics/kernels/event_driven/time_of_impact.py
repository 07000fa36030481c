"""Fly a body up to its first contact with a wall, whose time is found to rounding and never missed.

Let g be the gap of a feature, with its derivatives g' and g'', and C a bound of its third derivative over the time τ_h.
Then the gap after the time τ <= τ_h is at least

    g + g' τ + (g'' - C τ_h / 3) τ²/2.

The first zero of this parabola comes no later than an impact. So the body flies up to it, and the bound is computed
again, until a wall is reached (conservative advancement, Mirtich 1996, to second order). The bound is exact if the gap
is a parabola. Near a wall the steps converge like Newton's method with the third derivative neglected.

The bound C follows from bounds of the rotation. Let J_max be the largest inverse moment and T the torque. Then
|ω|² <= J_max ω·L, and √(ω·L) grows at most at the rate |T| √J_max. So |ω| <= Ω = √(J_max ω·L) + J_max |T| τ_h over
τ_h. In Euler's equations J_i (I_j - I_k) is between -1 and 1 (triangle inequality of moments of inertia). So the
angular acceleration α has |α| <= A = J_max |T| + Ω² and |dα/dt| <= B = (1 + √2) Ω A + J_max Ω |T|. For a point at the
distance ρ, C = ρ (B + 3 Ω A + Ω³). For a sphere C = 0. The support function of an ellipsoid, s = |D Rᵀ n|, has
derivatives that exceed those of a point at its largest semi-axis by at most the factor 3 κ², with the ratio κ of its
largest semi-axis to its smallest.

In a force field there is no such bound. There the body moves as in contact, by smooth steps with tests of gaps and gap
rates at both ends (`integrate_segment`). If no field acted on its way, the exact flight is used instead.
"""

from __future__ import annotations

import math

from physics.compiler.decorators import inlined, kernel
from physics.kernels.event_driven.contact_forces import free_angular_motion
from physics.kernels.event_driven.extrapolated_midpoint import (
    SEGMENT_SHORTEST_STEP,
    SEGMENT_STEP_CUT,
    get_state_row,
    prepare_extrapolated_step,
    put_state_row,
    try_extrapolated_step,
)
from physics.kernels.event_driven.guards import GUARD_STEP_FAILED
from physics.kernels.event_driven.smooth_segment import integrate_segment
from physics.kernels.event_driven.workspace import ROW_END, ROW_START, Y_SIZE
from physics.kernels.flight.free_flight import fly
from physics.kernels.forces.held_loads import (
    advance_clock,
    has_felt_field,
    has_fields,
    hold_loads,
    refresh_loads,
    reset_felt_flag,
    set_now,
)
from physics.kernels.forces.stiff_flight import subdivide_stiff_flight
from physics.kernels.half_space.contact_point import contact_arm_and_rate, wall_normal
from physics.kernels.half_space.contact_set import is_flight_clear
from physics.kernels.math import quaternion as qt
from physics.kernels.math.vector import as_vector, plus
from physics.kernels.state import layout as at
from physics.kernels.state.body import angular_velocity
from physics.kernels.state.groups import FlightSwitches
from physics.kernels.state.layout import ELLIPSOID, SPHERE, WALL_OFFSET

# Largest number of advances towards one impact; six are usual, more if a body grazes a wall.
_MAX_ADVANCES = 200

# An advance by less than this share of the time left is the last one, since the remaining time is of third order in it.
_LAST_ADVANCE_SHARE = 1.0e-13

# Largest number of doublings of τ_h, the time over which the parabola bounds the gap. It is doubled until the root of
# the parabola comes before its end. With a loose bound of the third derivative the first guess is short.
_MAX_HORIZON_DOUBLINGS = 52

# Largest number of extrapolated steps of one flight, failed ones included.
_MAX_FLIGHT_STEPS = 10_000


@inlined
def parabola_root(g, r, b):
    """First zero τ >= 0 of the parabola g + r τ + b τ²/2, with g >= 0; infinite if there is none."""
    if b == 0.0:
        return g / -r if r < 0.0 else math.inf
    disc = r * r - 2.0 * b * g
    if disc < 0.0:
        return math.inf
    if r < 0.0:
        return 2.0 * g / (math.sqrt(disc) - r)
    if b < 0.0:
        return (r + math.sqrt(disc)) / -b
    return math.inf


@inlined
def gap_safe_time(g, r, b, third, horizon):
    """Time [s], at most `horizon`, within which a gap cannot close.

    The gap is g [m], with the rate r and the second derivative b; `third` bounds its third derivative [m/s³].
    """
    t = min(horizon, parabola_root(g, r, b - third * horizon / 3.0))
    for _ in range(_MAX_HORIZON_DOUBLINGS):
        over = min(horizon, 2.0 * t)
        t = max(t, min(over, parabola_root(g, r, b - third * over / 3.0)))
        if t < over or over == horizon:
            break
    if b > 0.0 and r >= 0.0 and third > 0.0:
        t = max(t, min(horizon, 3.0 * b / third))
    return t


@kernel
def gap_jerk_bound(y, left, offset_frame, body):
    """Upper bound of the third derivative of any feature's gap in a flight of `left` [s] from y [m/s³]."""
    if body.shape == SPHERE:
        return 0.0
    t = math.sqrt(body.torque[0] ** 2 + body.torque[1] ** 2 + body.torque[2] ** 2)
    j = max(body.J[0], body.J[1], body.J[2])
    w = math.sqrt(j * max(0.0, qt.dot(angular_velocity(y[1], y[3], body, offset_frame), y[3]))) + j * left * t
    a = j * t + w * w
    b = (1.0 + math.sqrt(2.0)) * w * a + j * w * t
    bound = body.radius * (b + 3.0 * w * a + w * w * w)
    if body.shape == ELLIPSOID:
        d = body.dims
        ratio = max(d[0], d[1], d[2]) / min(d[0], d[1], d[2])
        bound *= 3.0 * ratio * ratio
    return bound


@kernel
def safe_flight_time(y, left, third, assured, offset_frame, scratch, thresholds):
    """Time of free flight from y, at most `left` [s], within which no feature can reach a wall.

    `third` is the bound of `gap_jerk_bound`. Features that touch and do not approach count as clear for at least
    `assured` [s]: just after a contact has stopped pushing, the acceleration that lifts it is still zero.
    """
    scene, body = scratch.scene, scratch.body
    x, v = y[0], y[2]
    R, _, w, alpha = free_angular_motion(y, offset_frame, body)
    dims, a, shape = as_vector(body.dims), as_vector(body.free_acceleration), body.shape
    t = left
    for k in range(scene.walls.shape[0]):
        n = wall_normal(scene.walls, k)
        d = qt.dot(n, x) - scene.walls[k, WALL_OFFSET]
        vn, an = qt.dot(n, v), qt.dot(n, a)
        if d - body.radius + min(0.0, t * vn) + min(0.0, 0.5 * t * t * an) > 0.0:
            continue
        for feature in range(scene.features):
            r, rate = contact_arm_and_rate(shape, dims, R, w, n, feature, offset_frame, body)
            gap = d + qt.dot(n, r)
            speed = vn + qt.dot(n, qt.cross(w, r))
            bend = an + qt.dot(n, plus(qt.cross(alpha, r), qt.cross(w, rate)))
            least = 0.0
            if gap <= thresholds.touch_gap and speed >= -thresholds.rest_speed:
                gap, speed, least = max(gap, 0.0), max(speed, 0.0), assured
            t = min(t, max(gap_safe_time(max(gap, 0.0), speed, bend, third, t), least))
    return t


@inlined
def has_torque(body):
    """True if a torque acts on the body."""
    t = body.torque
    return t[0] != 0.0 or t[1] != 0.0 or t[2] != 0.0


@kernel
def integrate_free_flight(y, t, offset_frame, scratch, motion):
    """Fly over t [s] from y under a torque or in force fields, by extrapolated steps: (state, time left [s]).

    Time is left if the allowed number of steps was not enough.
    """
    smooth = motion.smooth
    put_state_row(smooth, ROW_START, y)
    left, tries = t, 0
    motion.pace.step_length = left
    while left > 0.0 and tries < _MAX_FLIGHT_STEPS:
        tries += 1
        h = prepare_extrapolated_step(left, offset_frame, scratch, motion)
        error, _ = try_extrapolated_step(h, offset_frame, scratch, motion)
        if not error <= scratch.settings.tolerance and h > SEGMENT_SHORTEST_STEP * t:
            motion.pace.step_length = SEGMENT_STEP_CUT * h
            continue
        for c in range(Y_SIZE):
            smooth.y[ROW_START, c] = smooth.y[ROW_END, c]
        left -= h
        advance_clock(h, scratch.body)
        motion.pace.step_length = 2.0 * h
    return get_state_row(smooth, ROW_START), left


@inlined
def count_unresolved_flight(report, body):
    """Count in the report a flight that extrapolated steps cannot follow; in fields also as unresolved motion."""
    report[body.world, at.UNRESOLVED] += 1.0
    if has_fields(body):
        report[body.world, at.UNRESOLVED_MOTION] += 1.0


@kernel
def fly_freely(y, t, gyroscopic, offset_frame, scratch, motion, report):
    """State after a flight of t [s] from y without contact.

    If extrapolated steps cannot follow a body that turns or swings fast, it moves by time stepping for the rest of t,
    and this is reported.
    """
    body = scratch.body
    if has_torque(body) or has_fields(body):
        reset_felt_flag(body)
        end, left = integrate_free_flight(y, t, offset_frame, scratch, motion)
        if left > 0.0:
            count_unresolved_flight(report, body)
            hold_loads(end, left, gyroscopic, offset_frame, body)
            rest = fly(end, body, left, gyroscopic, offset_frame)
            end = subdivide_stiff_flight(rest, end, left, FlightSwitches(gyroscopic, offset_frame, None), body)
        if has_felt_field(body):
            return end
    return fly(y, body, t, gyroscopic, offset_frame)


@kernel
def fly_to_wall(y, left, gyroscopic, offset_frame, scratch, motion, report):
    """Fly from y for `left` [s], or until a feature reaches a wall: (state, time [s], whether the flight succeeded).

    The flight ends earlier if a feature flies so close along a wall that `_MAX_ADVANCES` advances are not enough. So no
    wall is missed.
    """
    body = scratch.body
    motion.contacts.count = 0
    if has_fields(body):
        now = reset_felt_flag(body)
        end, t, guard = integrate_segment(y, left, offset_frame, scratch, motion)
        if has_felt_field(body):
            return end, t, guard != GUARD_STEP_FAILED
        set_now(now, body)
        refresh_loads(y, 0.0, offset_frame, body)
    if is_flight_clear(y[0], y[2], left, scratch):
        return fly_freely(y, left, gyroscopic, offset_frame, scratch, motion, report), left, True
    third = gap_jerk_bound(y, left, offset_frame, body)
    now, t = y, 0.0
    for _ in range(_MAX_ADVANCES):
        assured = motion.pace.assured_time if t == 0.0 else 0.0
        step = safe_flight_time(now, left - t, third, assured, offset_frame, scratch, motion.thresholds)
        if t + step >= left:
            return fly_freely(y, left, gyroscopic, offset_frame, scratch, motion, report), left, True
        t += step
        now = fly_freely(y, t, gyroscopic, offset_frame, scratch, motion, report)
        if step <= _LAST_ADVANCE_SHARE * left:
            break
    return now, t, True
