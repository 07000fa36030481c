"""Impacts: target velocities of contacts where bodies meet, and the time until the next impact."""

from __future__ import annotations

import math

from physics.compiler.decorators import if_given, inlined, kernel
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
    smaller_radius,
)
from physics.kernels.multibody.data.driven_bodies import report_impact_work
from physics.kernels.multibody.data.warm_torques import clear_torque
from physics.kernels.multibody.stepping.bouncing import is_bouncing, rest_speed_limit, set_tangential_targets
from physics.kernels.multibody.stepping.impact_events import log_impacts
from physics.kernels.multibody.stepping.restitution_energy import apply_impact_within_energy
from physics.kernels.multibody.stepping.sudden_change import count_impact

# An approach is fast if it would close this share of the smaller body's radius in the time left. The stage then ends at
# the time of impact; a slower approach is braked within the stage.
_FAST_RADIUS_SHARE = 0.1

# Factor of the bound ω² r of a point's acceleration by free rotation, since the angular velocity changes meanwhile.
TURNING_MARGIN = 2.0

# Gap within which an open contact belongs to an impact of others: in slops, and, if its pair touches elsewhere, in
# tolerances times the smaller body's radius. A face that comes back from an impact is tilted by the residual of its
# solve.
_SAME_MOMENT_SLOPS = 2.0
_SAME_MOMENT_RADII = 10.0

# Minus the target of a contact that does not close in this stage, and gives no impulse in it.
_UNCONSTRAINED = 1.0e300

# Target of an open contact for which a later stage ends in time, but which pushes on its bodies may close in this one.
# The resting stage replaces it.
FORETOLD = -1.0e299


def _same_limit(k, fast, h, many):
    return fast


@if_given("many.compliance", _same_limit)
def _limit_at_springs(k, fast, h, many):
    """Speed that closes a slop within h [s], instead of the limit `fast`: springs and dampers act from contact on."""
    return pair_slop(many.contacts.bodies[k, 0], many.contacts.bodies[k, 1], many) / h


@inlined
def impact_speed_limit(k, h, many):
    """Least approach speed of contact k for which a stage must end at the time of impact [m/s].

    This speed closes `_FAST_RADIUS_SHARE` of the smaller body's radius within h [s]. Under error control
    (`adaptive_substep`) the result is at most `rest_speed_limit`. Otherwise a slow impact would be approached by ever
    shorter parts, down to the allowed error.
    """
    radius = smaller_radius(many.contacts.bodies[k, 0], many.contacts.bodies[k, 1], many)
    fast = _FAST_RADIUS_SHARE * radius / h
    if many.settings[0].is_error_controlled == 1:
        fast = min(fast, rest_speed_limit(k, h, many))
    return _limit_at_springs(k, fast, h, many)


@inlined
def _pair_touches(k, step, many):
    """True if contact k touches, or any later contact of the same pair (`step` = 1), or any earlier one (-1)."""
    a, b = many.contacts.bodies[k, 0], many.contacts.bodies[k, 1]
    least = arrival_gap(a, b, many)
    while 0 <= k < many.counts[NUM_CONTACTS] and many.contacts.bodies[k, 0] == a and many.contacts.bodies[k, 1] == b:
        if not many.contacts.gap[k] > least:
            return True
        k += step
    return False


@inlined
def is_left_to_advancement(k, many):
    """True if `conservative_advancement` finds the time of impact of contact k, because a body turns far.

    That module serves bodies that are apart. If the pair touches elsewhere, the contact is predicted like any other.
    """
    a, b = many.contacts.bodies[k, 0], many.contacts.bodies[k, 1]
    if not (many.bodies.spin_bound[a] > 0.0 or (b >= 0 and many.bodies.spin_bound[b] > 0.0)):
        return False
    return not _pair_touches(k, 1, many) and not _pair_touches(k, -1, many)


@inlined
def is_impact_ahead(k, h, many):
    """True if contact k is open and approaches, and the stage must end when it closes: it bounces, or is fast.

    h is the time left of the substep [s].
    """
    a, b = many.contacts.bodies[k, 0], many.contacts.bodies[k, 1]
    if not (many.contacts.gap[k] > pair_slop(a, b, many) and many.contacts.speed[k] < 0.0):
        return False
    return is_bouncing(k, many) or -many.contacts.speed[k] > impact_speed_limit(k, h, many)


@inlined
def _impact_target(k, h, many):
    """Target of touching contact k in an impact: (normal velocity [m/s], whether the contact causes the impact).

    A contact that bounces, or that leaves, has the target -e times its speed. For a leaving contact this allows a
    reversal, as in Moreau's law; without it a struck chain could gain energy. Any other contact has the target 0. h is
    the time left of the substep [s].
    """
    speed = many.contacts.speed[k]
    if speed > 0.0 or is_bouncing(k, many):
        return -many.contacts.restitution[k] * speed, not speed > 0.0
    return 0.0, -speed > min(rest_speed_limit(k, h, many), impact_speed_limit(k, h, many))


@inlined
def _distant_target(k, h, is_last, many):
    """Target of open contact k: (normal velocity [m/s], whether the contact must be braked in the air at once).

    The target closes the gap within h [s], the time left of the substep. If a later stage ends at its time of impact,
    the contact is unconstrained: it gives no impulse in this stage. In the last stage of a substep (`is_last`) this
    holds for no contact, except those of bodies that turn far.
    """
    goal = -(many.contacts.gap[k] + parted_slack(k, many)) / h
    if is_left_to_advancement(k, many) or (not is_last and is_impact_ahead(k, h, many)):
        return -_UNCONSTRAINED, False
    return goal, goal - many.contacts.speed[k] > min(rest_speed_limit(k, h, many), impact_speed_limit(k, h, many))


@inlined
def _is_in_same_moment(k, many):
    """True if open contact k has a gap so small that it belongs to an impact of other contacts.

    That is a gap of at most two slops. If the pair touches elsewhere, it also is a gap of at most the tolerance times a
    length: the way that the contact closes in the substep, or ten radii of the smaller body. Otherwise the corners of a
    face would hit one after another, and the impact of each would reverse the body's turn.
    """
    a, b, gap = many.contacts.bodies[k, 0], many.contacts.bodies[k, 1], many.contacts.gap[k]
    if gap <= _SAME_MOMENT_SLOPS * pair_slop(a, b, many):
        return True
    radius = smaller_radius(a, b, many)
    way = max(-many.contacts.speed[k] * many.settings[0].substep, _SAME_MOMENT_RADII * radius)
    return gap <= many.settings[0].tolerance * way and (_pair_touches(k, 1, many) or _pair_touches(k, -1, many))


@inlined
def set_impact_targets(n, h, is_last, many):
    """Set the target velocities of the n contacts in an impact; return the fastest that causes it, -1 if none does.

    They follow `contact_law.target_velocity.set_impact_targets`. h is the time left of the substep [s]; `is_last` says
    that the substep must not be cut again.

    An approaching contact is left to the resting stage, unless it is faster than `impact_speed_limit`, in two cases.
    Its speed is at most the one that loads give within `rest_share` of the substep. Or it would close only a few slops
    until the middle of the stage.
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
        clear_torque(k, many)
    if is_impact:
        fastest = _extend_impact(n, h, fastest, many)
    return fastest


@kernel
def _extend_impact(n, h, fastest, many):
    """Give the contacts of the same moment (`_is_in_same_moment`) targets of an impact; return its fastest contact.

    `fastest` is the fastest contact before, n the number of contacts, h the time left of the substep [s].
    """
    for k in range(n):
        slop = pair_slop(many.contacts.bodies[k, 0], many.contacts.bodies[k, 1], many)
        if many.contacts.gap[k] > slop and _is_in_same_moment(k, many):
            many.contacts.target[k, 0], is_hit = _impact_target(k, h, many)
            if is_hit and many.contacts.speed[k] < many.contacts.speed[fastest]:
                fastest = k
    return fastest


@inlined
def drop_unconstrained(n, many):
    """Remove the unconstrained contacts from the set of n contacts; return the number of remaining ones.

    An unconstrained contact has the target -`_UNCONSTRAINED`. It does not close in this stage.
    """
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
    """Keep unconstrained contacts in the set, by the target `FORETOLD`, if pushes on their bodies may close them.

    Loads alone do not close an unconstrained contact in this stage. Pushes may, if one of its bodies is in another
    contact of the set, or in a contact that was kept for this reason. n is the number of contacts.
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
def _resolve_rigid_impacts(n, world, t, h, is_last, switches, records, many):
    """Apply the impulses of an impact if contacts cause one: (contacts in the set, time, whether there was one).

    The time [s] is a lower bound of that until the next impact (`time_to_first_impact`). n is the number of contacts in
    the set at first. The impact happens t [s] after the start of the call, with h [s] left of the substep. `is_last`
    says that the substep must not be cut again. With sequential impacts only the fastest contact gives an impulse; the
    substep then looks for further impacts.
    """
    fastest = set_impact_targets(n, h, is_last, many)
    meeting = time_to_first_impact(n, h, is_last, many)
    if fastest < 0:
        constrain_coupled_contacts(n, many)
        return drop_unconstrained(n, many), meeting, False
    if many.settings[0].is_sequential == 1 and not is_last:
        for k in range(n):
            if k != fastest:
                many.contacts.target[k, 0] = -_UNCONSTRAINED  # resolved after this impact, when the step returns
    n = drop_unconstrained(n, many)
    set_tangential_targets(n, many, many.bodies.body[0])
    count_impact(many)
    apply_impact_within_energy(n, world, switches.friction, switches.flight.offset_frame, records.report, many)
    report_impact_work(n, world, records.report, many)
    if records.log.shape[1] > 0:
        log_impacts(n, world, t, many, records.log, records.counts)
    return n, meeting, True


def _with_impacts(n, world, t, h, is_last, switches, records, many):
    return _resolve_rigid_impacts(n, world, t, h, is_last, switches, records, many)


@if_given("many.compliance", _with_impacts)
def resolve_impacts(n, world, t, h, is_last, switches, records, many):
    """Leave all contacts to the resting stage: (contacts in the set, time to the next meeting, False).

    Compliant contacts have no impacts. Open ones that close later are left out of the stage, which ends before they do.
    Rigid contacts are served by `_resolve_rigid_impacts`, whose arguments these are.
    """
    for k in range(n):
        put_vector(many.contacts.target, k, 0, (0.0, 0.0, 0.0))
        put_vector(many.contacts.impulse, k, 0, (0.0, 0.0, 0.0))
        clear_torque(k, many)
        slop = pair_slop(many.contacts.bodies[k, 0], many.contacts.bodies[k, 1], many)
        is_ahead = is_left_to_advancement(k, many) or (not is_last and is_impact_ahead(k, h, many))
        if many.contacts.gap[k] > slop and is_ahead:
            many.contacts.target[k, 0] = -_UNCONSTRAINED
    constrain_coupled_contacts(n, many)
    meeting = time_to_first_impact(n, h, is_last, many)
    return drop_unconstrained(n, many), meeting, False


@inlined
def time_to_first_impact(n, h, is_last, many):
    """Lower bound of the time until the first impact for which a stage must end, at most h [s].

    Two points approach by at most s t + a t²/2, for their approach speed s and a bound a of their acceleration by loads
    and rotation. So a gap lasts at least until t = 2 gap/(s + √(s² + 2 a gap)). `conservative_advancement` serves
    bodies that turn far. In the last stage of a substep (`is_last`) the result is h.
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
