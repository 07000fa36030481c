"""Regime of a body at the walls: logged as events when it changes, and remembered from step to step."""

from __future__ import annotations

from physics.kernels.compile.decorators import inlined, kernel
from physics.kernels.half_space.contact_point import wall_of
from physics.kernels.time_stepping import event_log as ev
from physics.kernels.time_stepping.contact_stages import MEMORY_HEAD

# State of a body at a wall (`motion.state`).
AWAY, SLIPS, STICKS = range(3)


@kernel
def log_changes(work, motion, log, counts, t):
    """Events of the walls at which the body now does something else."""
    for wall in range(work.walls.shape[0]):
        state = AWAY
        for j in range(motion.count):
            if wall_of(motion.slot[j], work) == wall:
                if motion.holds[j]:
                    state = STICKS
                elif state == AWAY:
                    state = SLIPS
        old = motion.state[wall]
        if state == old:
            continue
        motion.state[wall] = state
        if old == AWAY:
            ev.note_change(log, counts, work.i, t + motion.left_out, ev.TOUCH, wall)
        elif state == AWAY:
            ev.note_change(log, counts, work.i, t, ev.RELEASE, wall)
        else:
            ev.note_change(log, counts, work.i, t, ev.STICK if state == STICKS else ev.SLIP, wall)


@kernel
def keep_contacts(memory, i, work, motion):
    """Store the regime at the walls and the contact forces for later reads (`contact_stages.store_warm_start`)."""
    slots = work.slot.shape[0]
    row = MEMORY_HEAD + slots
    for k in range(int(memory[i, 1])):
        for c in range(3):
            memory[i, row + 3 * int(memory[i, MEMORY_HEAD + k]) + c] = 0.0
    memory[i, 0], memory[i, 1] = 1.0, motion.count
    for j in range(motion.count):
        slot = motion.slot[j]
        memory[i, MEMORY_HEAD + j] = slot
        for c in range(3):
            memory[i, row + 3 * slot + c] = motion.last[slot, c]
    total = 0.0
    for wall in range(work.walls.shape[0] - 1, -1, -1):
        total = 3.0 * total + motion.state[wall]
    memory[i, 2] = 2.0 * total + motion.is_resting


@inlined
def recall_contacts(memory, i, work, motion):
    """Read the regime at the end of the last step, and its forces: the opposite of `keep_contacts`."""
    row = MEMORY_HEAD + work.slot.shape[0]
    for s in range(motion.last.shape[0]):
        for c in range(3):
            motion.last[s, c] = memory[i, row + 3 * s + c]
    total = int(memory[i, 2])  # whether it rested, and base 3 a digit per wall
    motion.is_resting = total % 2
    total //= 2
    for wall in range(work.walls.shape[0]):
        motion.state[wall] = total % 3
        total //= 3
