"""Find force margins that fall below zero and come back within one smooth step, unseen at its ends.

A force margin is that of a force guard (`guards`). The cubic through a margin and its rates at both ends of the step
shows such dips, as for gaps. The rates are differences along the motion. If the cubic comes close to zero, the step is
made only up to the cubic's lowest point, and the margin is tested there.
"""

from __future__ import annotations

import math

from physics.compiler.decorators import inlined, kernel
from physics.kernels.event_driven.contact_forces import recover_contact_forces
from physics.kernels.event_driven.extrapolated_midpoint import compute_state_rate
from physics.kernels.event_driven.guards import FORCE_MARGIN_TOLERANCE, cone_excess
from physics.kernels.event_driven.workspace import ROW_CURRENT, ROW_END, ROW_START, Y_SIZE

# Row of `motion.contacts.margin` for a state a short time inside the step; rows ROW_START and ROW_END are its ends.
_INSIDE_ROW = 2

# This short time, as a share of the step.
_PROBE_SHARE = 1.0e-4

# The error of a cubic is at most this share of the larger margin at its ends. Steps with both margins below
# _UNSEEN_MARGIN are not tested. The lowest point of the cubic is tested if it is at least _END_ZONE steps from both
# ends, or below zero.
_CUBIC_DOUBT = 0.1
_UNSEEN_MARGIN = 100.0 * FORCE_MARGIN_TOLERANCE
_END_ZONE = 0.02

# A step that needed at most this many midpoint rules has constant forces.
_CONSTANT_FORCE_RULES = 2


@kernel
def store_force_margins(row, scratch, motion):
    """Write the push and cone margins of the acting contacts [weights] to a row of `motion.contacts.margin`.

    They belong to the contact forces that were solved last, in `motion.unknowns`.
    """
    contacts = motion.contacts
    recover_contact_forces(scratch.body.mu, scratch, motion)
    for j in range(contacts.count):
        contacts.margin[row, 0, j] = contacts.normal[j] / motion.smooth.weight
        contacts.margin[row, 1, j] = math.inf
        if contacts.sticks[j]:
            contacts.margin[row, 1, j] = -cone_excess(j, scratch, contacts) / motion.smooth.weight


@inlined
def _probe_margins(row, t, moment, offset_frame, scratch, motion):
    """Write the force margins at the time t + `moment` [s] of the step into the row `_INSIDE_ROW` of margins.

    The state at this time is extrapolated from `row` of `motion.smooth.y`, the state at t, by `motion.smooth.rate`.
    """
    for c in range(Y_SIZE):
        motion.smooth.y[ROW_CURRENT, c] = motion.smooth.y[row, c] + moment * motion.smooth.rate[c]
    compute_state_rate(ROW_CURRENT, t + moment, offset_frame, scratch, motion)
    store_force_margins(_INSIDE_ROW, scratch, motion)


@inlined
def _cubic_interior_minimum(low, fall, high, rise, h):
    """Lowest point on [0, h] of the cubic with the value `low` and the slope `fall` < 0 at 0, `high` and `rise` at h.

    Returns (time, value).
    """
    c = (3.0 * (high - low) / h - 2.0 * fall - rise) / h
    k = (fall + rise - 2.0 * (high - low) / h) / (h * h)
    t = -fall / (c + math.sqrt(c * c - 3.0 * k * fall))
    return t, low + t * (fall + t * (c + t * k))


@kernel
def find_force_minimum(h, used, offset_frame, scratch, motion):
    """Earliest time within a step of h [s] at which a force margin may be used up; h if there is none.

    `used` is the number of midpoint rules of the step. The margins at its start must be in ROW_START of
    `motion.contacts.margin`; forces, rate and unknowns must be those of its end, and they are again afterwards.
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
