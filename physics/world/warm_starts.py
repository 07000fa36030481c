"""Contact memory from outside a step: copies of it, and the numbers of a file before a kernel reads them.

Of bodies that meet walls only a copy takes the contacts of a row, and not the zeros between. A block in a box has room
for 24 contacts, and rests on four. A snapshot of a thousand of them is as large as the cache of a processor, so that
its time is that of the memory which it touches.
"""

from __future__ import annotations

import numpy as np

from physics.kernels.compile.compiler_choice import COMPILER, PYTHON
from physics.kernels.compile.decorators import entry_kernel
from physics.kernels.half_space.persistent_contacts import WALL_MEMORY_COUNT, WALL_MEMORY_HEAD
from physics.kernels.multibody.data import arrays as many
from physics.kernels.state import layout as at
from physics.world.batch import Batch
from physics.world.snapshot import KEPT, Snapshot

# Rows from which on to look at each is faster than to copy all numbers.
MANY_ROWS = 64


@entry_kernel
def copy_wall_memory(source, target):
    """Copy rows of contact memory (`half_space.persistent_contacts`); outside its contacts a row is zero.

    Slots out of range, of a table that no step has written, are left out.
    """
    slots = (source.shape[1] - WALL_MEMORY_HEAD) // 4
    first = WALL_MEMORY_HEAD + slots
    for i in range(source.shape[0]):
        for k in range(min(int(target[i, WALL_MEMORY_COUNT]), slots)):
            slot = int(target[i, WALL_MEMORY_HEAD + k])
            if 0 <= slot < slots:
                for c in range(3):
                    target[i, first + 3 * slot + c] = 0.0
        for c in range(first):
            target[i, c] = source[i, c]
        for k in range(min(int(source[i, WALL_MEMORY_COUNT]), slots)):
            slot = int(source[i, WALL_MEMORY_HEAD + k])
            if 0 <= slot < slots:
                for c in range(3):
                    target[i, first + 3 * slot + c] = source[i, first + 3 * slot + c]


def copy_memory(world: Batch, source: np.ndarray, target: np.ndarray) -> None:
    """Copy all of the contact memory of a batch, or of a snapshot of as many of its worlds."""
    is_of_walls = world.plan.contact and not world.plan.many
    if is_of_walls and len(source) >= MANY_ROWS and COMPILER != PYTHON:
        copy_wall_memory(source, target)
    else:
        target[...] = source


def check_numbers(world: Batch, snapshot: Snapshot) -> None:
    """Refuse numbers of a file that no step could have written: kernels take counts and indices from them.

    Raises
    ------
    ValueError
        A state or a parameter is not finite, or the contact memory names contacts that there cannot be.
    """
    parts = dict(zip(KEPT, snapshot.arrays))
    for name in ("state", "params", "gravity"):
        if not (np.abs(parts[name]) <= at.OVERFLOW_LIMIT).all():
            raise ValueError(f"snapshot is {snapshot!r}, of a file whose {name} is not finite; allowed are real states")
    if not world.plan.contact:
        return
    check = _are_contacts_of_bodies if world.plan.many else _are_contacts_of_walls
    if not check(world, parts["memory"]):
        raise ValueError(
            f"snapshot is {snapshot!r}, of a file whose contact memory names contacts that there cannot be; allowed is "
            "what a step has written"
        )


def _are_contacts_of_walls(world: Batch, memory: np.ndarray) -> bool:
    room = (memory.shape[1] - WALL_MEMORY_HEAD) // 4
    slots = memory[:, WALL_MEMORY_HEAD : WALL_MEMORY_HEAD + room]
    counts = memory[:, WALL_MEMORY_COUNT]
    return _are_indices(counts, room + 1) and _are_indices(slots[np.arange(room) < counts[:, None]], room)


def _are_contacts_of_bodies(world: Batch, memory: np.ndarray) -> bool:
    room = (memory.shape[1] - many.WARM_HEADER_SIZE) // many.WARM_CONTACT_SIZE
    counts = memory[:, many.WARM_CONTACT_COUNT]
    if not _are_indices(counts, room + 1):
        return False
    rows = memory[:, many.WARM_HEADER_SIZE :][:, : room * many.WARM_CONTACT_SIZE].reshape(len(memory), room, -1)
    contacts = rows[np.arange(room) < counts[:, None]]
    bodies, walls = world.body_count, len(world.walls)
    return (
        _are_indices(contacts[:, many.WARM_BODY_A], bodies)
        and _are_indices(contacts[:, many.WARM_BODY_B] + walls, bodies + walls)
        and _are_indices(contacts[:, many.WARM_CONTACT_ID], 2**53)
        and (not world.plan.refined or bool(((memory[:, -1] >= 0.0) & (memory[:, -1] <= 1.0)).all()))
    )


def _are_indices(values: np.ndarray, count: int) -> bool:
    """True if all are whole numbers from 0 to below `count`."""
    return bool(((values >= 0) & (values < count) & (values == np.floor(values))).all())
