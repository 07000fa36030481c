"""Placement of a scene before viser's camera: a length that is drawn as one unit, and the point in the middle."""

from __future__ import annotations

from dataclasses import dataclass
from math import hypot

import numpy as np

from rigid_env.rendering.camera import Camera
from rigid_env.rendering.layout import FADE_LENGTH, Room, default_camera, make_room
from rigid_env.viewer.look import Look

SIGHT = 12.0
"""Distance [drawn units] of the camera at first: viser's shadows reach 20 units, and a scene has any size."""

WINDOW = (1000, 640)
"""[px]. A window of which all of the room is in sight."""


@dataclass(frozen=True, eq=False)
class Placement:
    """Part of space that is shown, and how large it is drawn.

    Parameters
    ----------
    room : Room
    camera : Camera
        At first.
    origin : (3,) float
        Drawn in the middle [m].
    scale : float
        Drawn units of a metre.
    """

    room: Room
    camera: Camera
    origin: np.ndarray
    scale: float

    @property
    def unit(self) -> float:
        """Extent of the largest body [m]: arrows and lines grow with it."""
        return self.room.fade / FADE_LENGTH

    def drawn(self, points):
        """Points (..., 3) [m] of the world as they are drawn, float32."""
        return ((np.asarray(points) - self.origin) * self.scale).astype(np.float32)

    def world(self, points) -> np.ndarray:
        """Drawn points (..., 3) as points of the world [m]."""
        return np.asarray(points, dtype=float) / self.scale + self.origin


def place(look: Look, bounds=None) -> Placement:
    """Place a scene as the software renderer does: all of its room in sight.

    Parameters
    ----------
    look : Look
        At any time; bodies that are in it are in sight.
    bounds : pair of (3,) float, optional
        Lower and upper corner of a box to be in sight, too [m].

    Returns
    -------
    Placement
    """
    frame = look.frame
    pos = frame.poses.pos
    if len(pos):
        reach = np.asarray(look.radius)[:, None]
        lower, upper = (pos - reach).min(axis=0), (pos + reach).max(axis=0)
        if bounds is not None:
            lower, upper = np.minimum(lower, bounds[0]), np.maximum(upper, bounds[1])
        bounds = lower, upper
    room = make_room(frame.walls, frame.bodies, bounds)
    camera = default_camera(room, WINDOW)
    origin = 0.5 * (room.lower + room.upper)
    if frame.walls:
        origin[1] = room.lower[1]
    sight = hypot(*(np.array(camera.eye) - camera.target))
    return Placement(room, camera, origin, SIGHT / sight)
