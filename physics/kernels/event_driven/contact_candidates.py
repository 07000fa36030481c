"""Touching contacts: candidates for acting, their kinds, and their accelerations."""

from __future__ import annotations

import math

from physics.compiler.decorators import inlined, kernel
from physics.kernels.event_driven.constraint_projection import project_normal_speeds
from physics.kernels.event_driven.extrapolated_midpoint import put_state_row
from physics.kernels.event_driven.guards import compute_feature_gaps
from physics.kernels.event_driven.workspace import ROW_START
from physics.kernels.half_space.contact_point import contact_arm_and_rate, feature_of, wall_normal, wall_of
from physics.kernels.math import quaternion as qt
from physics.kernels.math.vector import as_vector, plus

# What a body does; the last: nothing, since its last step went too far (`mode_acceptance`).
(
    MODE_FLIGHT,
    MODE_IMPACT,
    MODE_CONTACT,
    MODE_REST,
    MODE_INCONSISTENT,
    MODE_UNDECIDED,
    MODE_UNDECIDED_SLIDING,
    MODE_ROLLBACK,
) = range(8)

# What a candidate does.
CANDIDATE_OPEN, CANDIDATE_STICKING, CANDIDATE_SLIDING = range(3)

# Approach of a contact that will leave that is none, in `motion.thresholds.rest_speed`.
_UNSEEN_APPROACH = 1.0e-2


@kernel
def find_candidates(y, offset_frame, scratch, motion):
    """Write features that touch and do not leave into `candidate`; return (count, whether one approaches)."""
    smooth = motion.smooth
    put_state_row(smooth, ROW_START, y)
    compute_feature_gaps(ROW_START, offset_frame, scratch, smooth)
    count = motion.candidates.count = 0
    for s in range(smooth.is_active.shape[0]):
        if smooth.gap[ROW_START, s] <= motion.thresholds.touch_gap and count < motion.contacts.slot.shape[0]:
            rate = smooth.gap_rate[ROW_START, s]
            if rate < -motion.thresholds.rest_speed:
                return 0, True
            if rate <= motion.thresholds.rest_speed:
                motion.candidates.slot[count] = s
                count += 1
    motion.candidates.count = count
    return count, False


@kernel
def activate_candidates(count, motion):
    """Let the candidates act that are not open, with the last forces for shares; mark their slots."""
    contacts, smooth, candidates = motion.contacts, motion.smooth, motion.candidates
    k = 0
    for s in range(smooth.is_active.shape[0]):
        smooth.is_active[s] = 0
    for i in range(count):
        if candidates.state[i] != CANDIDATE_OPEN and k < contacts.slot.shape[0]:
            contacts.slot[k] = candidates.slot[i]
            smooth.is_active[candidates.slot[i]] = 1
            contacts.sticks[k] = 1 if candidates.state[i] == CANDIDATE_STICKING else 0
            for c in range(3):
                contacts.given_force[k, c] = contacts.last_force[candidates.slot[i], c]
                contacts.slip_direction[k, c] = contacts.start_slip_direction[k, c] = candidates.direction[i, c]
            k += 1
    contacts.count = k


@inlined
def has_open_candidate(candidates):
    """True if a candidate does not act."""
    for i in range(candidates.count):
        if candidates.state[i] == CANDIDATE_OPEN:
            return True
    return False


@inlined
def has_normal_speed(motion):
    """True if an acting candidate moves along its normal, or another one approaches, by more than rounding."""
    for i in range(motion.candidates.count):
        rate = motion.smooth.gap_rate[ROW_START, motion.candidates.slot[i]]
        if rate < -motion.thresholds.rounding_speed or (
            rate > motion.thresholds.rounding_speed and motion.candidates.state[i] != CANDIDATE_OPEN
        ):
            return True
    return False


@kernel
def project_candidate_speeds(y, offset_frame, scratch, motion):
    """State without normal velocities of all candidates that neither approach nor leave, acting or not.

    A body may lie on two contacts and rock by less than counts. Setting it down on one contact would otherwise move the
    other, again and again. If acting contacts have no normal speed, a contact that was just released keeps its own.
    """
    smooth, contacts, candidates, thresholds = motion.smooth, motion.contacts, motion.candidates, motion.thresholds
    if not has_open_candidate(candidates):
        return y
    put_state_row(smooth, ROW_START, y)
    compute_feature_gaps(ROW_START, offset_frame, scratch, smooth)
    if not has_normal_speed(motion):
        return y
    contacts.count = 0
    for i in range(candidates.count):
        s = candidates.slot[i]
        gap, rate = smooth.gap[ROW_START, s], smooth.gap_rate[ROW_START, s]
        if gap <= thresholds.touch_gap and abs(rate) <= thresholds.rest_speed:
            contacts.slot[contacts.count], contacts.sticks[contacts.count] = s, 0
            contacts.count += 1
    y = project_normal_speeds(y, offset_frame, scratch, motion)
    activate_candidates(candidates.count, motion)
    return y


@inlined
def contact_acceleration(i, R, w, a, alpha, offset_frame, scratch, candidates):
    """Acceleration of candidate i: (normal part, tangential part)."""
    scene, body = scratch.scene, scratch.body
    wall = wall_of(candidates.slot[i], scene)
    n = wall_normal(scene.walls, wall)
    r, rate = contact_arm_and_rate(
        body.shape, as_vector(body.dims), R, w, n, feature_of(candidates.slot[i], scene), offset_frame, body
    )
    b = plus(plus(a, qt.cross(alpha, r)), qt.cross(w, rate))
    bn = qt.dot(n, b)
    return bn, (b[0] - bn * n[0], b[1] - bn * n[1], b[2] - bn * n[2])


@kernel
def is_candidate_sliding(i, y, R, w, offset_frame, scratch, motion):
    """True if candidate i slides; writes its direction into `candidate_direction`."""
    scene, body = scratch.scene, scratch.body
    candidates = motion.candidates
    wall = wall_of(candidates.slot[i], scene)
    n = wall_normal(scene.walls, wall)
    r, _ = contact_arm_and_rate(
        body.shape, as_vector(body.dims), R, w, n, feature_of(candidates.slot[i], scene), offset_frame, body
    )
    u = plus(y[2], qt.cross(w, r))
    un = qt.dot(n, u)
    t = (u[0] - un * n[0], u[1] - un * n[1], u[2] - un * n[2])
    speed = math.sqrt(qt.dot(t, t))
    for c in range(3):
        candidates.direction[i, c] = 0.0
        if speed > motion.thresholds.slip_stop_speed:
            candidates.direction[i, c] = t[c] / speed
    return speed > motion.thresholds.slip_stop_speed


@inlined
def acceleration_scale(w, body):
    """Size of the accelerations of a body's contacts [m/s²]."""
    return body.acceleration + body.radius * qt.dot(w, w)


@inlined
def has_closing_contact(count, motion):
    """True if a contact that will leave still approaches, by a little."""
    thresholds, candidates = motion.thresholds, motion.candidates
    least = -thresholds.rounding_speed - _UNSEEN_APPROACH * thresholds.rest_speed
    for i in range(count):
        if candidates.state[i] == CANDIDATE_OPEN and motion.smooth.gap_rate[ROW_START, candidates.slot[i]] < least:
            return True
    return False
