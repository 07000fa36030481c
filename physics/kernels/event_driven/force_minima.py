"""Forces that dip below their bounds and come back within one smooth step, unseen at its ends.

The cubic through the margins and their rates at both ends shows such dips, as for gaps. The rates are differences along
the motion. Where the cubic comes close to zero, the step is made up to its lowest point only, and the margin is tested
there.
"""

from __future__ import annotations

import math

from physics.compiler.decorators import inlined, kernel
from physics.kernels.event_driven.contact_forces import recover_contact_forces
from physics.kernels.event_driven.extrapolated_midpoint import compute_state_rate
from physics.kernels.event_driven.guards import FORCE_MARGIN_TOLERANCE, cone_excess
from physics.kernels.event_driven.workspace import ROW_CURRENT, ROW_END, ROW_START, Y_SIZE

# Rows of `motion.contacts.margin`: margins at both ends of a step, and a moment inside of it.
_INSIDE_ROW = 2

# That moment, in steps.
_PROBE_SHARE = 1.0e-4

# A cubic is believed but for this share of the larger margin at its ends, and these need be no better known than this.
# Its lowest point is looked at where it is no nearer to an end of the step than BESIDE of it.
_CUBIC_DOUBT = 0.1
_UNSEEN_MARGIN = 100.0 * FORCE_MARGIN_TOLERANCE
_END_ZONE = 0.02

# Rules after which a step is known to be that of forces which do not change.
_CONSTANT_FORCE_RULES = 2


@kernel
def store_force_margins(row, scratch, motion):
    """Write the margins of push and cone of the acting contacts, from the unknowns, to a row of `margin` [weights]."""
    contacts = motion.contacts
    recover_contact_forces(scratch.body.mu, scratch, motion)
    for j in range(contacts.count):
        contacts.margin[row, 0, j] = contacts.normal[j] / motion.smooth.weight
        contacts.margin[row, 1, j] = math.inf
        if contacts.sticks[j]:
            contacts.margin[row, 1, j] = -cone_excess(j, scratch, contacts) / motion.smooth.weight


@inlined
def _probe_margins(row, t, moment, offset_frame, scratch, motion):
    """Write the margins of the forces at t + `moment` [s] into the row `_INSIDE_ROW`.

    The state there is extrapolated from a row of `motion.smooth.y`, by the rate of change `motion.smooth.rate`.
    """
    for c in range(Y_SIZE):
        motion.smooth.y[ROW_CURRENT, c] = motion.smooth.y[row, c] + moment * motion.smooth.rate[c]
    compute_state_rate(ROW_CURRENT, t + moment, offset_frame, scratch, motion)
    store_force_margins(_INSIDE_ROW, scratch, motion)


@inlined
def _cubic_interior_minimum(low, fall, high, rise, h):
    """Lowest point within h of a cubic that begins at `low` and falls, and ends at `high` and rises: (time, value)."""
    c = (3.0 * (high - low) / h - 2.0 * fall - rise) / h
    k = (fall + rise - 2.0 * (high - low) / h) / (h * h)
    t = -fall / (c + math.sqrt(c * c - 3.0 * k * fall))
    return t, low + t * (fall + t * (c + t * k))


@kernel
def find_force_minimum(h, used, offset_frame, scratch, motion):
    """Earliest time within the step of h to END at which a margin of force may be used up; h without one.

    START of `margin` holds the data of the start of the step; forces, rates and unknowns are those of END.
    """
    contacts, smooth = motion.contacts, motion.smooth
    if contacts.count == 0 or used <= _CONSTANT_FORCE_RULES or not smooth.weight > 0.0:
        return h
    moment = _PROBE_SHARE * h
    falls = False
    store_force_margins(ROW_END, scratch, motion)
    for c in range(Y_SIZE):
        smooth.last_rate[c], smooth.rate[c] = smooth.rate[c], smooth.first_rate[c]
    _probe_margins(ROW_START, 0.0, moment, offset_frame, scratch, motion)
    for sort in range(2):
        for j in range(contacts.count):
            contacts.margin_rate[sort, j] = (
                contacts.margin[_INSIDE_ROW, sort, j] - contacts.margin[ROW_START, sort, j]
            ) / moment
            falls = falls or contacts.margin_rate[sort, j] < 0.0
    first = h
    if falls:
        for c in range(Y_SIZE):
            smooth.rate[c] = smooth.last_rate[c]
        _probe_margins(ROW_END, h, -moment, offset_frame, scratch, motion)
        for sort in range(2):
            for j in range(contacts.count):
                low, high, fall = (
                    contacts.margin[ROW_START, sort, j],
                    contacts.margin[ROW_END, sort, j],
                    contacts.margin_rate[sort, j],
                )
                rise = (high - contacts.margin[_INSIDE_ROW, sort, j]) / moment
                if not (fall < 0.0 < rise and max(low, high) > _UNSEEN_MARGIN and max(low, high) < math.inf):
                    continue
                t, value = _cubic_interior_minimum(low, fall, high, rise, h)
                if value < _CUBIC_DOUBT * max(low, high) and (
                    value < -FORCE_MARGIN_TOLERANCE or _END_ZONE * h < t < h - _END_ZONE * h
                ):
                    first = min(first, t)
    if not 0.0 < first < h:
        first = h
        compute_state_rate(ROW_END, h, offset_frame, scratch, motion)
        recover_contact_forces(scratch.body.mu, scratch, motion)
    return first
