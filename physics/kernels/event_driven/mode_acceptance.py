"""Accept or reject steps in a contact mode whose force guards are unreliable.

If a body has more contacts than its motion needs, their forces can be distributed in many ways. The linear system takes
one distribution, which may pull or leave a friction cone where others do not. Then a force guard ends the contact mode,
and the search finds the same mode again. In this case the force guards of the mode are ignored (*distrusted*), and the
contact mode is searched after every step instead. If the acceleration has jumped within the step, another contact mode
had begun before its end; then the step is taken back and shortened.
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

# Length of the first such step in look-aheads, its growth after an accepted step, and its share after a rejected one. A
# slip begins without acceleration. So a slip found a look-ahead late, 1e-5 of the body's time scale, has an error of
# the square of that.
_FIRST_TRUST_STEP = 64.0
TRUST_GROWTH = 4.0
TRUST_SHRINK = 0.25

# Change of acceleration that counts as zero, in weights.
_SAME_ACCELERATION = 1.0e-6

NO_MODE = 0


@inlined
def contact_mode_hash(contacts):
    """Hash of a contact mode: of the slots of its acting contacts, and of which of them stick."""
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
    """Ignore the force guards of the present contact mode from now on; `nearest` is the smallest look-ahead [s]."""
    motion.pace.distrusted_mode = contact_mode_hash(motion.contacts)
    motion.pace.watched_length = _FIRST_TRUST_STEP * nearest


@kernel
def has_acceleration_jumped(what, y, offset_frame, scratch, motion):
    """True if the last step, which ended in the state y, was too long: the acceleration has jumped within it.

    `what` is the contact mode found at y, as a MODE_ code. The acceleration in this mode is compared with that at the
    end of the step.
    """
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
    """Return the contact mode `what`, found at y, or MODE_ROLLBACK if the step that ended at y must be repeated.

    `watched` is the length of this step [s], if it was made without force guards, else 0.
    """
    if watched > motion.pace.min_look_ahead and has_acceleration_jumped(what, y, offset_frame, scratch, motion):
        return MODE_ROLLBACK
    return what
