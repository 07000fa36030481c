"""Contact points and forces of the last step, read back from the contact memory."""

from __future__ import annotations

import numpy as np

from physics.kernels.half_space.gap_queries import contact_point
from physics.kernels.half_space.persistent_contacts import WALL_MEMORY_HEAD
from physics.kernels.multibody.data import arrays as many
from physics.kernels.state import layout as at
from physics.world.batch import Batch


def contact_ends(world: Batch, index: int) -> np.ndarray:
    """Bodies and walls that touch, (n, 2) int64; see `World.contact_ends`."""
    if not world.plan.contact:
        return np.zeros((0, 2), dtype=np.int64)
    if world.plan.many:
        return _many_rows(world, index)[:, many.WARM_BODY_A : many.WARM_BODY_B + 1].astype(np.int64)
    ends = [(b, -1 - slot // world.plan.features) for b in range(world.body_count) for slot in _slots(world, index, b)]
    return np.array(ends, dtype=np.int64).reshape(-1, 2)


def pushing_ends(world: Batch, index: int) -> np.ndarray:
    """Those of `contact_ends` whose contacts pushed in the last stage, (n, 2) int64."""
    ends = contact_ends(world, index)
    if not len(ends):
        return ends
    if world.plan.many:
        impulses = _many_rows(world, index)[:, many.WARM_IMPULSE : many.WARM_IMPULSE + 3]
    else:
        bodies = range(world.body_count)
        impulses = np.array([_wall_impulse(world, index, b, slot) for b in bodies for slot in _slots(world, index, b)])
    return ends[impulses.any(axis=1)]


def contact_forces(world: Batch, index: int) -> tuple[np.ndarray, np.ndarray]:
    """Points (n, 3) [m] and forces (n, 3) [N], world frame; see `World.contacts`."""
    if not world.plan.contact:
        return np.zeros((0, 3)), np.zeros((0, 3))
    if world.plan.many:
        rows = _many_rows(world, index)
        length = world.memory[index, many.WARM_STAGE_LENGTH] or 1.0  # no row where nothing touched yet
        return rows[:, many.WARM_POINT : many.WARM_POINT + 3].copy(), rows[
            :, many.WARM_IMPULSE : many.WARM_IMPULSE + 3
        ] / length
    found = [_wall_contact(world, index, b, slot) for b in range(world.body_count) for slot in _slots(world, index, b)]
    points, forces = zip(*found) if found else ((), ())
    return np.array(points).reshape(-1, 3), np.array(forces).reshape(-1, 3)


def _many_rows(world: Batch, index: int) -> np.ndarray:
    """Remembered contacts (n, `WARM_CONTACT_SIZE`) of one world in which bodies touch each other."""
    row = world.memory[index]
    count = int(row[many.WARM_CONTACT_COUNT])
    return row[many.WARM_HEADER_SIZE : many.WARM_HEADER_SIZE + many.WARM_CONTACT_SIZE * count].reshape(
        count, many.WARM_CONTACT_SIZE
    )


def _slots(world: Batch, index: int, body: int) -> list[int]:
    """Slots (wall * features + feature) at which a body rests."""
    row = world.memory[index * world.body_count + body]
    return row[WALL_MEMORY_HEAD : WALL_MEMORY_HEAD + int(row[1])].astype(int).tolist()


def _wall_contact(world: Batch, index: int, body: int, slot: int) -> tuple[np.ndarray, np.ndarray]:
    """Point [m] and force [N] at one slot, (3,) each."""
    i = index * world.body_count + body
    row, (wall, feature) = world.memory[i], divmod(slot, world.plan.features)
    point = np.empty(3)
    contact_point(world.state, world.params, world.shapes, world.walls, i, wall, feature, point)
    impulse = _wall_impulse(world, index, body, slot)
    return point, world.walls[wall, at.WALL_NORMAL : at.WALL_NORMAL + 9].reshape(3, 3).T @ impulse / row[0]


def _wall_impulse(world: Batch, index: int, body: int, slot: int) -> np.ndarray:
    """Impulse of the last stage at one slot, along the wall's normal and tangents, (3,) [N s]."""
    row = world.memory[index * world.body_count + body]
    first = WALL_MEMORY_HEAD + (world.memory.shape[1] - WALL_MEMORY_HEAD) // 4 + 3 * slot
    return row[first : first + 3]
