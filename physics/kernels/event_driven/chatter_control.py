"""Keep chatter short, which is a sequence of many events within a very short time.

Two means end it. One is a look ahead to the next contact mode. The other is a leap: after an impulse the body moves for
a short time at constant velocities, with an error of first order in that time.
"""

from __future__ import annotations

from physics.compiler.decorators import inlined
from physics.kernels.event_driven.guards import FORCE_GUARDS
from physics.kernels.event_driven.mode_acceptance import NO_MODE, contact_mode_hash, distrust_force_guards

# The next contact mode is searched this much later than the event, in units of radius / (speed + √(radius
# acceleration)). The change that a guard foretold is above rounding then, and the body has hardly moved. If the change
# was not found, the look-ahead grows by the second factor, up to the third times its least value.
_LOOK_AHEAD = 1.0e-5
_LOOK_AHEAD_GROWTH = 8.0
_MAX_LOOK_AHEAD = 64.0

# More than _CHATTER_EVENTS events within one look-ahead are chatter, of a body on the verge of two contact modes. Then,
# as where no force is consistent, an impulse and a leap are made. The first leap is _FIRST_LEAP look-aheads long. The
# leaps grow by _LEAP_GROWTH while the chatter lasts, up to _MAX_LEAP, with _EVENTS_BETWEEN_LEAPS events in between.
_CHATTER_EVENTS = 24
_FIRST_LEAP = 1.0
_LEAP_GROWTH = 4.0
_MAX_LEAP = 100.0
_EVENTS_BETWEEN_LEAPS = 6


@inlined
def reset_chatter_control(unit, pace):
    """Reset look-ahead and leaps at the start of a substep, and trust the force guards of all contact modes again.

    `unit` is the time scale of the body [s], `pace` the group `Motion.pace`.
    """
    pace.look_ahead = pace.min_look_ahead = _LOOK_AHEAD * unit
    pace.next_leap = _FIRST_LEAP * pace.min_look_ahead
    pace.chatter_start, pace.chatter_count = 0.0, 0
    pace.distrusted_mode, pace.ended_mode = NO_MODE, NO_MODE


@inlined
def is_chattering(t, pace):
    """Count an event at the time t [s] of the substep; return whether there are too many within one look-ahead."""
    pace.chatter_count += 1
    if t > pace.chatter_start + pace.min_look_ahead:
        pace.chatter_start, pace.chatter_count = t, 0
    return pace.chatter_count > _CHATTER_EVENTS


@inlined
def lengthen_leap(t, pace):
    """Make the next leap longer, after a leap that ended at the time t [s] of the substep.

    It follows after `_EVENTS_BETWEEN_LEAPS` events, if the chatter lasts.
    """
    pace.next_leap = min(_LEAP_GROWTH * pace.next_leap, _MAX_LEAP * pace.min_look_ahead)
    pace.chatter_start, pace.chatter_count = t, _CHATTER_EVENTS - _EVENTS_BETWEEN_LEAPS


@inlined
def adapt_look_ahead(step, guard, motion):
    """Adapt the look-ahead after a motion of `step` [s] that `guard` has ended.

    If a force guard has ended it, and the motion was shorter than the look-ahead or its contact mode the same as
    before, the look-ahead grows; at its largest value the force guards of the mode are ignored from then on. After a
    longer motion the look-ahead is reset.
    """
    pace, contacts = motion.pace, motion.contacts
    if guard in FORCE_GUARDS and (step < pace.look_ahead or contact_mode_hash(contacts) == pace.ended_mode):
        if not pace.look_ahead < _MAX_LOOK_AHEAD * pace.min_look_ahead:
            distrust_force_guards(pace.min_look_ahead, motion)
        pace.look_ahead = min(
            pace.look_ahead * _LOOK_AHEAD_GROWTH, _MAX_LOOK_AHEAD * pace.min_look_ahead
        )  # the change that the guard foretold was not found
    elif step > pace.look_ahead:
        pace.look_ahead = pace.min_look_ahead
        pace.next_leap = max(_FIRST_LEAP * pace.min_look_ahead, pace.next_leap / _LEAP_GROWTH)
    pace.ended_mode = contact_mode_hash(contacts) if guard in FORCE_GUARDS else NO_MODE
