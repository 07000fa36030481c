"""Log changes of a body's contact mode as events, and store the mode from one step to the next."""

from __future__ import annotations

from physics.compiler.decorators import inlined, kernel
from physics.kernels.half_space.contact_point import wall_of
from physics.kernels.half_space.persistent_contacts import WALL_MEMORY_HEAD
from physics.kernels.time_stepping import event_log as ev

# State of a body at a wall (`motion.smooth.wall_state`).
WALL_SEPARATED, WALL_SLIPPING, WALL_STICKING = range(3)


@kernel
def log_mode_changes(scratch, motion, log, counts, t):
    """Log an event for each wall at which the contact mode has changed: touch, release, stick or slip.

    t is the time after the start of the call [s].
    """
    body = scratch.body
    for wall in range(scratch.scene.walls.shape[0]):
        state = WALL_SEPARATED
        for j in range(motion.contacts.count):
            if wall_of(motion.contacts.slot[j], scratch.scene) == wall:
                if motion.contacts.sticks[j]:
                    state = WALL_STICKING
                elif state == WALL_SEPARATED:
                    state = WALL_SLIPPING
        old = motion.smooth.wall_state[wall]
        if state == old:
            continue
        motion.smooth.wall_state[wall] = state
        if old == WALL_SEPARATED:
            ev.note_mode_change(log, counts, body.i, t + motion.pace.skipped_bounce_time, ev.KIND_TOUCH, wall)
        elif state == WALL_SEPARATED:
            ev.note_mode_change(log, counts, body.i, t, ev.KIND_RELEASE, wall)
        else:
            ev.note_mode_change(log, counts, body.i, t, ev.KIND_STICK if state == WALL_STICKING else ev.KIND_SLIP, wall)


@kernel
def store_contact_modes(memory, i, scratch, motion):
    """Store the contact mode and the contact forces of body i in its row of `memory`, for the next step.

    The row has the same form as in time stepping (`time_stepping.warm_start.store_warm_start`).
    """
    contacts = motion.contacts
    slots = scratch.contacts.slot.shape[0]
    row = WALL_MEMORY_HEAD + slots
    for k in range(int(memory[i, 1])):
        for c in range(3):
            memory[i, row + 3 * int(memory[i, WALL_MEMORY_HEAD + k]) + c] = 0.0
    memory[i, 0], memory[i, 1] = 1.0, contacts.count
    for j in range(contacts.count):
        slot = contacts.slot[j]
        memory[i, WALL_MEMORY_HEAD + j] = slot
        for c in range(3):
            memory[i, row + 3 * slot + c] = contacts.last_force[slot, c]
    total = 0.0
    for wall in range(scratch.scene.walls.shape[0] - 1, -1, -1):
        total = 3.0 * total + motion.smooth.wall_state[wall]
    memory[i, 2] = 2.0 * total + motion.smooth.is_resting


@inlined
def load_contact_modes(memory, i, scratch, motion):
    """Load the contact mode and the contact forces of body i at the end of the last step from its row of `memory`."""
    row = WALL_MEMORY_HEAD + scratch.contacts.slot.shape[0]
    for s in range(motion.contacts.last_force.shape[0]):
        for c in range(3):
            motion.contacts.last_force[s, c] = memory[i, row + 3 * s + c]
    total = int(memory[i, 2])  # a bit that tells whether the body rests, then a digit to base 3 for each wall
    motion.smooth.is_resting = total % 2
    total //= 2
    for wall in range(scratch.scene.walls.shape[0]):
        motion.smooth.wall_state[wall] = total % 3
        total //= 3
