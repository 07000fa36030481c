"""Distances of bodies to walls in the present state, without a step."""

from __future__ import annotations

from typing import Any

import numpy as np

from physics.kernels.half_space.gap_queries import deepest_gaps
from physics.kernels.state import layout as at
from physics.rotations import rotation_matrices
from physics.scene.groups import touching_pairs
from physics.scene.support import support
from physics.world.batch import Batch

REACHED = ("hull", "capsule", "cylinder", "compound")
"""Kinds of bodies whose gaps `lowest_reach` gives, since `gap_queries` does not know them."""


def geometric_centres(world: Batch, state: np.ndarray, params: np.ndarray) -> np.ndarray:
    """Geometric centres of bodies (k * bodies, 3) float64, world frame [m]; the arguments are those of `wall_gaps`."""
    centres = state[:, at.POS : at.POS + 3]
    if world.plan.offset_frame:
        R = rotation_matrices(state[:, at.QUAT : at.QUAT + 4])
        centres = centres + np.einsum("kij,kj->ki", R, params[:, at.CENTER : at.CENTER + 3])
    return centres


def lowest_reach(body: Any, quat: np.ndarray, dimensions: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """Lowest coordinate (k, walls) of a body in `REACHED` along each wall's normal, from its centre, in k poses [m].

    `quat` (k, 4) are attitudes, `dimensions` (k, 3) half extents [m], and `normals` (walls, 3) unit vectors.
    """
    R = rotation_matrices(quat)
    if body.kind == "compound":
        return -support(body, -np.einsum("wi,kij->kwj", normals, R))
    if body.kind == "hull":
        return np.einsum("wi,kij,vj->kwv", normals, R, body.polyhedron.vertices).min(axis=-1)
    radius, half, along = dimensions[:, :1], dimensions[:, 1:2], np.abs(R[:, :, 1] @ normals.T)
    if body.kind == "cylinder":
        return -half * along - radius * np.hypot(R[:, :, 0] @ normals.T, R[:, :, 2] @ normals.T)
    return -(half - radius) * along - radius


def wall_gaps(world: Batch, state: np.ndarray, params: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Smallest gap of every body to any wall that it may touch.

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
    touching = touching_pairs(world.scene, True)
    if touching is None:
        deepest_gaps(np.arange(len(state)), state, params, world.shapes, world.walls, gaps, which)
    for b, body in enumerate(world.scene.bodies):
        if touching is None and body.kind not in REACHED:
            continue
        own = np.arange(b, len(state), world.body_count)
        walls = np.arange(len(world.walls)) if touching is None else np.flatnonzero(touching[b, world.body_count :])
        if touching is not None:
            found, index = np.empty(len(own)), np.empty(len(own), np.int64)
            deepest_gaps(own, state, params, world.shapes, world.walls[walls], found, index)
            gaps[own], which[own] = found, np.append(walls, -1)[index]
        if body.kind in REACHED and len(walls):
            each = _gaps(body, state[own], params[own], world.walls[walls])
            gaps[own], which[own] = each.min(axis=1), walls[each.argmin(axis=1)]
    return gaps, which


def _gaps(body: Any, state: np.ndarray, params: np.ndarray, walls: np.ndarray) -> np.ndarray:
    """Gaps (k, walls) of a body in `REACHED` to walls (walls, WALL_SIZE), in k rows of `state` and `params` [m]."""
    normals, offsets = walls[:, at.WALL_NORMAL : at.WALL_NORMAL + 3], walls[:, at.WALL_OFFSET]
    sizes = params[:, at.DIMENSIONS : at.DIMENSIONS + 3]
    reach = lowest_reach(body, state[:, at.QUAT : at.QUAT + 4], sizes, normals)
    return state[:, at.POS : at.POS + 3] @ normals.T - offsets + reach
