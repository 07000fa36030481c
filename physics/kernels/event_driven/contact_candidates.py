"""Candidate contacts, which touch and do not leave: find them, and let them act as sticking or sliding contacts.

A contact *acts* if it sticks or slides in the contact mode; otherwise it is open.
"""

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

# Contact modes of a body, as codes: it flies, collides, moves in contact, rests, has no consistent forces; a contact
# problem must decide, without or with sliding contacts (`contact_mode`); the last step is taken back
# (`mode_acceptance`).
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

# States of a candidate.
CANDIDATE_OPEN, CANDIDATE_STICKING, CANDIDATE_SLIDING = range(3)

# Speed of approach, as a share of `motion.thresholds.rest_speed`, below which a contact that opens does not collide.
_UNSEEN_APPROACH = 1.0e-2


@kernel
def find_candidates(y, offset_frame, scratch, motion):
    """Find the features that touch and do not leave in the state y, and write them to `motion.candidates.slot`.

    Returns (number of candidates, whether a touching feature approaches); if one approaches, the number is 0.
    """
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
    """Make the candidates that are not open the acting contacts, `motion.contacts`; mark them in `smooth.is_active`.

    Their given forces are the last known forces of their slots. `count` is the number of candidates.
    """
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
    """True if any candidate is open."""
    for i in range(candidates.count):
        if candidates.state[i] == CANDIDATE_OPEN:
            return True
    return False


@inlined
def has_normal_speed(motion):
    """True if an acting candidate moves along its normal, or an open one approaches, faster than rounding."""
    for i in range(motion.candidates.count):
        rate = motion.smooth.gap_rate[ROW_START, motion.candidates.slot[i]]
        if rate < -motion.thresholds.rounding_speed or (
            rate > motion.thresholds.rounding_speed and motion.candidates.state[i] != CANDIDATE_OPEN
        ):
            return True
    return False


@kernel
def project_candidate_speeds(y, offset_frame, scratch, motion):
    """State y with the small normal velocities of all candidates removed, of acting and of open ones.

    A body may lie on two contacts and rock between them at speeds below the rest speed. If the normal velocity were
    removed from the acting contact only, the other one would move, again and again. If acting contacts have no normal
    speed, and no open one approaches, y is returned as it is, so that a contact just released keeps its speed.
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
    """Acceleration of candidate i: (normal component [m/s²], tangential vector, world frame).

    The body has rotation matrix R, angular velocity w, acceleration a and angular acceleration alpha.
    """
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
    """True if candidate i slides in the state y; its direction is written to `candidates.direction`, else zero."""
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
    """Scale of the accelerations of a body's contacts, by loads and by the angular velocity w [m/s²]."""
    return body.acceleration + body.radius * qt.dot(w, w)


@inlined
def has_closing_contact(count, motion):
    """True if one of `count` candidates is to open, but still approaches its wall, slowly."""
    thresholds, candidates = motion.thresholds, motion.candidates
    least = -thresholds.rounding_speed - _UNSEEN_APPROACH * thresholds.rest_speed
    for i in range(count):
        if candidates.state[i] == CANDIDATE_OPEN and motion.smooth.gap_rate[ROW_START, candidates.slot[i]] < least:
            return True
    return False
