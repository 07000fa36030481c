"""Impacts: target velocities of contacts where bodies meet, and the time until the next meeting."""

from __future__ import annotations

import math

from physics.compiler.decorators import inlined, kernel
from physics.kernels.math import quaternion as qt
from physics.kernels.math.vector import row_vector
from physics.kernels.multibody.data import warm_start as kept
from physics.kernels.multibody.data.arrays import NUM_CONTACTS
from physics.kernels.multibody.data.contact_set import (
    arrival_gap,
    pair_slop,
    parted_slack,
    put_vector,
    relative_acceleration_bound,
)
from physics.kernels.multibody.stepping.impact_events import log_impacts
from physics.kernels.multibody.stepping.restitution_energy import apply_impact_within_energy

# A meeting is fast where it would close this share of the smaller body's radius in the time left: it is then met in
# time, not stopped in front of.
_FAST_RADIUS_SHARE = 0.1

# What a free rotation may add to the bound of a point's acceleration, ω² r: its angular velocity changes on the way.
TURNING_MARGIN = 2.0

# Slops that something may go in until the resting stage stops it at the middle of the step: a contact problem less.
_SOFT_LANDING_SLOPS = 100.0

# Slops within which contacts that are apart belong to an impact of others; and, of a pair that touches elsewhere, radii
# of the smaller body by the tolerance: a face that comes back from an impact is tilted by what the solve has left.
_SAME_MOMENT_SLOPS = 2.0
_SAME_MOMENT_RADII = 10.0

_UNCONSTRAINED = 1.0e300

# Target of a contact that is apart and is to be met in time, until the resting stage sets its own.
FORETOLD = -1.0e299


@inlined
def _rest_speed(k, many):
    """Speed that loads give contact k within `rest_share` of the substep [m/s].

    The whole substep counts, even if little of it is left after an impact of others; else such impacts would make
    resting bodies bounce.
    """
    return many.settings[0].rest_share * relative_acceleration_bound(k, many) * many.settings[0].substep


@inlined
def is_bouncing(k, many):
    """True if contact k would leave again for longer than `rest_share` of the substep after an impact at its speed."""
    bounce = -many.contacts.restitution[k] * many.contacts.speed[k]
    return many.contacts.restitution[k] > 0.0 and bounce > _rest_speed(k, many)


@inlined
def rest_speed_limit(k, h, many):
    """Largest speed that the resting stage may stop [m/s].

    The limit is the speed that loads give within `rest_share` of the substep, or one that closes a few slops until the
    middle of h.
    """
    slop = pair_slop(many.contacts.bodies[k, 0], many.contacts.bodies[k, 1], many)
    return max(2.0 * _SOFT_LANDING_SLOPS * slop / h, _rest_speed(k, many))


@inlined
def impact_speed_limit(k, h, many):
    """Least speed of contacts to be met in time [m/s]: it closes `_FAST_RADIUS_SHARE` of the smaller radius within h.

    Under error control (`adaptive_substep`) every contact that is not slow is met in time. Else parts would be as short
    as the error in the place of a meeting.
    """
    one, other = many.contacts.bodies[k, 0], many.contacts.bodies[k, 1]
    radius = many.bodies.body[one].radius
    if other >= 0:
        radius = min(radius, many.bodies.body[other].radius)
    fast = _FAST_RADIUS_SHARE * radius / h
    if many.settings[0].is_error_controlled == 1:
        fast = min(fast, rest_speed_limit(k, h, many))
    return fast


@inlined
def _pair_touches(k, step, many):
    """True if contact k, or one after it in the set by steps of `step`, touches and belongs to the same pair."""
    a, b = many.contacts.bodies[k, 0], many.contacts.bodies[k, 1]
    least = arrival_gap(a, b, many)
    while 0 <= k < many.counts[NUM_CONTACTS] and many.contacts.bodies[k, 0] == a and many.contacts.bodies[k, 1] == b:
        if not many.contacts.gap[k] > least:
            return True
        k += step
    return False


@inlined
def is_left_to_advancement(k, many):
    """True if `conservative_advancement` finds the time of contact k, because a body turns far.

    It serves bodies that are apart. If the pair touches elsewhere, the contact is predicted like any other.
    """
    a, b = many.contacts.bodies[k, 0], many.contacts.bodies[k, 1]
    if not (many.bodies.spin_bound[a] > 0.0 or (b >= 0 and many.bodies.spin_bound[b] > 0.0)):
        return False
    return not _pair_touches(k, 1, many) and not _pair_touches(k, -1, many)


@inlined
def is_impact_ahead(k, h, many):
    """True if contact k is still apart and to be met in time: it bounces, or is fast."""
    a, b = many.contacts.bodies[k, 0], many.contacts.bodies[k, 1]
    if not (many.contacts.gap[k] > pair_slop(a, b, many) and many.contacts.speed[k] < 0.0):
        return False
    return is_bouncing(k, many) or -many.contacts.speed[k] > impact_speed_limit(k, h, many)


@inlined
def _impact_target(k, h, many):
    """Target of contact k in an impact, and whether it collides: others may leave it unchanged.

    A leaving contact may be reversed to e times its speed, as in Moreau's law; without this a struck chain could gain
    energy.
    """
    speed = many.contacts.speed[k]
    if speed > 0.0 or is_bouncing(k, many):
        return -many.contacts.restitution[k] * speed, not speed > 0.0
    return 0.0, -speed > min(rest_speed_limit(k, h, many), impact_speed_limit(k, h, many))


@inlined
def _distant_target(k, h, is_last, many):
    """Target of contact k with a gap, and whether it must be braked in the air; unconstrained if met in time."""
    goal = -(many.contacts.gap[k] + parted_slack(k, many)) / h
    if is_left_to_advancement(k, many) or (not is_last and is_impact_ahead(k, h, many)):
        return -_UNCONSTRAINED, False
    return goal, goal - many.contacts.speed[k] > min(rest_speed_limit(k, h, many), impact_speed_limit(k, h, many))


@inlined
def _is_in_same_moment(k, many):
    """True if contact k has a gap so small that it belongs to an impact of others.

    That is within two slops, or, of a pair that touches elsewhere, within what the tolerance makes of the way in the
    substep, or of some radii: the corners of one face would else hit one after another, each turning the body that the
    next one turns back.
    """
    a, b, gap = many.contacts.bodies[k, 0], many.contacts.bodies[k, 1], many.contacts.gap[k]
    if gap <= _SAME_MOMENT_SLOPS * pair_slop(a, b, many):
        return True
    radius = many.bodies.body[a].radius
    if b >= 0:
        radius = min(radius, many.bodies.body[b].radius)
    way = max(-many.contacts.speed[k] * many.settings[0].substep, _SAME_MOMENT_RADII * radius)
    return gap <= many.settings[0].tolerance * way and (_pair_touches(k, 1, many) or _pair_touches(k, -1, many))


@inlined
def set_impact_targets(n, h, is_last, many):
    """Set the targets of an impact; return the fastest approaching contact of those that cause it, -1 without one.

    See `physics.kernels.contact_law.target_velocity.set_impact_targets`.

    A contact is left to the resting stage, unless it is fast, in two cases: its speed is at most the one that loads
    give within `rest_share` of the step, or it would close only a few slops until the middle of the step.
    """
    fastest, is_impact = -1, False
    for k in range(n):
        is_touching = not many.contacts.gap[k] > pair_slop(many.contacts.bodies[k, 0], many.contacts.bodies[k, 1], many)
        goal, is_hit = _impact_target(k, h, many) if is_touching else _distant_target(k, h, is_last, many)
        is_impact = is_impact or (is_hit and is_touching)
        if is_hit and (fastest < 0 or many.contacts.speed[k] < many.contacts.speed[fastest]):
            fastest = k
        put_vector(many.contacts.target, k, 0, (goal, 0.0, 0.0))
        put_vector(many.contacts.impulse, k, 0, (0.0, 0.0, 0.0))
    if is_impact:
        fastest = _extend_impact(n, h, fastest, many)
    return fastest


@kernel
def _extend_impact(n, h, fastest, many):
    """Add the contacts of the same moment to an impact; return the new fastest approaching contact."""
    for k in range(n):
        slop = pair_slop(many.contacts.bodies[k, 0], many.contacts.bodies[k, 1], many)
        if many.contacts.gap[k] > slop and _is_in_same_moment(k, many):
            many.contacts.target[k, 0], is_hit = _impact_target(k, h, many)
            if is_hit and many.contacts.speed[k] < many.contacts.speed[fastest]:
                fastest = k
    return fastest


@inlined
def drop_unconstrained(n, many):
    """Drop contacts without a target from the set, since they are not met in this stage; return the rest."""
    left = 0
    for k in range(n):
        if many.contacts.target[k, 0] > -_UNCONSTRAINED:
            if left < k:
                kept.copy_contact(k, left, many)
            left += 1
    return left


@inlined
def _mark_bodies(k, many):
    many.bodies.touched[many.contacts.bodies[k, 0]] = 1
    if many.contacts.bodies[k, 1] >= 0:
        many.bodies.touched[many.contacts.bodies[k, 1]] = 1


@inlined
def constrain_coupled_contacts(n, many):
    """Keep contacts without a target if their bodies are in other contacts of the set, or in contacts kept for this.

    Loads alone do not close these contacts in this stage, but pushes on their bodies may.
    """
    for b in range(many.bodies.touched.shape[0]):
        many.bodies.touched[b] = 0
    for k in range(n):
        if many.contacts.target[k, 0] > -_UNCONSTRAINED:
            _mark_bodies(k, many)
    is_growing = True
    while is_growing:
        is_growing = False
        for k in range(n):
            a, b = many.contacts.bodies[k, 0], many.contacts.bodies[k, 1]
            if not many.contacts.target[k, 0] > -_UNCONSTRAINED and (
                many.bodies.touched[a] == 1 or (b >= 0 and many.bodies.touched[b] == 1)
            ):
                many.contacts.target[k, 0], is_growing = FORETOLD, True
                _mark_bodies(k, many)


@kernel
def resolve_impacts(n, world, t, h, is_last, switches, records, many):
    """Velocities after the impulses of approaching contacts, unchanged without one; return the contacts in the set.

    It happens t [s] after the start of the call, with h [s] left of the substep.

    With impacts in turn only the fastest approaching contact gives an impulse: the step comes back for the others.
    """
    fastest = set_impact_targets(n, h, is_last, many)
    meeting = time_to_first_impact(n, h, is_last, many)
    if fastest < 0:
        constrain_coupled_contacts(n, many)
        return drop_unconstrained(n, many), meeting, False
    if many.settings[0].is_sequential == 1 and not is_last:
        for k in range(n):
            if k != fastest:
                many.contacts.target[k, 0] = -_UNCONSTRAINED  # its turn comes when this one is over
    n = drop_unconstrained(n, many)
    apply_impact_within_energy(n, world, switches.friction, switches.flight.offset_frame, records.report, many)
    if records.log.shape[1] > 0:
        log_impacts(n, world, t, many, records.log, records.counts)
    return n, meeting, True


@inlined
def time_to_first_impact(n, h, is_last, many):
    """Time until the first meeting that matters, at most h [s]; never too late.

    Two points approach by at most s t + a t²/2, with a bound a of their acceleration by loads and turning. So the gap
    lasts at least until t = 2 gap/(s + √(s² + 2 a gap)). `conservative_advancement` serves bodies that turn far.
    """
    first = h
    if is_last:
        return first
    for k in range(n):
        if is_left_to_advancement(k, many) or not is_impact_ahead(k, h, many):
            continue
        a, b, s = many.contacts.bodies[k, 0], many.contacts.bodies[k, 1], -many.contacts.speed[k]
        w = row_vector(many.bodies.twist, a, 3)
        bound = relative_acceleration_bound(k, many) + TURNING_MARGIN * qt.dot(w, w) * many.bodies.body[a].radius
        if b >= 0:
            w = row_vector(many.bodies.twist, b, 3)
            bound += TURNING_MARGIN * qt.dot(w, w) * many.bodies.body[b].radius
        first = min(first, 2.0 * many.contacts.gap[k] / (s + math.sqrt(s * s + 2.0 * bound * many.contacts.gap[k])))
    return first
