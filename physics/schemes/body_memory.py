"""Contact memory of bodies that touch each other, a row for each world.

The kernels write it in `physics.kernels.multibody.data.warm_start`.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from physics.compiler.decorators import entry_kernel, kernel
from physics.kernels.multibody.data import allocation
from physics.kernels.multibody.data import arrays as many
from physics.scene.parts import part_count
from physics.scene.polyhedra import polyhedra
from physics.scene.scene import Scene
from physics.schemes.contact_memory import ContactMemory, are_indices, call
from physics.schemes.contacts import EVERY_BODY, Contacts, Strongest, keep_strongest, put_force_and_impulse


@kernel
def _ends(i, k, memory):
    """Read the ends of contact `k` of world `i`: (its first column, first body, second body or -1 - wall)."""
    row = many.WARM_HEADER_SIZE + many.WARM_CONTACT_SIZE * k
    return row, int(memory[i, row + many.WARM_BODY_A]), int(memory[i, row + many.WARM_BODY_B])


@kernel
def _choose(world, body, memory, strongest):
    """Choose the strongest contacts of a world, or of a `body` in it: (number chosen, number of all contacts).

    The chosen contacts are written into `strongest`.
    """
    kept, count, length = 0, 0, memory[world, many.WARM_STAGE_LENGTH]
    for k in range(int(memory[world, many.WARM_CONTACT_COUNT])):
        row, a, b = _ends(world, k, memory)
        if body == EVERY_BODY or a == body or b == body:
            p = row + many.WARM_IMPULSE
            size = (memory[world, p] ** 2 + memory[world, p + 1] ** 2 + memory[world, p + 2] ** 2) / length**2
            kept = keep_strongest(kept, k, size, strongest)
            count += 1
    return kept, count


@kernel
def _read(indices, body, memory, strongest, out):
    """Read the contacts of the worlds `indices` into `out`.

    With a `body` other than `EVERY_BODY` only its contacts are read, with it as their first body.
    """
    for n in range(indices.shape[0]):
        world = indices[n]
        kept, out.count[n] = _choose(world, body, memory, strongest)
        for shown in range(kept):
            row, a, b = _ends(world, strongest.place[shown], memory)
            sign, p = 1.0, row + many.WARM_IMPULSE
            if b >= 0 and b == body:
                a, b, sign = b, a, -1.0
            out.ends[n, shown, 0], out.ends[n, shown, 1] = a, b
            for c in range(3):
                out.point[n, shown, c] = memory[world, row + many.WARM_POINT + c]
            impulse = (sign * memory[world, p], sign * memory[world, p + 1], sign * memory[world, p + 2])
            put_force_and_impulse(n, shown, impulse, memory[world, many.WARM_STAGE_LENGTH], 1.0, out)


@entry_kernel
def _add_forces(indices, memory, out):
    for n in range(indices.shape[0]):
        i = indices[n]
        length = memory[i, many.WARM_STAGE_LENGTH]
        if length == 0.0:  # nothing touched yet
            continue
        for k in range(int(memory[i, many.WARM_CONTACT_COUNT])):
            row, a, b = _ends(i, k, memory)
            for j in range(3):
                force = memory[i, row + many.WARM_IMPULSE + j] / length
                out[n, a, j] += force
                if b >= 0:
                    out[n, b, j] -= force


def contact_capacity(memory: np.ndarray, laws: tuple[str, ...] = ()) -> int:
    """Number of contacts for which a row of this memory has room, in a scene with these contact laws."""
    return (memory.shape[1] - many.WARM_HEADER_SIZE) // allocation.warm_contact_size(laws)


class BodyMemory(ContactMemory):
    """Memory of the contacts of bodies with each other and with walls, a row for each world.

    Parameters
    ----------
    keeps_part : bool
        Whether the last column keeps the length of a part of a substep, with which error control begins the next
        substep.
    """

    def __init__(self, keeps_part: bool = False):
        self._keeps_part = keeps_part

    def shape(self, scene: Scene, switches: Any, worlds: int) -> tuple[int, int]:
        parts, walls = part_count(scene.bodies), len(scene.walls)
        return worlds, allocation.warm_start_size(
            parts, walls, polyhedra(scene.bodies), self._keeps_part, switches.laws, switches.cylinders
        )

    def rows_per_world(self, bodies: int) -> int:
        return 1

    def is_valid(self, worlds: Any, memory: np.ndarray) -> bool:
        room, counts = contact_capacity(memory, worlds.plan.laws), memory[:, many.WARM_CONTACT_COUNT]
        if not are_indices(counts, room + 1):
            return False
        rows = memory[:, many.WARM_HEADER_SIZE :][:, : room * many.WARM_CONTACT_SIZE].reshape(len(memory), room, -1)
        contacts = rows[np.arange(room) < counts[:, None]]
        bodies, walls = worlds.body_count, len(worlds.walls)
        return (
            are_indices(contacts[:, many.WARM_BODY_A], bodies)
            and are_indices(contacts[:, many.WARM_BODY_B] + walls, bodies + walls)
            and are_indices(contacts[:, many.WARM_CONTACT_ID], 2**53)
            and (not self._keeps_part or bool(((memory[:, -1] >= 0.0) & (memory[:, -1] <= 1.0)).all()))
        )

    def room(self, worlds: Any) -> int:
        return contact_capacity(worlds.memory, worlds.plan.laws)

    def count(self, worlds: Any, index: int) -> int:
        return int(worlds.memory[index, many.WARM_CONTACT_COUNT])

    def read(self, worlds: Any, indices: np.ndarray, body: int, strongest: Strongest, out: Contacts) -> None:
        call(_read, indices, body, worlds.memory, strongest, out)

    def add_forces(self, worlds: Any, indices: np.ndarray, out: np.ndarray) -> None:
        _add_forces(indices, worlds.memory, out)

    def durations(self, worlds: Any, indices: np.ndarray) -> Any:
        return worlds.memory[indices, many.WARM_STAGE_LENGTH, None, None]
