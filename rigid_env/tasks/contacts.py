"""Contacts of many worlds as arrays with a fixed number of rows for each world.

They are read from the contact memory, which `physics.World.contacts` reads for one world. Compiled, one call for all
worlds.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from physics.kernels.compile.decorators import kernel
from physics.kernels.half_space.gap_queries import feature_point
from physics.kernels.half_space.persistent_contacts import WALL_MEMORY_COUNT, WALL_MEMORY_HEAD, WALL_MEMORY_STAGE
from physics.kernels.multibody.data import arrays as many
from physics.kernels.state import layout as at
from physics.parallel.bound_call import compiled
from physics.world.world import World

ROWS_PER_BODY = 12
"""Rows of `Worlds.contacts` for each body: a block in a corner touches three walls with four vertices each."""

EVERY_BODY = -1
"""In place of a body: the contacts of all of them."""


class Contacts(NamedTuple):
    """Contacts of n worlds in the last physics step, in the order of `physics.World.contacts`.

    A world with more contacts than there are rows shows those with the largest forces; of equal forces, the first.
    Rows without a contact are zero.

    Force and impulse are those of the last resting stage, as the contact solver worked them out. A stage is the whole
    physics step where the accuracy has one substep and nothing collides in the step. Otherwise it is the end of the
    step: the last substep, or what is left of it after the last collision. **Impulses of collisions are not among
    them**: the memory does not hold them. A collision so slow that a resting stage stops it is part of that stage.

    Event-driven accuracies have no stages where bodies meet walls only. The force is then the last one that was worked
    out in the step, and the impulse is this force times the physics step.

    A body that sleeps keeps the contacts with which it fell asleep. Between a reset and the first step there are none.

    Attributes
    ----------
    count : (n,) int64
        Contacts that there are; more than the rows, where some are left out.
    point : (n, rows, 3) float64
        World frame [m].
    force : (n, rows, 3) float64
        Mean over the stage, on the first body, world frame [N].
    impulse : (n, rows, 3) float64
        Of the stage, on the first body: the force times the length of the stage, world frame [N s].
    ends : (n, rows, 2) int64
        First body; other body, or -1 - k for wall k.
    """

    count: np.ndarray
    point: np.ndarray
    force: np.ndarray
    impulse: np.ndarray
    ends: np.ndarray


class Strongest(NamedTuple):
    """Contacts of one world that are to be shown, in their order."""

    place: np.ndarray  # (rows,) int, place of the contact in its memory
    size: np.ndarray  # (rows,) square of its force [N²]


class WallArrays(NamedTuple):
    """Arrays of a batch whose bodies meet walls only."""

    memory: np.ndarray
    state: np.ndarray
    params: np.ndarray
    shapes: np.ndarray
    walls: np.ndarray


@kernel
def _keep(kept, place, size, strongest):
    """Append a contact to those that are kept, where these are full in place of the weakest: how many there are now."""
    rows = strongest.size.shape[0]
    if kept == rows:
        weakest = 0
        for k in range(1, rows):
            if strongest.size[k] <= strongest.size[weakest]:
                weakest = k
        if not size > strongest.size[weakest]:
            return kept
        for k in range(weakest, rows - 1):
            strongest.place[k], strongest.size[k] = strongest.place[k + 1], strongest.size[k + 1]
        kept -= 1
    strongest.place[kept], strongest.size[kept] = place, size
    return kept + 1


@kernel
def _put(n, row, impulse, length, duration, out):
    """Write force and impulse of a contact from what its memory has for a stage of this length [s]."""
    for c in range(3):
        out.force[n, row, c] = impulse[c] / length
        out.impulse[n, row, c] = impulse[c] * duration


@kernel
def _wall_impulse(i, k, memory):
    """Slot and impulse of contact k of row i: normal, tangents of the wall."""
    slot = int(memory[i, WALL_MEMORY_HEAD + k])
    first = WALL_MEMORY_HEAD + (memory.shape[1] - WALL_MEMORY_HEAD) // 4 + 3 * slot
    return slot, (memory[i, first], memory[i, first + 1], memory[i, first + 2])


@kernel
def _choose_wall_contacts(world, body, arrays, strongest):
    """Choose the contacts of one world that are shown: how many, and how many there are."""
    memory, bodies = arrays.memory, arrays.shapes.shape[0]
    kept, count, room = 0, 0, (arrays.memory.shape[1] - WALL_MEMORY_HEAD) // 4
    for b in range(bodies):
        i = world * bodies + b
        if body == EVERY_BODY or b == body:
            for k in range(int(memory[i, WALL_MEMORY_COUNT])):
                _, p = _wall_impulse(i, k, memory)
                size = (p[0] * p[0] + p[1] * p[1] + p[2] * p[2]) / memory[i, WALL_MEMORY_STAGE] ** 2
                kept = _keep(kept, b * room + k, size, strongest)
                count += 1
    return kept, count


@kernel
def _write_wall_contact(n, row, b, i, k, features, duration, arrays, out):
    """Write contact k of body b, which has row i of the state."""
    slot, p = _wall_impulse(i, k, arrays.memory)
    wall = slot // features
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
    _put(n, row, impulse, arrays.memory[i, WALL_MEMORY_STAGE], duration, out)


@kernel
def _read_wall_contacts(indices, body, features, duration, arrays, strongest, out):
    """Contacts of bodies that meet walls only; the impulse of a stage is `duration` times that in the memory."""
    bodies, room = arrays.shapes.shape[0], (arrays.memory.shape[1] - WALL_MEMORY_HEAD) // 4
    for n in range(indices.shape[0]):
        kept, out.count[n] = _choose_wall_contacts(indices[n], body, arrays, strongest)
        for row in range(kept):
            b = strongest.place[row] // room
            k = strongest.place[row] - room * b
            _write_wall_contact(n, row, b, indices[n] * bodies + b, k, features, duration, arrays, out)


@kernel
def _choose_contacts(world, body, memory, strongest):
    """Choose the contacts of one world that are shown, of bodies that touch each other: how many, of how many."""
    kept, count, length = 0, 0, memory[world, many.WARM_STAGE_LENGTH]
    for k in range(int(memory[world, many.WARM_CONTACT_COUNT])):
        row = many.WARM_HEADER_SIZE + many.WARM_CONTACT_SIZE * k
        a, b = int(memory[world, row + many.WARM_BODY_A]), int(memory[world, row + many.WARM_BODY_B])
        if body == EVERY_BODY or a == body or b == body:
            p = row + many.WARM_IMPULSE
            size = (memory[world, p] ** 2 + memory[world, p + 1] ** 2 + memory[world, p + 2] ** 2) / length**2
            kept = _keep(kept, k, size, strongest)
            count += 1
    return kept, count


@kernel
def _read_contacts(indices, body, memory, strongest, out):
    """Contacts of worlds whose bodies touch each other; a chosen body comes first in its contacts."""
    for n in range(indices.shape[0]):
        world = indices[n]
        kept, out.count[n] = _choose_contacts(world, body, memory, strongest)
        for row in range(kept):
            at_row = many.WARM_HEADER_SIZE + many.WARM_CONTACT_SIZE * strongest.place[row]
            a, b = int(memory[world, at_row + many.WARM_BODY_A]), int(memory[world, at_row + many.WARM_BODY_B])
            sign, p = 1.0, at_row + many.WARM_IMPULSE
            if b >= 0 and b == body:
                a, b, sign = b, a, -1.0
            out.ends[n, row, 0], out.ends[n, row, 1] = a, b
            for c in range(3):
                out.point[n, row, c] = memory[world, at_row + many.WARM_POINT + c]
            impulse = (sign * memory[world, p], sign * memory[world, p + 1], sign * memory[world, p + 2])
            _put(n, row, impulse, memory[world, many.WARM_STAGE_LENGTH], 1.0, out)


def contact_rows(world: World) -> int:
    """Rows of `Worlds.contacts`: `ROWS_PER_BODY` for each body, at most as many contacts as there is room for."""
    if not world.plan.contact:
        return 0
    if world.plan.many:
        room = (world.memory.shape[1] - many.WARM_HEADER_SIZE) // many.WARM_CONTACT_SIZE
    else:
        room = world.body_count * ((world.memory.shape[1] - WALL_MEMORY_HEAD) // 4)
    return min(room, ROWS_PER_BODY * world.body_count)


def read_contacts(world: World, indices: np.ndarray, rows: int, body: int = EVERY_BODY) -> Contacts:
    """Read the contacts of the last physics step.

    Parameters
    ----------
    world : World
    indices : (n,) int64
        Of worlds.
    rows : int
        Contacts that are shown of each.
    body : int
        Contacts of this body only, with it as the first body.

    Returns
    -------
    Contacts
        New arrays.
    """
    vectors = len(indices), rows, 3
    out = Contacts(
        np.zeros(len(indices), np.int64), np.zeros(vectors), np.zeros(vectors), np.zeros(vectors),
        np.zeros((len(indices), rows, 2), np.int64),
    )  # fmt: skip
    if rows == 0 or not world.plan.contact:
        return out
    indices = np.ascontiguousarray(indices, np.int64)
    strongest = Strongest(np.empty(rows, np.int64), np.empty(rows))
    if world.plan.many:
        _call(_read_contacts, indices, int(body), world.memory, strongest, out)
    else:
        arrays = WallArrays(world.memory, world.state, world.params, world.shapes, world.walls)
        duration = world.dt if world.plan.events else 1.0  # events keep forces: a stage of 1 s
        _call(_read_wall_contacts, indices, int(body), world.plan.features, duration, arrays, strongest, out)
    return out


def _call(read: Callable, *arguments) -> None:
    """Call a kernel whose arguments have the same types each time: to find them out would take ten times as long."""
    if read not in _MACHINE_CODE:
        _MACHINE_CODE[read] = compiled(read, arguments)
    _MACHINE_CODE[read](*arguments)


_MACHINE_CODE: dict[Callable, Callable] = {}
