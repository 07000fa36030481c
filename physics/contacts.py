"""Contact points and forces of the last step, read back from the contact memory."""

from __future__ import annotations

import numpy as np

from physics.kernels import layout as at
from physics.kernels.probe import contact_point
from physics.kernels.stages import MEMORY_HEAD


def contact_forces(rows, memory, state, params, shapes, walls, features) -> tuple[np.ndarray, np.ndarray]:
    """Points (n, 3) [m] and forces (n, 3) [N] on the bodies `rows`, world frame; see `World.contacts`."""
    points, forces = [], []
    impulses_at = MEMORY_HEAD + (memory.shape[1] - MEMORY_HEAD) // 4
    for i in rows:
        length, count = memory[i, 0], int(memory[i, 1])
        for slot in memory[i, MEMORY_HEAD : MEMORY_HEAD + count].astype(int):
            wall, feature = divmod(int(slot), features)
            point = np.empty(3)
            contact_point(state, params, shapes, walls, i, wall, feature, point)
            frame = walls[wall, at.NORMAL : at.NORMAL + 9].reshape(3, 3)
            impulse = memory[i, impulses_at + 3 * slot : impulses_at + 3 * slot + 3]
            points.append(point)
            forces.append(frame.T @ impulse / length)
    return np.array(points).reshape(-1, 3), np.array(forces).reshape(-1, 3)


def walls_touched(memory_row: np.ndarray, features: int) -> set[int]:
    """Indices of the walls that a body rests against."""
    slots = memory_row[MEMORY_HEAD : MEMORY_HEAD + int(memory_row[1])]
    return {int(slot) // features for slot in slots}
