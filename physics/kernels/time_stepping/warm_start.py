"""Warm start of the contact problem: store the impulses of a body's resting stage, and load them in the next one.

Impulses are stored by contact slot, in the row of the body in `memory` (`persistent_contacts`). `width` is the number
of impulses per contact, 1 without friction and 3 with it.
"""

from __future__ import annotations

from physics.compiler.decorators import cold_kernel, inlined, kernel
from physics.kernels.half_space.persistent_contacts import WALL_MEMORY_COUNT, WALL_MEMORY_HEAD, WALL_MEMORY_STAGE


def wall_memory_size(slots: int) -> int:
    """Number of columns of `memory` for bodies with `slots` possible contacts at walls."""
    return WALL_MEMORY_HEAD + 4 * slots


@inlined
def load_warm_start(n, width, memory, i, h, contacts):
    """Load the impulses of the last resting stage of body i into `contacts.impulse`, scaled to a stage of length h."""
    first = WALL_MEMORY_HEAD + contacts.slot.shape[0]
    scale = 0.0
    if memory[i, WALL_MEMORY_STAGE] > 0.0:
        scale = h / memory[i, WALL_MEMORY_STAGE]
    for k in range(n):
        base = first + 3 * contacts.slot[k]
        for c in range(width):
            contacts.impulse[width * k + c] = memory[i, base + c] * scale


@inlined
def _are_kept(n, memory, i, contacts):
    """True if the last resting stage of body i had the same n contacts as this one, in the same order."""
    if memory[i, WALL_MEMORY_COUNT] != n:
        return False
    for k in range(n):
        if memory[i, WALL_MEMORY_HEAD + k] != contacts.slot[k]:
            return False
    return True


@kernel
def _keep_slots(n, memory, i, contacts):
    """Replace the contacts in the memory of body i by the n contacts of this stage, with zero impulses."""
    first = WALL_MEMORY_HEAD + contacts.slot.shape[0]
    for k in range(int(memory[i, WALL_MEMORY_COUNT])):
        base = first + 3 * int(memory[i, WALL_MEMORY_HEAD + k])
        for c in range(3):
            memory[i, base + c] = 0.0
    memory[i, WALL_MEMORY_COUNT] = n
    for k in range(n):
        memory[i, WALL_MEMORY_HEAD + k] = contacts.slot[k]


@inlined
def store_warm_start(n, width, memory, i, h, contacts):
    """Store the impulses of the n contacts of a resting stage of length h of body i; forget contacts that ended."""
    first = WALL_MEMORY_HEAD + contacts.slot.shape[0]
    memory[i, WALL_MEMORY_STAGE] = h
    if not _are_kept(n, memory, i, contacts):
        _keep_slots(n, memory, i, contacts)
    for k in range(n):
        base = first + 3 * contacts.slot[k]
        for c in range(width):
            memory[i, base + c] = contacts.impulse[width * k + c]


@cold_kernel
def add_to_warm_start(n, width, memory, scratch):
    """Add the impulses in `contacts.rebound` to the stored impulses of the same n contacts.

    They come from `resolve_impacts` and belong to the contact forces of the stage, which users read from `memory`.
    """
    contacts = scratch.contacts
    first = WALL_MEMORY_HEAD + contacts.slot.shape[0]
    for k in range(n):
        base = first + 3 * contacts.slot[k]
        for c in range(width):
            memory[scratch.body.i, base + c] += contacts.rebound[width * k + c]
