"""Integrate the smooth motion of a contact mode up to the event at which a guard ends it, and locate that event.

States are rows of `motion.smooth.y`: ROW_START at the start of a step, ROW_END at its end.
"""

from __future__ import annotations

import math

from physics.compiler.decorators import inlined, kernel
from physics.kernels.event_driven.constraint_projection import project_state
from physics.kernels.event_driven.contact_candidates import project_candidate_speeds
from physics.kernels.event_driven.contact_forces import free_angular_motion, store_last_forces
from physics.kernels.event_driven.extrapolated_midpoint import (
    SEGMENT_EASY_RULES,
    SEGMENT_SHORTEST_STEP,
    SEGMENT_STEP_CUT,
    SEGMENT_STEP_GROWTH,
    compute_state_rate,
    get_state_row,
    prepare_extrapolated_step,
    put_state_row,
    try_extrapolated_step,
)
from physics.kernels.event_driven.force_minima import find_force_minimum, store_force_margins
from physics.kernels.event_driven.guards import (
    FORCE_GUARDS,
    FORCE_MARGIN_TOLERANCE,
    GUARD_GAP,
    GUARD_NONE,
    GUARD_SPEED,
    GUARD_STEP_FAILED,
    GUARD_WATCH,
    compute_feature_gaps,
    least_guard_margin,
    least_start_force_margin,
)
from physics.kernels.event_driven.implicit_extrapolation import note_stiffness, try_smooth_step
from physics.kernels.event_driven.mode_acceptance import has_trusted_guards
from physics.kernels.event_driven.slip_onset import contact_velocity_rate, has_outrun_creep, sliding_velocity
from physics.kernels.event_driven.workspace import ROW_END, ROW_START, Y_SIZE
from physics.kernels.forces.held_loads import advance_clock, refresh_loads
from physics.kernels.math import quaternion as qt
from physics.kernels.math.vector import row_vector
from physics.kernels.state.body import angular_velocity

# Largest number of smooth steps of one contact mode.
_MAX_SEGMENT_STEPS = 10_000

# Location of an event: largest number of trials; trials after which the interval is bisected, if they have not halved
# it; and margins that count as zero, of a gap and of other guards.
_MAX_LOCATION_TRIALS = 110
_BISECT_AFTER = 3
_ZERO_MARGINS = (1.0e-15, 1.0e-13)

# A body may be at rest if the projection onto its contacts reduces its speed to this share of `rest_speed`.
_REST_SPEED_SHARE = 1.0e-6


@inlined
def newton_time_to_gap(t, margin, guard, which, body, smooth):
    """Time after the start of the step at which a gap closes, by a Newton step from the end of the step at t [s].

    `margin` is the negative gap margin of slot `which` there. Returns -1 if `guard` is no gap, or the gap grows.
    """
    if guard != GUARD_GAP or not smooth.gap_rate[ROW_END, which] < 0.0:
        return -1.0
    return t - margin * body.radius / smooth.gap_rate[ROW_END, which]


@kernel
def locate_event(h, margin, guard, which, heeds, offset_frame, scratch, motion):
    """Shorten a step of h [s] to the event at which a guard's margin becomes zero: (length, guard, contact or slot).

    `margin` < 0 is the smallest margin at the end of the step, of `guard` and `which`; `heeds` is true if force guards
    count. ROW_END becomes the state at the event.

    The zero of a gap is found by Newton steps, other zeros by false position with the Illinois rule. The interval is
    bisected if `_BISECT_AFTER` trials have not halved it. The guard is GUARD_STEP_FAILED if a shorter step fails,
    although the motion should be smooth. Then the margin changes its sign at a pole (Painlevé's paradox) within the
    step. A force margin that is positive at the start ends the step at its zero; otherwise it does so below zero by
    more than rounding.
    """
    low, high, low_margin, high_margin = 0.0, h, -margin, margin
    slack = FORCE_MARGIN_TOLERANCE
    if guard in FORCE_GUARDS:
        least = least_start_force_margin(offset_frame, scratch, motion)
        if least > FORCE_MARGIN_TOLERANCE:
            slack, low_margin, high_margin = 0.0, least, margin - FORCE_MARGIN_TOLERANCE
    side, width, stale = 0, h, 0
    newton = newton_time_to_gap(h, margin, guard, which, scratch.body, motion.smooth)
    for _ in range(_MAX_LOCATION_TRIALS):
        t = newton
        if not low < t < high:
            t = low + (high - low) * low_margin / (low_margin - high_margin)
            if stale >= _BISECT_AFTER or not low < t < high:
                t = 0.5 * (low + high)
        error, _ = try_smooth_step(t, offset_frame, scratch, motion)
        if not error <= scratch.settings.tolerance:
            return t, GUARD_STEP_FAILED, which
        margin, g, w = least_guard_margin(t, heeds, slack, offset_frame, scratch, motion)
        newton = -1.0
        if margin < 0.0:
            high, high_margin, guard, which = t, margin, g, w
            newton = newton_time_to_gap(t, margin, g, w, scratch.body, motion.smooth)
            if side == 1:
                low_margin *= 0.5
            side = 1
        else:
            low, low_margin = t, margin
            if g == GUARD_GAP and margin <= _ZERO_MARGINS[0]:
                return t, g, w
            if side == -1:
                high_margin *= 0.5
            side = -1
        stale += 1
        if high - low <= 0.5 * width:
            width, stale = high - low, 0
        if high - low <= 1.0e-15 * h or (
            margin < 0.0 and margin > -(_ZERO_MARGINS[0] if g == GUARD_GAP else _ZERO_MARGINS[1])
        ):
            break
    if margin >= 0.0:
        try_smooth_step(high, offset_frame, scratch, motion)
        _, guard, which = least_guard_margin(high, heeds, slack, offset_frame, scratch, motion)
    return high, guard, which


@inlined
def has_slip_stopped(guard, which, scene, motion):
    """True if the speed guard of contact `which` ended a step, and the contact nearly stands still at its end.

    Then the sliding ends there, and no event within the step is searched.
    """
    if guard != GUARD_SPEED:
        return False
    return sliding_velocity(which, scene, motion.contacts)[1] <= motion.thresholds.slip_stop_speed


@kernel
def slide_to_stop(which, left, heeds, offset_frame, scratch, motion):
    """Make a last short step, in which contact `which`, slower than the limit, slides until it stops: its length [s].

    The direction of sliding stays the same. Returns 0, without a step, if another event would come first, or if the
    contact has only begun to slide. `left` is the time left [s]; `heeds` is true if force guards count.
    """
    body = scratch.body
    contacts, smooth, thresholds = motion.contacts, motion.smooth, motion.thresholds
    if contacts.is_starting[which]:
        return 0.0
    slip, speed = sliding_velocity(which, scratch.scene, contacts)
    if not thresholds.rounding_speed < speed <= 2.0 * thresholds.slip_stop_speed:
        return 0.0
    before = get_state_row(smooth, ROW_START)
    end = get_state_row(smooth, ROW_END)
    for c in range(3):
        contacts.start_slip_direction[which, c] = slip[c] / speed
    put_state_row(smooth, ROW_START, end)
    compute_state_rate(ROW_START, 0.0, offset_frame, scratch, motion)
    for c in range(Y_SIZE):
        smooth.first_rate[c] = smooth.rate[c]
    _, P, _, _ = free_angular_motion(end, offset_frame, body)
    along = qt.dot(contact_velocity_rate(which, P, body, motion), row_vector(contacts.start_slip_direction, which, 0))
    if along < 0.0:
        h = min(left, -speed / along)
        error, _ = try_smooth_step(h, offset_frame, scratch, motion)
        margin, guard, _ = least_guard_margin(h, heeds, FORCE_MARGIN_TOLERANCE, offset_frame, scratch, motion)
        if error <= scratch.settings.tolerance and (margin >= 0.0 or guard == GUARD_SPEED):
            advance_clock(h, body)
            return h
    put_state_row(smooth, ROW_START, before)
    put_state_row(smooth, ROW_END, end)
    least_guard_margin(
        0.0, heeds, FORCE_MARGIN_TOLERANCE, offset_frame, scratch, motion
    )  # sets forces and gaps to those of ROW_END again
    return 0.0


@inlined
def body_speed_bound(y, offset_frame, body):
    """Upper bound of the speed of any point of a body in the state y [m/s]."""
    v, w = y[2], angular_velocity(y[1], y[3], body, offset_frame)
    return math.sqrt(qt.dot(v, v)) + body.radius * math.sqrt(qt.dot(w, w))


@inlined
def _begin_next_step(left, offset_frame, scratch, motion):
    """Prepare the next step, which begins at the end of the last one; return its length, at most `left` [s]."""
    smooth = motion.smooth
    for s in range(smooth.is_active.shape[0]):
        gap, rate = smooth.gap[ROW_END, s], smooth.gap_rate[ROW_END, s]
        smooth.gap[ROW_START, s], smooth.gap_rate[ROW_START, s] = gap, rate
    h = prepare_extrapolated_step(left, offset_frame, scratch, motion)
    store_force_margins(ROW_START, scratch, motion)
    if motion.pace.is_stiff == 1:
        note_stiffness(h, offset_frame, scratch, motion)
    return h


@kernel
def integrate_segment(y, left, offset_frame, scratch, motion):
    """Integrate the smooth motion of the contact mode from y for `left` [s], or until a guard ends it.

    Returns (state, time [s], GUARD_ code); the code is GUARD_NONE if no guard ended the motion. If the force guards of
    the mode are ignored (`mode_acceptance`), only one step is made, at most `watched_length` long. It ends with
    GUARD_WATCH if no other guard ends it.
    """
    body = scratch.body
    smooth, pace, thresholds = motion.smooth, motion.pace, motion.thresholds
    heeds = has_trusted_guards(motion)
    had, still = body_speed_bound(y, offset_frame, body), thresholds.rest_speed
    y = project_state(project_candidate_speeds(y, offset_frame, scratch, motion), offset_frame, scratch, motion)
    if had > still and body_speed_bound(y, offset_frame, body) <= _REST_SPEED_SHARE * still:
        return y, 0.0, GUARD_SPEED  # the projection has removed all of the speed: the body may be at rest
    put_state_row(smooth, ROW_START, y)
    compute_feature_gaps(ROW_START, offset_frame, scratch, smooth)
    pace.step_length, pace.is_stiff = left if heeds else pace.watched_length, 0
    t, h = 0.0, prepare_extrapolated_step(left, offset_frame, scratch, motion)
    store_force_margins(ROW_START, scratch, motion)
    for _ in range(_MAX_SEGMENT_STEPS):
        error, used = try_smooth_step(h, offset_frame, scratch, motion)
        is_over, guard = False, GUARD_STEP_FAILED
        if error <= scratch.settings.tolerance:
            margin, guard, which = least_guard_margin(h, heeds, FORCE_MARGIN_TOLERANCE, offset_frame, scratch, motion)
            is_over = margin < 0.0
            if has_outrun_creep(h, scratch, motion):
                guard = GUARD_STEP_FAILED
            elif is_over and not has_slip_stopped(guard, which, scratch.scene, motion):
                h, guard, which = locate_event(h, margin, guard, which, heeds, offset_frame, scratch, motion)
        if guard != GUARD_STEP_FAILED and heeds:
            dip = find_force_minimum(h, used, offset_frame, scratch, motion)
            if dip < h:
                h = dip
                refresh_loads(get_state_row(smooth, ROW_START), 0.0, offset_frame, body)
                continue
        if guard == GUARD_STEP_FAILED:
            refresh_loads(get_state_row(smooth, ROW_START), 0.0, offset_frame, body)
            if (
                pace.is_stiff == 0
                and error > scratch.settings.tolerance
                and note_stiffness(h, offset_frame, scratch, motion)
            ):
                continue
            if not h > SEGMENT_SHORTEST_STEP * left:
                return get_state_row(smooth, ROW_START), t, GUARD_STEP_FAILED
            # `prepare_extrapolated_step` is not called again: it would use the slip directions at the end of the failed
            # step. The scale of the errors is still that of the start.
            h *= SEGMENT_STEP_CUT
            continue
        t += h
        advance_clock(h, body)
        if is_over and guard == GUARD_SPEED:
            t += slide_to_stop(which, left - t, heeds, offset_frame, scratch, motion)
        pace.step_length = SEGMENT_STEP_GROWTH * h if used <= SEGMENT_EASY_RULES else h
        store_last_forces(scratch.scene, motion.contacts)
        y = project_state(get_state_row(smooth, ROW_END), offset_frame, scratch, motion)
        if is_over:
            return y, t, guard
        if not heeds:
            for c in range(Y_SIZE):
                pace.end_rate[c] = smooth.rate[c]
            return y, t, GUARD_WATCH
        put_state_row(smooth, ROW_START, y)
        if not t < left:
            break
        h = _begin_next_step(left - t, offset_frame, scratch, motion)
    if t < left:
        return get_state_row(smooth, ROW_START), t, GUARD_STEP_FAILED
    return y, left, GUARD_NONE


@kernel
def predict_state(y, offset_frame, scratch, motion):
    """Predict the state after a look-ahead of smooth motion from y in the present contact mode."""
    pace = motion.pace
    put_state_row(motion.smooth, ROW_START, y)
    pace.step_length = pace.look_ahead
    prepare_extrapolated_step(pace.look_ahead, offset_frame, scratch, motion)
    try_extrapolated_step(pace.look_ahead, offset_frame, scratch, motion)
    return project_state(get_state_row(motion.smooth, ROW_END), offset_frame, scratch, motion)
