"""The wrench of a force at a point, for `World.step`."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from physics import validation
from physics.annotations import Frame
from physics.keywords import known_keywords
from physics.rotations import rotation_matrices
from physics.world.world import World

FRAMES = ("world", "body")


@known_keywords
def wrench_at(
    world: World,
    force: ArrayLike,
    point: ArrayLike = (0.0, 0.0, 0.0),
    frame: Frame = "world",
    point_frame: Frame = "body",
) -> np.ndarray:
    """The wrench of a force at a point of each body, where the bodies are now.

    Parameters
    ----------
    world : World
    force : (3,), (bodies, 3) or (worlds, bodies, 3) array_like
        [N], along the axes of `frame`; zero for bodies that it does not act on.
    point : (3,), (bodies, 3) or (worlds, bodies, 3) array_like
        Where it acts [m]. ``body``: along the body axes from the centre of mass; ``world``: from the world's origin.
    frame, point_frame : {"world", "body"}

    Returns
    -------
    (worlds, bodies, 6) float64
        Force [N] and torque about the centre of mass [N m], world frame. Several forces: the sum of their wrenches.

    Raises
    ------
    ValueError
        A wrong shape, a number that is not finite, or a frame of another name.
    """
    validation.instance(world, World, "world", "a physics.World")
    shape = (world.worlds, world.body_count, 3)
    forces, points = _spread(force, shape, "force"), _spread(point, shape, "point")
    for name, value in (("frame", frame), ("point_frame", point_frame)):
        validation.one_of(value, FRAMES, name)
    R = rotation_matrices(world.quat)
    if frame == "body":
        forces = np.einsum("wbij,wbj->wbi", R, forces)
    arms = np.einsum("wbij,wbj->wbi", R, points) if point_frame == "body" else points - world.pos
    return np.concatenate((forces, np.cross(arms, forces)), axis=-1)


def _spread(value, shape: tuple[int, int, int], field: str) -> np.ndarray:
    """`value` for every world and body."""
    allowed = f"shape (3,), {shape[1:]} or {shape}"
    array = validation.floats(value, field, f"are numbers in {allowed}")
    if array.shape not in ((3,), shape[1:], shape):
        raise ValueError(f"{field} has shape {array.shape}; allowed is {allowed}")
    return np.broadcast_to(validation.finite(array, array.shape, field), shape)
