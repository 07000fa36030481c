"""Distances of bodies to walls in the present state, without a step."""

from __future__ import annotations

from typing import Any

import numpy as np

from physics.kernels.half_space.gap_queries import deepest_gaps
from physics.kernels.state import layout as at
from physics.rotations import rotation_matrices
from physics.world.batch import Batch


def geometric_centres(world: Batch, state: np.ndarray, params: np.ndarray) -> np.ndarray:
    """Geometric centres of bodies (k * bodies, 3) float64, world frame [m]; the arguments are those of `wall_gaps`."""
    centres = state[:, at.POS : at.POS + 3]
    if world.plan.offset_frame:
        R = rotation_matrices(state[:, at.QUAT : at.QUAT + 4])
        centres = centres + np.einsum("kij,kj->ki", R, params[:, at.CENTER : at.CENTER + 3])
    return centres


def lowest_reach(body: Any, quat: np.ndarray, dimensions: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """Lowest coordinate (k, walls) of a hull or capsule along each wall's normal, from its centre, in k poses [m].

    `quat` (k, 4) are attitudes, `dimensions` (k, 3) half extents [m], and `normals` (walls, 3) unit vectors.
    """
    R = rotation_matrices(quat)
    if body.kind == "hull":
        return np.einsum("wi,kij,vj->kwv", normals, R, body.polyhedron.vertices).min(axis=-1)
    radius, half = dimensions[:, :1], dimensions[:, 1:2] - dimensions[:, :1]
    return -half * np.abs(R[:, :, 1] @ normals.T) - radius


def wall_gaps(world: Batch, state: np.ndarray, params: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Smallest gap of every body to any wall.

    Parameters
    ----------
    world : Batch
        Batch with the scene of these states: its bodies and walls.
    state, params : (k * bodies, STATE_SIZE | PARAM_SIZE) float64
        States and parameters of the bodies of k worlds, a row for each body.

    Returns
    -------
    gaps : (k * bodies,) float64
        Smallest gap of each body [m], negative inside a wall; very large without walls.
    which : (k * bodies,) int64
        Index of the wall with the smallest gap; -1 without walls.
    """
    gaps, which = np.empty(len(state)), np.empty(len(state), np.int64)
    deepest_gaps(np.arange(len(state)), state, params, world.shapes, world.walls, gaps, which)
    if len(world.walls):
        normals, offsets = world.walls[:, at.WALL_NORMAL : at.WALL_NORMAL + 3], world.walls[:, at.WALL_OFFSET]
        for b, body in enumerate(world.scene.bodies):
            if body.kind in ("hull", "capsule"):
                own = state[b :: world.body_count]
                sizes = params[b :: world.body_count, at.DIMENSIONS : at.DIMENSIONS + 3]
                reach = lowest_reach(body, own[:, at.QUAT : at.QUAT + 4], sizes, normals)
                each = own[:, at.POS : at.POS + 3] @ normals.T - offsets + reach
                gaps[b :: world.body_count] = each.min(axis=1)
                which[b :: world.body_count] = each.argmin(axis=1)
    return gaps, which
