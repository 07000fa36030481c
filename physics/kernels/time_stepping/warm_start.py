"""Warm start of the contact problem: impulses of the last resting stage of a body, by slot."""

from __future__ import annotations

from physics.compiler.decorators import cold_kernel, inlined, kernel
from physics.kernels.half_space.persistent_contacts import WALL_MEMORY_COUNT, WALL_MEMORY_HEAD, WALL_MEMORY_STAGE


def wall_memory_size(slots: int) -> int:
    """Columns of `memory` for bodies with `slots` possible contacts."""
    return WALL_MEMORY_HEAD + 4 * slots


@inlined
def load_warm_start(n, width, memory, i, h, contacts):
    """Load impulses of the last resting stage, by slot, scaled to a stage of length h."""
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
    """True if the contacts of the last resting stage are those of this one, in the same order."""
    if memory[i, WALL_MEMORY_COUNT] != n:
        return False
    for k in range(n):
        if memory[i, WALL_MEMORY_HEAD + k] != contacts.slot[k]:
            return False
    return True


@kernel
def _keep_slots(n, memory, i, contacts):
    """Replace the contacts of the last resting stage by those of this one, with zero impulses."""
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
    """Keep the impulses of this resting stage by slot, and drop those of contacts that have ended."""
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
    """Add the impulses in `contacts.rebound` to those of the same contacts in the resting stage, which forces read."""
    contacts = scratch.contacts
    first = WALL_MEMORY_HEAD + contacts.slot.shape[0]
    for k in range(n):
        base = first + 3 * contacts.slot[k]
        for c in range(width):
            memory[scratch.body.i, base + c] += contacts.rebound[width * k + c]
