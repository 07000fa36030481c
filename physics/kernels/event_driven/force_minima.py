"""Forces that fall below what they may, and come back, within one smooth step: not seen at its ends.

As for gaps, the cubic through the margins at both ends and their rates shows it. The rates are differences along the
motion. Where the cubic comes close to zero the step is made up to its lowest point only, and looked at there.
"""

from __future__ import annotations

import math

from physics.kernels.compile.decorators import inlined, kernel
from physics.kernels.event_driven.contact_forces import spread
from physics.kernels.event_driven.extrapolated_midpoint import find_rate
from physics.kernels.event_driven.guards import MARGIN, cone_excess
from physics.kernels.event_driven.workspace import END, NOW, SIZE, START

# Rows of `motion.margin`: margins at both ends of a step, and a moment inside of it.
INSIDE = 2

# That moment, in steps.
MOMENT = 1.0e-4

# A cubic is believed but for this share of the larger margin at its ends, and these need be no better known than this.
# Its lowest point is looked at where it is no nearer to an end of the step than BESIDE of it.
DOUBT = 0.1
UNSEEN = 100.0 * MARGIN
BESIDE = 0.02

# Rules after which a step is known to be that of forces which do not change.
CONSTANT = 2


@kernel
def note_margins(row, work, motion):
    """Margins of push and cone of the contacts that act, from the unknowns, into a row of `margin` [weights]."""
    spread(work.mu, work, motion)
    for j in range(motion.count):
        motion.margin[row, 0, j] = motion.normal[j] / motion.weight
        motion.margin[row, 1, j] = math.inf
        if motion.holds[j]:
            motion.margin[row, 1, j] = -cone_excess(j, work, motion) / motion.weight


@inlined
def _look_inside(row, t, moment, tilted, work, motion):
    """Margins `moment` after a row of `y` at the time t, of the rate of change `rate`, into INSIDE."""
    for c in range(SIZE):
        motion.y[NOW, c] = motion.y[row, c] + moment * motion.rate[c]
    find_rate(NOW, t + moment, tilted, work, motion)
    note_margins(INSIDE, work, motion)


@inlined
def _lowest(low, fall, high, rise, h):
    """Lowest point within h of a cubic that begins at `low` and falls, and ends at `high` and rises: (time, value)."""
    c = (3.0 * (high - low) / h - 2.0 * fall - rise) / h
    k = (fall + rise - 2.0 * (high - low) / h) / (h * h)
    t = -fall / (c + math.sqrt(c * c - 3.0 * k * fall))
    return t, low + t * (fall + t * (c + t * k))


@kernel
def find_dip(h, used, tilted, work, motion):
    """The time within the step of h to END at which a margin of force may be used up, h where there is none.

    What is known of the start of the step is in START of `margin`; forces, rates and unknowns are those of END.
    """
    if motion.count == 0 or used <= CONSTANT or not motion.weight > 0.0:
        return h
    moment = MOMENT * h
    falls = False
    note_margins(END, work, motion)
    for c in range(SIZE):
        motion.last_rate[c], motion.rate[c] = motion.rate[c], motion.first_rate[c]
    _look_inside(START, 0.0, moment, tilted, work, motion)
    for sort in range(2):
        for j in range(motion.count):
            motion.fall[sort, j] = (motion.margin[INSIDE, sort, j] - motion.margin[START, sort, j]) / moment
            falls = falls or motion.fall[sort, j] < 0.0
    first = h
    if falls:
        for c in range(SIZE):
            motion.rate[c] = motion.last_rate[c]
        _look_inside(END, h, -moment, tilted, work, motion)
        for sort in range(2):
            for j in range(motion.count):
                low, high, fall = motion.margin[START, sort, j], motion.margin[END, sort, j], motion.fall[sort, j]
                rise = (high - motion.margin[INSIDE, sort, j]) / moment
                if not (fall < 0.0 < rise and max(low, high) > UNSEEN and max(low, high) < math.inf):
                    continue
                t, value = _lowest(low, fall, high, rise, h)
                if value < DOUBT * max(low, high) and (value < -MARGIN or BESIDE * h < t < h - BESIDE * h):
                    first = min(first, t)
    if not 0.0 < first < h:
        first = h
        find_rate(END, h, tilted, work, motion)
        spread(work.mu, work, motion)
    return first
