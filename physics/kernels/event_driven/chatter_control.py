"""Look-ahead of a regime, and small leaps of first order where events crowd."""

from __future__ import annotations

from physics.kernels.compile.decorators import inlined
from physics.kernels.event_driven.guards import FORCE_GUARDS
from physics.kernels.event_driven.mode_acceptance import NO_MODE, contact_mode_hash, distrust_force_guards

# The next regime is looked for so much later, in the time radius / (speed + √(radius acceleration)): what a guard
# foretold is then above rounding, and the body has hardly moved. FURTHER times as far when it was not.
_LOOK_AHEAD = 1.0e-5
_LOOK_AHEAD_GROWTH = 8.0
_MAX_LOOK_AHEAD = 64.0

# More than CROWD events within one look-ahead go round in circles, at the verge between two regimes. Then, as
# where no force is consistent, an impulse and a leap of LEAP look-aheads are made, to first order; the leaps grow while
# the crowd lasts, up to LONGEST, with PAUSE events between them.
_CHATTER_EVENTS = 24
_FIRST_LEAP = 1.0
_LEAP_GROWTH = 4.0
_MAX_LEAP = 100.0
_EVENTS_BETWEEN_LEAPS = 6


@inlined
def reset_chatter_control(unit, motion):
    """Look-ahead and leaps at the start of a part, for a body whose own time is `unit` [s]; no event so far."""
    motion.ahead = motion.nearest = _LOOK_AHEAD * unit
    motion.leap = _FIRST_LEAP * motion.nearest
    motion.since, motion.crowd = 0.0, 0
    motion.unheeded, motion.ended = NO_MODE, NO_MODE


@inlined
def is_chattering(t, motion):
    """Count an event at the time t of the part; whether there have been too many within one look-ahead."""
    motion.crowd += 1
    if t > motion.since + motion.nearest:
        motion.since, motion.crowd = t, 0
    return motion.crowd > _CHATTER_EVENTS


@inlined
def lengthen_leap(t, motion):
    """A leap ends at the time t of the part: the next one is longer, and PAUSE events later if the crowd lasts."""
    motion.leap = min(_LEAP_GROWTH * motion.leap, _MAX_LEAP * motion.nearest)
    motion.since, motion.crowd = t, _CHATTER_EVENTS - _EVENTS_BETWEEN_LEAPS


@inlined
def adapt_look_ahead(step, guard, motion):
    """A step was ended by `guard`: look further ahead if it was short, or the regime is the one that ended before."""
    if guard in FORCE_GUARDS and (step < motion.ahead or contact_mode_hash(motion) == motion.ended):
        if not motion.ahead < _MAX_LOOK_AHEAD * motion.nearest:
            distrust_force_guards(motion.nearest, motion)
        motion.ahead = min(
            motion.ahead * _LOOK_AHEAD_GROWTH, _MAX_LOOK_AHEAD * motion.nearest
        )  # what was foretold has not been found
    elif step > motion.ahead:
        motion.ahead = motion.nearest
        motion.leap = max(_FIRST_LEAP * motion.nearest, motion.leap / _LEAP_GROWTH)
    motion.ended = contact_mode_hash(motion) if guard in FORCE_GUARDS else NO_MODE
