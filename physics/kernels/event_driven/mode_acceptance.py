"""Judge steps of a contact mode with unreliable force guards, by a search for the contact mode after each.

Where there are more contacts than the body's motion needs, their forces can be distributed in many ways. The linear
system takes one of them, which may leave a cone, or pull, where others do not. The guard then ends the mode, and the
search finds the same mode again. In this case force guards are ignored. The mode is searched after every step instead.
If the acceleration has jumped within the step, another contact mode had begun before its end, and the step is taken
back and shortened.
"""

from __future__ import annotations

from physics.compiler.decorators import inlined, kernel
from physics.kernels.event_driven.contact_candidates import (
    MODE_CONTACT,
    MODE_REST,
    MODE_ROLLBACK,
    MODE_UNDECIDED,
    MODE_UNDECIDED_SLIDING,
)
from physics.kernels.event_driven.extrapolated_midpoint import prepare_extrapolated_step, put_state_row
from physics.kernels.event_driven.workspace import ROW_START, Y_ANGULAR_MOMENTUM, Y_SIZE, Y_VELOCITY

# The first such step in look-aheads, its growth after each that holds, and its share after each that does not: slips
# begin with no acceleration, so that one found a look-ahead late, 1e-5 of the body's time, is off by the square of it.
_FIRST_TRUST_STEP = 64.0
TRUST_GROWTH = 4.0
TRUST_SHRINK = 0.25

# Change of acceleration that is none, in weights.
_SAME_ACCELERATION = 1.0e-6

NO_MODE = 0


@inlined
def contact_mode_hash(contacts):
    """Number that identifies the acting contacts and the sticking ones among them."""
    name = 1
    for j in range(contacts.count):
        name = 131 * name + 2 * contacts.slot[j] + contacts.sticks[j]
    return name


@inlined
def has_trusted_guards(motion):
    """True if the force guards are reliable in this contact mode."""
    return motion.pace.distrusted_mode == NO_MODE or contact_mode_hash(motion.contacts) != motion.pace.distrusted_mode


@inlined
def distrust_force_guards(nearest, motion):
    """Ignore the force guards in this contact mode from now on."""
    motion.pace.distrusted_mode = contact_mode_hash(motion.contacts)
    motion.pace.watched_length = _FIRST_TRUST_STEP * nearest


@kernel
def has_acceleration_jumped(what, y, offset_frame, scratch, motion):
    """True if the step that led to y went too far: the acceleration there does not continue the earlier one."""
    smooth, pace = motion.smooth, motion.pace
    if what in (MODE_REST, MODE_UNDECIDED, MODE_UNDECIDED_SLIDING):
        return False
    if what != MODE_CONTACT:
        return True
    put_state_row(smooth, ROW_START, y)
    pace.step_length = pace.look_ahead
    prepare_extrapolated_step(pace.look_ahead, offset_frame, scratch, motion)
    for c in range(Y_VELOCITY, Y_SIZE):
        unit = smooth.weight / scratch.body.mass if c < Y_ANGULAR_MOMENTUM else smooth.weight * scratch.body.radius
        if abs(smooth.first_rate[c] - pace.end_rate[c]) > _SAME_ACCELERATION * unit:
            return True
    return False


@kernel
def accept_step(what, watched, y, offset_frame, scratch, motion):
    """Judge the contact mode at y; GOES_BACK if the step that led there was too long and must be repeated."""
    if watched > motion.pace.min_look_ahead and has_acceleration_jumped(what, y, offset_frame, scratch, motion):
        return MODE_ROLLBACK
    return what
