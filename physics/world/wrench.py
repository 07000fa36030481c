"""Wrench of a force that acts at a point of a body, for `World.step`."""

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
    """Compute the wrench of a force at a point of each body, for the bodies' present positions and attitudes.

    Parameters
    ----------
    world : World
        Worlds with the bodies.
    force : (3,), (bodies, 3) or (worlds, bodies, 3) array_like
        Force on each body [N], along the axes of `frame`; zero for bodies without a force.
    point : (3,), (bodies, 3) or (worlds, bodies, 3) array_like
        Point at which the force acts [m], in `point_frame`.
    frame : {"world", "body"}
        Axes of `force`.
    point_frame : {"world", "body"}
        ``body``: `point` is given along the body axes from the centre of mass. ``world``: from the world's origin.

    Returns
    -------
    (worlds, bodies, 6) float64
        Force [N] and torque about the centre of mass [N m], world frame. Wrenches of several forces may be added.

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
    """Check that `value` is finite, and broadcast it to `shape` (worlds, bodies, 3); errors name it `field`."""
    allowed = f"shape (3,), {shape[1:]} or {shape}"
    array = validation.floats(value, field, f"are numbers in {allowed}")
    if array.shape not in ((3,), shape[1:], shape):
        raise ValueError(f"{field} has shape {array.shape}; allowed is {allowed}")
    return np.broadcast_to(validation.finite(array, array.shape, field), shape)
