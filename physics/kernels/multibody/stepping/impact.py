"""Impacts: what contacts ask of velocities where bodies meet, and how long it takes until they next do."""

from __future__ import annotations

import math

from physics.kernels.compile.decorators import inlined, kernel
from physics.kernels.math import quaternion as qt
from physics.kernels.multibody.data import warm_start as kept
from physics.kernels.multibody.data.arrays import CONTACTS
from physics.kernels.multibody.data.contact_set import acceleration_of, arrival, pair_slop, put, vector
from physics.kernels.multibody.stepping.impact_events import log_impacts
from physics.kernels.multibody.stepping.restitution_energy import settle_restrained

# A meeting is fast where it would close this share of the smaller body's radius in the time left: it is then met in
# time, not stopped in front of.
FAST_SHARE = 0.1

# What a free rotation may add to the bound of a point's acceleration, ω² r: its angular velocity changes on the way.
TURNING_MARGIN = 2.0

# Slops that something may go in until the resting stage stops it at the middle of the step: a contact problem less.
SOFT_LANDING = 100.0

FAR = 1.0e300


@inlined
def bounces(k, h, many):
    """True if contact k would leave again for longer than `rest_share` of h after an impact at its speed now."""
    least = many.settings[0].rest_share * acceleration_of(k, many) * h
    return many.bounce[k] > 0.0 and -many.bounce[k] * many.speed[k] > least


@inlined
def slow_speed(k, h, many):
    """Speed that the resting stage may stop [m/s].

    What loads give within `rest_share` of h, or what goes in by a few slops only until the middle of it.
    """
    slop = pair_slop(many.ends[k, 0], many.ends[k, 1], many)
    return max(2.0 * SOFT_LANDING * slop / h, many.settings[0].rest_share * acceleration_of(k, many) * h)


@inlined
def fast_speed(k, h, many):
    """Speed that is to be met in time: one that closes `FAST_SHARE` of the smaller radius within h [m/s].

    Under error control (`adaptive_substep`) all that is not slow, so that no part has to be as short as the error of
    where bodies meet.
    """
    one, other = many.ends[k, 0], many.ends[k, 1]
    radius = many.bodies[one].radius
    if other >= 0:
        radius = min(radius, many.bodies[other].radius)
    fast = FAST_SHARE * radius / h
    if many.settings[0].in_time == 1:
        fast = min(fast, slow_speed(k, h, many))
    return fast


@inlined
def _pair_touches(k, step, many):
    """True if contact k, or one after it in the set by steps of `step`, touches and is of the same pair."""
    a, b = many.ends[k, 0], many.ends[k, 1]
    least = arrival(a, b, many)
    while 0 <= k < many.counts[CONTACTS] and many.ends[k, 0] == a and many.ends[k, 1] == b:
        if not many.gap[k] > least:
            return True
        k += step
    return False


@inlined
def is_seen_to(k, many):
    """True where `conservative_advancement` finds the time of contact k: a body that turns far leaves its tangent.

    It looks at what is apart: where the pair touches elsewhere the contact is foretold as any other.
    """
    a, b = many.ends[k, 0], many.ends[k, 1]
    if not (many.spin[a] > 0.0 or (b >= 0 and many.spin[b] > 0.0)):
        return False
    return not _pair_touches(k, 1, many) and not _pair_touches(k, -1, many)


@inlined
def is_meeting(k, h, many):
    """True if contact k is still apart and to be met in time: it bounces, or is fast."""
    a, b = many.ends[k, 0], many.ends[k, 1]
    if not (many.gap[k] > pair_slop(a, b, many) and many.speed[k] < 0.0):
        return False
    return bounces(k, h, many) or -many.speed[k] > fast_speed(k, h, many)


@inlined
def aim_impact(n, h, is_last, many):
    """Targets of an impact, and the contact that approaches fastest of those that make it one, -1: there is none.

    See `physics.kernels.contact_law.target_velocity.aim_impact`.

    What approaches no faster than loads make it within `rest_share` of the step, or would go in by a few slops only
    until the middle of it, is left to the resting stage, unless it is fast.
    """
    fastest = -1
    for k in range(n):
        slop = pair_slop(many.ends[k, 0], many.ends[k, 1], many)
        gap, speed, goal, is_hit = many.gap[k], many.speed[k], 0.0, False
        slow = min(slow_speed(k, h, many), fast_speed(k, h, many))
        if gap > slop:
            goal = -gap / h
            if is_seen_to(k, many) or (not is_last and is_meeting(k, h, many)):
                goal = -FAR
            elif goal - speed > slow:
                is_hit = True
        elif speed > 0.0:
            goal = -many.bounce[k] * speed  # Moreau's law for what leaves: without it a struck chain could gain energy
        elif bounces(k, h, many):
            goal, is_hit = -many.bounce[k] * speed, True
        elif -speed > slow:
            is_hit = True
        if is_hit and (fastest < 0 or speed < many.speed[fastest]):
            fastest = k
        put(many.target, k, 0, (goal, 0.0, 0.0))
        put(many.impulse, k, 0, (0.0, 0.0, 0.0))
    return fastest


@inlined
def leave_out_the_free(n, many):
    """Drop the contacts that have no target from the set: they are not met in this stage. Returns what is left."""
    left = 0
    for k in range(n):
        if many.target[k, 0] > -FAR:
            if left < k:
                kept.copy_contact(k, left, many)
            left += 1
    return left


@inlined
def _mark(k, many):
    many.touched[many.ends[k, 0]] = 1
    if many.ends[k, 1] >= 0:
        many.touched[many.ends[k, 1]] = 1


@inlined
def keep_the_crowded(n, many):
    """Keep those without a target whose bodies are in other contacts of the set, or in some that are kept for this.

    Loads alone do not bring them together in this stage, but what pushes these bodies may.
    """
    for b in range(many.touched.shape[0]):
        many.touched[b] = 0
    for k in range(n):
        if many.target[k, 0] > -FAR:
            _mark(k, many)
    is_growing = True
    while is_growing:
        is_growing = False
        for k in range(n):
            a, b = many.ends[k, 0], many.ends[k, 1]
            if not many.target[k, 0] > -FAR and (many.touched[a] == 1 or (b >= 0 and many.touched[b] == 1)):
                many.target[k, 0], is_growing = 0.0, True
                _mark(k, many)


@kernel
def strike(n, world, t, h, is_last, friction, tilted, report, many, log, counts):
    """Velocities after the impulses of the contacts that approach; nothing where none does. Contacts in the set.

    It happens t [s] after the start of the call, with h [s] left of the substep.

    In turn only the one that approaches fastest gives an impulse: the step comes back for the others.
    """
    fastest = aim_impact(n, h, is_last, many)
    meeting = time_until_meeting(n, h, is_last, many)
    if fastest < 0:
        keep_the_crowded(n, many)
        return leave_out_the_free(n, many), meeting, False
    if many.settings[0].in_turn == 1 and not is_last:
        for k in range(n):
            if k != fastest:
                many.target[k, 0] = -FAR  # its turn comes when this one is over
    n = leave_out_the_free(n, many)
    settle_restrained(n, world, friction, tilted, report, many)
    if log.shape[1] > 0:
        log_impacts(n, world, t, many, log, counts)
    return n, meeting, True


@inlined
def time_until_meeting(n, h, is_last, many):
    """Time until the first of the meetings that matter, at the latest h [s]: never too late.

    Two points approach by at most s t + a t²/2 with a the bound of their acceleration by loads and turning, so
    that the gap lasts at least until t = 2 gap/(s + √(s² + 2 a gap)). What turns far is looked at by
    `conservative_advancement`.
    """
    first = h
    if is_last:
        return first
    for k in range(n):
        if is_seen_to(k, many) or not is_meeting(k, h, many):
            continue
        a, b, s = many.ends[k, 0], many.ends[k, 1], -many.speed[k]
        w = vector(many.twist, a, 3)
        bound = acceleration_of(k, many) + TURNING_MARGIN * qt.dot(w, w) * many.bodies[a].radius
        if b >= 0:
            w = vector(many.twist, b, 3)
            bound += TURNING_MARGIN * qt.dot(w, w) * many.bodies[b].radius
        first = min(first, 2.0 * many.gap[k] / (s + math.sqrt(s * s + 2.0 * bound * many.gap[k])))
    return first
