"""Look-ahead of a regime, and small leaps of first order where events crowd."""

from __future__ import annotations

from physics.kernels.compile.decorators import inlined
from physics.kernels.event_driven.guards import FORCES
from physics.kernels.event_driven.mode_acceptance import NONE, distrust, name_of_regime

# The next regime is looked for so much later, in the time radius / (speed + √(radius acceleration)): what a guard
# foretold is then above rounding, and the body has hardly moved. FURTHER times as far when it was not.
AHEAD = 1.0e-5
FURTHER = 8.0
FARTHEST = 64.0

# More than CROWD events within one look-ahead go round in circles, at the verge between two regimes. Then, as
# where no force is consistent, an impulse and a leap of LEAP look-aheads are made, to first order; the leaps grow while
# the crowd lasts, up to LONGEST, with PAUSE events between them.
CROWD = 24
LEAP = 1.0
LONGER = 4.0
LONGEST = 100.0
PAUSE = 6


@inlined
def set_pace(unit, motion):
    """Look-ahead and leaps at the start of a part, for a body whose own time is `unit` [s]; no event so far."""
    motion.ahead = motion.nearest = AHEAD * unit
    motion.leap = LEAP * motion.nearest
    motion.since, motion.crowd = 0.0, 0
    motion.unheeded, motion.ended = NONE, NONE


@inlined
def is_crowded(t, motion):
    """Count an event at the time t of the part; whether there have been too many within one look-ahead."""
    motion.crowd += 1
    if t > motion.since + motion.nearest:
        motion.since, motion.crowd = t, 0
    return motion.crowd > CROWD


@inlined
def note_leap(t, motion):
    """A leap ends at the time t of the part: the next one is longer, and PAUSE events later if the crowd lasts."""
    motion.leap = min(LONGER * motion.leap, LONGEST * motion.nearest)
    motion.since, motion.crowd = t, CROWD - PAUSE


@inlined
def note_step(step, guard, motion):
    """A step was ended by `guard`: look further ahead if it was short, or the regime is the one that ended before."""
    if guard in FORCES and (step < motion.ahead or name_of_regime(motion) == motion.ended):
        if not motion.ahead < FARTHEST * motion.nearest:
            distrust(motion.nearest, motion)
        motion.ahead = min(motion.ahead * FURTHER, FARTHEST * motion.nearest)  # what was foretold has not been found
    elif step > motion.ahead:
        motion.ahead = motion.nearest
        motion.leap = max(LEAP * motion.nearest, motion.leap / LONGER)
    motion.ended = name_of_regime(motion) if guard in FORCES else NONE
