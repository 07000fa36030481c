"""Choose the part of space that a picture shows, a room between the endless walls, and a camera for it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from rigid_env.rendering.camera import fit_camera
from rigid_env.rendering.geometry import clip_polygon, plane_axes

AXIS_ALIGNED = 0.99
"""Smallest component of a wall's normal along an axis for which the wall bounds the room along this axis."""

FLOOR_SLOPE = 0.7
"""Smallest upward component of the normal of a floor; a plane steeper than about 45 degrees is a wall instead."""

ROOM_HEIGHT = 1.6
"""Height of a room that is open at the top, in extents of the largest body."""

OPEN_DEPTH = 0.95
"""Half the size of the room along an axis without walls, in extents of the largest body."""

OPEN_LENGTH = 2.0
"""Size of the room along a horizontal axis with one wall, in extents of the largest body."""

FADE_LENGTH = 1.8
"""Distance over which an open floor fades out beyond the room, in extents of the largest body."""

FRONT_VIEW = (-0.13, -0.36, -1.0)
"""Line of sight into a room without a back wall: from the front, 20 degrees down, 7 from the right."""

MARGIN = 0.02
"""Share of the picture that stays empty on each side of the room."""

FIELD_OF_VIEW = 24.0
"""[deg] Vertical field of view: narrow enough for edges to look parallel, wide enough to see walls from inside."""

CORNER_DOWN = 0.62
"""Downward component of the line of sight into a corner, relative to the horizontal one (32 degrees)."""


@dataclass(frozen=True, eq=False)
class Room:
    """Part of space that a picture shows.

    Parameters
    ----------
    lower, upper : (3,) float64
        Axis-aligned bounds, world frame [m].
    fade : float
        Distance over which the floor fades out beyond open sides [m].
    walls : tuple of WallView
    """

    lower: np.ndarray
    upper: np.ndarray
    fade: float
    walls: tuple

    def corners(self):
        """Corners (8, 3) float64 of the bounds, world frame [m]."""
        return np.array(np.meshgrid(*zip(self.lower, self.upper))).reshape(3, -1).T

    @cached_property
    def wall_polygons(self):
        """Polygon of every wall from `wall_polygon`: a tuple of (k, 3) float64 [m]."""
        return tuple(self.wall_polygon(index) for index in range(len(self.walls)))

    def wall_polygon(self, index):
        """Visible part of a wall: a polygon inside the room and on the free side of all other walls.

        Parameters
        ----------
        index : int
            Index of the wall.

        Returns
        -------
        (k, 3) float64
            Vertices in order, world frame [m]; a floor extends beyond the room until it has faded. k = 0 if nothing is
            left.
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
    """True if the normal of a `WallView` points upwards, as that of a floor."""
    return wall.normal[1] > FLOOR_SLOPE


def faces_point(wall, point):
    """True if a point (3,) [m] is on the free side of a `WallView`."""
    return wall.normal @ np.asarray(point) > wall.offset


def make_room(walls, bodies, bounds=None):
    """Make the room between the walls; along axes without walls it is large enough for the bodies.

    Parameters
    ----------
    walls : tuple of WallView
    bodies : tuple of BodyView
        The largest size scales the room. Without any walls, the room is centred on the mean of the bodies' positions.
    bounds : pair of (3,) float, optional
        Lower and upper corner of a box that the room includes on its open sides [m].

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
    """Camera that has the whole room in view: it looks into the corner if there is one, otherwise from the front.

    Parameters
    ----------
    room : Room
    size : (width, height)
        Size of the picture [px].

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
