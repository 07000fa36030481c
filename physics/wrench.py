"""The wrench of a force at a point, for `World.step`."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from physics.frontier_errors import rotation_matrices
from physics.keywords import known_keywords
from physics.world import World

FRAMES = ("world", "body")


@known_keywords
def wrench_at(
    world: World, force: ArrayLike, point: ArrayLike = (0.0, 0.0, 0.0), frame: str = "world", point_frame: str = "body"
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
    shape = (world.worlds, world.body_count, 3)
    force, point = _spread(force, shape, "force"), _spread(point, shape, "point")
    for name, value in (("frame", frame), ("point_frame", point_frame)):
        if value not in FRAMES:
            raise ValueError(f"{name} is {value!r}; allowed are {', '.join(FRAMES)}")
    R = rotation_matrices(world.quat)
    if frame == "body":
        force = np.einsum("wbij,wbj->wbi", R, force)
    arm = np.einsum("wbij,wbj->wbi", R, point) if point_frame == "body" else point - world.pos
    return np.concatenate((force, np.cross(arm, force)), axis=-1)


def _spread(value, shape: tuple[int, int, int], field: str) -> np.ndarray:
    """`value` for every world and body."""
    try:
        array = np.broadcast_to(np.asarray(value, dtype=np.float64), shape)
    except (TypeError, ValueError):
        raise ValueError(f"{field} is {value!r}; allowed are numbers in shape (3,), {shape[1:]} or {shape}") from None
    if not np.isfinite(array).all():
        raise ValueError(f"{field} is {value!r}; allowed are finite numbers")
    return array
