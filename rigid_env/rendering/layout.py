"""Choose the visible part of the endless walls, and the viewpoint: a room around the scene and its camera."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from rigid_env.rendering.camera import fit_camera
from rigid_env.rendering.geometry import clip_polygon, plane_axes

AXIS_ALIGNED = 0.99
"""A wall bounds the room along an axis if its normal's component is at least this."""

FLOOR_SLOPE = 0.7
"""A wall is a floor if its normal's upward component exceeds this (steeper than 45 degrees it is a wall)."""

ROOM_HEIGHT = 1.6
"""Height of a room open to the top, in units of the largest body extent."""

OPEN_DEPTH = 0.95
"""Half the room's extent along an axis without walls, in the same unit."""

OPEN_LENGTH = 2.0
"""The room's extent along a horizontal axis with one wall, in the same unit."""

FADE_LENGTH = 1.8
"""Length over which an open floor fades out beyond the room, in the same unit."""

FRONT_VIEW = (-0.13, -0.36, -1.0)
"""Line of sight into a room without a back wall: from the front, 20 degrees down, 7 from the right."""

MARGIN = 0.02
"""Part of the picture left free on each side of the room."""

FIELD_OF_VIEW = 24.0
"""[deg]. Narrow enough for edges to look parallel, wide enough for the walls to be seen from inside."""

CORNER_DOWN = 0.62
"""Downward slope of the line of sight into a corner (32 degrees)."""


@dataclass(frozen=True, eq=False)
class Room:
    """The part of space that is shown.

    Parameters
    ----------
    lower, upper : (3,) float64
        [m]. Axis-aligned bounds, world frame.
    fade : float
        [m]. Length over which the floor fades out beyond open sides.
    walls : tuple of WallView
    """

    lower: np.ndarray
    upper: np.ndarray
    fade: float
    walls: tuple

    def corners(self):
        """(8, 3) float64 [m]. Corners of the bounds, world frame."""
        return np.array(np.meshgrid(*zip(self.lower, self.upper))).reshape(3, -1).T

    @cached_property
    def wall_polygons(self):
        """Tuple of (k, 3) float64 [m]: `wall_polygon` of every wall."""
        return tuple(self.wall_polygon(index) for index in range(len(self.walls)))

    def wall_polygon(self, index):
        """Part of a wall inside the room and all other walls.

        Parameters
        ----------
        index : int
            Of the wall.

        Returns
        -------
        (k, 3) float64
            [m]. World frame, in order; a floor reaches out until it has faded. k = 0 if nothing is left.
        """
        wall = self.walls[index]
        reach = self.fade if is_floor(wall) else 0.0
        middle = 0.5 * (self.lower + self.upper)
        foot = middle + (wall.offset - wall.normal @ middle) * wall.normal
        u, v = plane_axes(wall.normal)
        far = 2.0 * (np.linalg.norm(self.upper - self.lower) + reach)
        polygon = foot + far * np.array([-u - v, u - v, u + v, -u + v])
        for axis in np.eye(3):
            slack = reach + 1e-9 * far
            polygon = clip_polygon(polygon, axis, axis @ self.lower - slack)
            polygon = clip_polygon(polygon, -axis, -(axis @ self.upper) - slack)
        for other, view in enumerate(self.walls):
            if other != index:
                polygon = clip_polygon(polygon, view.normal, view.offset)
        return polygon


def is_floor(wall):
    """True if a `WallView` looks upwards."""
    return wall.normal[1] > FLOOR_SLOPE


def faces_point(wall, point):
    """True if a point (3,) [m] is on the free side of a `WallView`."""
    return wall.normal @ np.asarray(point) > wall.offset


def make_room(walls, bodies, bounds=None):
    """Room between the walls; where there are none, large enough for the bodies.

    Parameters
    ----------
    walls : tuple of WallView
    bodies : tuple of BodyView
        Without walls the room is centred on the mean of their positions, otherwise only their sizes count.
    bounds : pair of (3,) float, optional
        [m]. Lower and upper corner of a box that the open sides of the room reach.

    Returns
    -------
    Room
    """
    extents = [b.dimensions.max() * (1.0 if b.kind == "block" else 2.0) for b in bodies]
    unit = float(max(extents, default=5.0))
    centre = np.mean([b.pos for b in bodies], axis=0) if bodies and not walls else np.zeros(3)
    lower, upper = np.full(3, -np.inf), np.full(3, np.inf)
    for wall in walls:
        axis = int(np.argmax(np.abs(wall.normal)))
        if wall.normal[axis] > AXIS_ALIGNED:
            lower[axis] = max(lower[axis], wall.offset)
        elif wall.normal[axis] < -AXIS_ALIGNED:
            upper[axis] = min(upper[axis], -wall.offset)
    is_open = np.isinf(lower), np.isinf(upper)
    for axis in range(3):
        length = ROOM_HEIGHT * unit if axis == 1 else OPEN_LENGTH * unit
        if np.isinf(lower[axis]) and np.isinf(upper[axis]):
            lower[axis] = centre[axis] - OPEN_DEPTH * unit
            upper[axis] = centre[axis] + OPEN_DEPTH * unit
        elif np.isinf(upper[axis]):
            upper[axis] = lower[axis] + length
        elif np.isinf(lower[axis]):
            lower[axis] = upper[axis] - length
    if bounds is not None:
        lower = np.where(is_open[0], np.minimum(lower, bounds[0]), lower)
        upper = np.where(is_open[1], np.maximum(upper, bounds[1]), upper)
    return Room(lower, upper, FADE_LENGTH * unit, tuple(walls))


def default_camera(room, size):
    """Camera that has the whole room in sight: into the corner if there is one, otherwise from the front.

    Parameters
    ----------
    room : Room
    size : (width, height)
        [px].

    Returns
    -------
    Camera
    """
    sideways = [w.normal for w in room.walls if abs(w.normal[1]) < FLOOR_SLOPE]
    inwards = np.sum(sideways, axis=0) if sideways else np.zeros(3)
    if inwards[2] > 0.5 and abs(inwards[0]) > 0.5:
        level = inwards * (1.0, 0.0, 1.0) / np.hypot(inwards[0], inwards[2])
        direction = (-level[0], -CORNER_DOWN, -level[2])
    else:
        direction = FRONT_VIEW
    return fit_camera(room.corners(), direction, size, FIELD_OF_VIEW, MARGIN)
