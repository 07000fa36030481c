"""Limit of crowded events: the look-ahead of a contact mode, and small leaps of first order."""

from __future__ import annotations

from physics.compiler.decorators import inlined
from physics.kernels.event_driven.guards import FORCE_GUARDS
from physics.kernels.event_driven.mode_acceptance import NO_MODE, contact_mode_hash, distrust_force_guards

# The next contact mode is looked for so much later, in the time radius / (speed + √(radius acceleration)): what a guard
# foretold is then above rounding, and the body has hardly moved. FURTHER times as far when it was not.
_LOOK_AHEAD = 1.0e-5
_LOOK_AHEAD_GROWTH = 8.0
_MAX_LOOK_AHEAD = 64.0

# More than CROWD events within one look-ahead go round in circles, at the verge between two contact modes. Then, as
# where no force is consistent, an impulse and a leap of LEAP look-aheads are made, to first order; the leaps grow while
# the crowd lasts, up to LONGEST, with PAUSE events between them.
_CHATTER_EVENTS = 24
_FIRST_LEAP = 1.0
_LEAP_GROWTH = 4.0
_MAX_LEAP = 100.0
_EVENTS_BETWEEN_LEAPS = 6


@inlined
def reset_chatter_control(unit, pace):
    """Reset look-ahead and leaps at the start of a part, for a body with the time scale `unit` [s]."""
    pace.look_ahead = pace.min_look_ahead = _LOOK_AHEAD * unit
    pace.next_leap = _FIRST_LEAP * pace.min_look_ahead
    pace.chatter_start, pace.chatter_count = 0.0, 0
    pace.distrusted_mode, pace.ended_mode = NO_MODE, NO_MODE


@inlined
def is_chattering(t, pace):
    """Count an event at the time t of the part; return whether one look-ahead has had too many."""
    pace.chatter_count += 1
    if t > pace.chatter_start + pace.min_look_ahead:
        pace.chatter_start, pace.chatter_count = t, 0
    return pace.chatter_count > _CHATTER_EVENTS


@inlined
def lengthen_leap(t, pace):
    """End a leap at the time t of the part: the next leap is longer, after PAUSE events if the crowd lasts."""
    pace.next_leap = min(_LEAP_GROWTH * pace.next_leap, _MAX_LEAP * pace.min_look_ahead)
    pace.chatter_start, pace.chatter_count = t, _CHATTER_EVENTS - _EVENTS_BETWEEN_LEAPS


@inlined
def adapt_look_ahead(step, guard, motion):
    """Adapt the look-ahead after `guard` has ended a step: look further if the step was short, or its mode repeated."""
    pace, contacts = motion.pace, motion.contacts
    if guard in FORCE_GUARDS and (step < pace.look_ahead or contact_mode_hash(contacts) == pace.ended_mode):
        if not pace.look_ahead < _MAX_LOOK_AHEAD * pace.min_look_ahead:
            distrust_force_guards(pace.min_look_ahead, motion)
        pace.look_ahead = min(
            pace.look_ahead * _LOOK_AHEAD_GROWTH, _MAX_LOOK_AHEAD * pace.min_look_ahead
        )  # what was foretold has not been found
    elif step > pace.look_ahead:
        pace.look_ahead = pace.min_look_ahead
        pace.next_leap = max(_FIRST_LEAP * pace.min_look_ahead, pace.next_leap / _LEAP_GROWTH)
    pace.ended_mode = contact_mode_hash(contacts) if guard in FORCE_GUARDS else NO_MODE
