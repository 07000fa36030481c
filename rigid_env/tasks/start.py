"""Starts of episodes: from uniform numbers and options to poses, checked, and written into the world."""

from __future__ import annotations

import reprlib

import numpy as np

import physics
from physics.kernels.state import layout as at
from physics.world.parameters import change_inertia
from physics.world.setters import check_depth
from rigid_env.tasks import layout as col
from rigid_env.tasks.area import Area
from rigid_env.tasks.kernels import start_poses
from rigid_env.tasks.options import FACE_COUNT

DOWN = (0.0, -1.0, 0.0)


def choose(area: Area, starts: np.ndarray, size: np.ndarray, options: dict[str, np.ndarray]) -> None:
    """Turn uniform numbers `starts` (n, START_SIZE) into starts of blocks of edges `size` (n, 3) [m], in place."""
    starts[:, :2] = options["place"] if "place" in options else area.spread(starts[:, :2], size)
    starts[:, col.YAW] = options["yaw"] if "yaw" in options else starts[:, col.YAW] * (2.0 * np.pi)
    faces = options["face"] if "face" in options else np.floor(FACE_COUNT * starts[:, col.START_FACE])
    starts[:, col.START_FACE] = faces


def poses(starts: np.ndarray, size: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Positions (n, 1, 3) [m] and quaternions (n, 1, 4) of blocks on the floor."""
    pos, quat = np.empty((len(starts), 1, 3)), np.empty((len(starts), 1, 4))
    start_poses(starts, 0.5 * size, pos, quat)
    return pos, quat


def check(world: physics.World, rows: np.ndarray, pos, quat, values: dict[str, np.ndarray]) -> None:
    """Refuse what `place` could not write: blocks deep inside a wall, inertias that the plan has no room for.

    Raises
    ------
    ValueError
        Naming the options that decide it, where the block is, and in which wall.
    """
    state, params = world.state[rows], world.params[rows]
    state[:, at.POS : at.POS + 3], state[:, at.QUAT : at.QUAT + 4] = pos[:, 0], quat[:, 0]
    change_inertia(params, world.scene.bodies, world.plan, values["mass"], values["size"], None, (len(rows), 1))
    check_depth(world, state, params, rows, "options place, yaw, face, size")


def place(world: physics.World, rows: np.ndarray, pos, quat, changed: dict[str, np.ndarray], lifted) -> None:
    """Write parameters and poses of new episodes into the world.

    Parameters
    ----------
    world : physics.World
    rows : (n,) int64
    pos, quat : (n, 1, 3|4) float64
    changed : dict
        Parameters to write.
    lifted : callable
        From edges (n, 3) to where the old and the new blocks are clear of all walls [m].
    """
    if "size" in changed:  # where the old block lay, the new one might not fit
        world.set_state(pos=np.broadcast_to(lifted(changed["size"]), pos.shape), worlds=rows)
    if changed:
        world.set_parameters(**as_world(changed), worlds=rows)
    still = np.zeros_like(pos)
    world.set_state(pos=pos, quat=quat, linvel=still, angvel=still, worlds=rows)


def change(world: physics.World, field: str, value: np.ndarray) -> None:
    """Give a parameter of all worlds the values (worlds,) or (worlds, 3); after an error nothing has changed."""
    try:
        world.set_parameters(**as_world({field: value}))
    except ValueError as error:
        raise ValueError(f"{field} is {reprlib.repr(value.tolist())}: {error}") from None


def as_world(changed: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Arguments of `World.set_parameters` from parameters of the task: gravity is a vector there."""
    if "gravity" in changed:
        return {**changed, "gravity": np.outer(changed["gravity"], DOWN)}
    return changed
