"""Contact memory of bodies that meet walls only, a row for each body.

The kernels write it in `physics.kernels.half_space.persistent_contacts`.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from physics.compiler.decorators import backend, entry_kernel, kernel
from physics.kernels.half_space.gap_queries import feature_point
from physics.kernels.half_space.persistent_contacts import WALL_MEMORY_COUNT, WALL_MEMORY_HEAD, WALL_MEMORY_STAGE
from physics.kernels.state import layout as at
from physics.kernels.time_stepping.warm_start import wall_memory_size
from physics.scene.scene import Scene
from physics.schemes.contact_memory import ContactMemory, are_indices, call
from physics.schemes.contacts import EVERY_BODY, Contacts, Strongest, keep_strongest, put_force_and_impulse

# From this number of rows on it is faster to copy the contacts of each row than all its numbers.
MANY_ROWS = 64


def slots_of(memory: np.ndarray) -> int:
    """Number of contacts for which a row of this memory has room."""
    return (memory.shape[1] - WALL_MEMORY_HEAD) // 4


@kernel
def _slot(i, k, memory):
    """Contact slot (wall * features + feature) of contact `k` of the body with row `i`."""
    return int(memory[i, WALL_MEMORY_HEAD + k])


@kernel
def _impulse(i, slot, memory):
    """Impulse at a contact slot of the body with row `i`: along the wall's normal and both tangents [N s]."""
    first = WALL_MEMORY_HEAD + (memory.shape[1] - WALL_MEMORY_HEAD) // 4 + 3 * slot
    return (memory[i, first], memory[i, first + 1], memory[i, first + 2])


@entry_kernel
def copy_wall_memory(source, target):
    """Copy the rows of one contact memory into another, but touch only the numbers of contacts.

    A block in a box has room for 24 contacts and rests on four, so that most numbers of a row are zero. A snapshot of a
    thousand such rows is as large as the cache of a processor, and touching less memory saves time. Slots out of range,
    as in a table that no step has written, are skipped.
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


class WallArrays(NamedTuple):
    """Arrays of a batch from which contacts with walls are read; see `physics.world.batch.Batch`."""

    memory: np.ndarray
    state: np.ndarray
    params: np.ndarray
    shapes: np.ndarray
    walls: np.ndarray


@kernel
def _choose(world, body, arrays, strongest):
    """Choose the strongest contacts of a world, or of a `body` in it: (number chosen, number of all contacts).

    The chosen contacts are written into `strongest`.
    """
    memory, bodies = arrays.memory, arrays.shapes.shape[0]
    kept, count, room = 0, 0, (arrays.memory.shape[1] - WALL_MEMORY_HEAD) // 4
    for b in range(bodies):
        i = world * bodies + b
        if body == EVERY_BODY or b == body:
            for k in range(int(memory[i, WALL_MEMORY_COUNT])):
                p = _impulse(i, _slot(i, k, memory), memory)
                size = (p[0] * p[0] + p[1] * p[1] + p[2] * p[2]) / memory[i, WALL_MEMORY_STAGE] ** 2
                kept = keep_strongest(kept, b * room + k, size, strongest)
                count += 1
    return kept, count


@kernel
def _write(n, row, b, i, k, features, duration, arrays, out):
    """Write contact `k` of body `b`, whose row of the state is `i`, into row `row` of world `n` of `out`."""
    slot = _slot(i, k, arrays.memory)
    p, wall = _impulse(i, slot, arrays.memory), slot // features
    w = arrays.walls[wall]
    impulse = (
        p[0] * w[at.WALL_NORMAL] + p[1] * w[at.WALL_NORMAL + 3] + p[2] * w[at.WALL_NORMAL + 6],
        p[0] * w[at.WALL_NORMAL + 1] + p[1] * w[at.WALL_NORMAL + 4] + p[2] * w[at.WALL_NORMAL + 7],
        p[0] * w[at.WALL_NORMAL + 2] + p[1] * w[at.WALL_NORMAL + 5] + p[2] * w[at.WALL_NORMAL + 8],
    )
    normal = (w[at.WALL_NORMAL], w[at.WALL_NORMAL + 1], w[at.WALL_NORMAL + 2])
    point = feature_point(arrays.state, arrays.params, arrays.shapes[b], normal, i, slot - features * wall)
    out.point[n, row, 0], out.point[n, row, 1], out.point[n, row, 2] = point
    out.ends[n, row, 0], out.ends[n, row, 1] = b, -1 - wall
    put_force_and_impulse(n, row, impulse, arrays.memory[i, WALL_MEMORY_STAGE], duration, out)


@kernel
def _read(indices, body, features, duration, arrays, strongest, out):
    """Read the contacts of the worlds `indices`, of one body or of `EVERY_BODY`, into `out`.

    Impulses are those in the memory times `duration`; `features` is the number of features of a body.
    """
    bodies, room = arrays.shapes.shape[0], (arrays.memory.shape[1] - WALL_MEMORY_HEAD) // 4
    for n in range(indices.shape[0]):
        kept, out.count[n] = _choose(indices[n], body, arrays, strongest)
        for row in range(kept):
            b = strongest.place[row] // room
            k = strongest.place[row] - room * b
            _write(n, row, b, indices[n] * bodies + b, k, features, duration, arrays, out)


@entry_kernel
def _add_forces(indices, memory, walls, features, out):
    bodies = out.shape[1]
    for n in range(indices.shape[0]):
        for b in range(bodies):
            i = indices[n] * bodies + b
            for k in range(int(memory[i, WALL_MEMORY_COUNT])):
                slot = _slot(i, k, memory)
                p, wall = _impulse(i, slot, memory), slot // features
                for j in range(3):
                    axis = at.WALL_NORMAL + 3 * j
                    impulse = p[j] / memory[i, WALL_MEMORY_STAGE]
                    for c in range(3):
                        out[n, b, c] += impulse * walls[wall, axis + c]


class WallMemory(ContactMemory):
    """Memory of the contacts of bodies with walls, a row for each body.

    Parameters
    ----------
    holds_forces : bool
        Whether the memory holds forces, written as impulses of a stage of 1 s, for a scheme without stages.
    """

    def __init__(self, holds_forces: bool = False):
        self._holds_forces = holds_forces

    def shape(self, scene: Scene, switches: Any, worlds: int) -> tuple[int, int]:
        rows = worlds * len(scene.bodies) if switches.contact else 1
        return rows, wall_memory_size(max(len(scene.walls) * switches.features, 1))

    def rows_per_world(self, bodies: int) -> int:
        return bodies

    def copy(self, source: np.ndarray, target: np.ndarray) -> None:
        if len(source) >= MANY_ROWS and backend.MAKES_MACHINE_CODE:
            copy_wall_memory(source, target)
        else:
            target[...] = source

    def is_valid(self, worlds: Any, memory: np.ndarray) -> bool:
        room = slots_of(memory)
        slots = memory[:, WALL_MEMORY_HEAD : WALL_MEMORY_HEAD + room]
        counts = memory[:, WALL_MEMORY_COUNT]
        return are_indices(counts, room + 1) and are_indices(slots[np.arange(room) < counts[:, None]], room)

    def room(self, worlds: Any) -> int:
        return worlds.body_count * slots_of(worlds.memory)

    def count(self, worlds: Any, index: int) -> int:
        rows = worlds.memory[index * worlds.body_count : (index + 1) * worlds.body_count]
        return int(rows[:, WALL_MEMORY_COUNT].sum())

    def read(self, worlds: Any, indices: np.ndarray, body: int, strongest: Strongest, out: Contacts) -> None:
        arrays = WallArrays(worlds.memory, worlds.state, worlds.params, worlds.shapes, worlds.walls)
        duration = worlds.dt if self._holds_forces else 1.0
        call(_read, indices, body, worlds.plan.features, duration, arrays, strongest, out)

    def add_forces(self, worlds: Any, indices: np.ndarray, out: np.ndarray) -> None:
        _add_forces(indices, worlds.memory, worlds.walls, worlds.plan.features, out)

    def durations(self, worlds: Any, indices: np.ndarray) -> Any:
        if self._holds_forces:
            return worlds.dt
        return worlds.memory[:, WALL_MEMORY_STAGE].reshape(worlds.worlds, worlds.body_count)[indices, :, None]
