"""Rotation matrices of bodies and gaps to walls, computed from the state of many worlds.

Each quantity is computed by one compiled call. An array of results has a row for each world of `indices` (n,).
"""

from __future__ import annotations

import numpy as np

from physics.compiler.decorators import entry_kernel
from physics.kernels.half_space import support_function as geo
from physics.kernels.math import quaternion as qt
from physics.kernels.state import layout as at
from physics.world.wall_distance import REACHED, lowest_reach
from physics.world.world import World


@entry_kernel
def _rotations(indices, state, out):
    bodies = out.shape[1]
    for k in range(indices.shape[0]):
        for b in range(bodies):
            i = indices[k] * bodies + b
            R = qt.to_matrix((state[i, at.QUAT], state[i, at.QUAT + 1], state[i, at.QUAT + 2], state[i, at.QUAT + 3]))
            for j in range(9):
                out[k, b, j // 3, j % 3] = R[j]


@entry_kernel
def _wall_gaps(indices, state, params, shapes, walls, out):
    bodies = out.shape[1]
    for k in range(indices.shape[0]):
        for b in range(bodies):
            i = indices[k] * bodies + b
            R = qt.to_matrix((state[i, at.QUAT], state[i, at.QUAT + 1], state[i, at.QUAT + 2], state[i, at.QUAT + 3]))
            d = (params[i, at.DIMENSIONS], params[i, at.DIMENSIONS + 1], params[i, at.DIMENSIONS + 2])
            r = qt.matvec(R, (params[i, at.CENTER], params[i, at.CENTER + 1], params[i, at.CENTER + 2]))
            x = (state[i, at.POS] + r[0], state[i, at.POS + 1] + r[1], state[i, at.POS + 2] + r[2])
            for w in range(walls.shape[0]):
                n = (walls[w, at.WALL_NORMAL], walls[w, at.WALL_NORMAL + 1], walls[w, at.WALL_NORMAL + 2])
                reach = geo.support(shapes[b], d, geo.scaled_normal(shapes[b], d, R, n))
                out[k, b, w] = qt.dot(n, x) - walls[w, at.WALL_OFFSET] - reach


def write_rotations(world: World, indices: np.ndarray, out: np.ndarray) -> None:
    """Write the rotation matrices of all bodies, body to world, into `out` (n, bodies, 3, 3)."""
    _rotations(indices, world.state, out)


def write_wall_gaps(world: World, indices: np.ndarray, out: np.ndarray) -> None:
    """Write the gaps between all bodies and walls [m] into `out` (n, bodies, walls); negative where they overlap."""
    _wall_gaps(indices, world.state, world.params, world.shapes, world.walls, out)
    for b, body in enumerate(world.scene.bodies):
        if body.kind in REACHED:
            normals, offsets = world.walls[:, at.WALL_NORMAL : at.WALL_NORMAL + 3], world.walls[:, at.WALL_OFFSET]
            sizes = world.params[indices * world.body_count + b, at.DIMENSIONS : at.DIMENSIONS + 3]
            reach = lowest_reach(body, world.quat[indices, b], sizes, normals)
            out[:, b] = world.pos[indices, b] @ normals.T - offsets + reach
