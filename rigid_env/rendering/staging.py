"""Arrange a motion for a picture: turned upright, scaled to a size that can be drawn, and all of it in view."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from physics import Gravity, Scene
from rigid_env.rendering import BodyView, Camera, Frame, WallView
from rigid_env.rendering.backdrop import MAJOR
from rigid_env.rendering.camera_argument import as_camera, upwards
from rigid_env.rendering.geometry import quaternion_product, rotation_matrix

Y = np.array((0.0, 1.0, 0.0))
FAR_SPAN = 40.0  # largest extent of a motion that is shown whole, in extents of its largest body
SIGHT = 100.0  # distance of a body from the origin beyond which the picture travels with body 0 [m]
DRAWN_SIZE = 2.0  # least extent of the largest body as it is drawn; smaller scenes are enlarged [m]
LONGEST_ARROW = 0.3  # length of the longest arrow, in extents of the drawn motion
MOST_ARROWS = 16  # most contact points that are drawn; if there are more, none is drawn

# A single body that flies further than `FAR_SPAN` is shown with its whole path. These constants are for such a flight.
FLIGHT_CELLS = 8  # most grid cells along the flight
FLYING_SIZE = 1.6  # least extent of the body as it is drawn, where a grid cell is 5 [m]
FLIGHT_DEPTH = 0.15  # least half width of the drawn ground, in lengths of the flight
FAR_WALL = 2.0  # largest distance of a drawn wall from the middle of the flight, in lengths of the flight
PATH_POINTS = 600  # most points of a drawn path


@dataclass(frozen=True)
class Shot:
    """Camera position and arrows of a picture, as a user chooses them.

    Parameters
    ----------
    eye : (3,) float, optional
        Position of the camera, world frame of the scene [m]. None: chosen so that the whole motion is in view.
    target : (3,) float, optional
        Point in the middle of the picture [m]. None: the middle of the motion.
    arrows : bool
        Whether contact points and forces are drawn.
    """

    eye: tuple[float, float, float] | None = None
    target: tuple[float, float, float] | None = None
    arrows: bool = True


CHOSEN = Shot()
"""Default shot: the whole motion in view, with arrows."""


class Stage:
    """Arrangement of a whole motion for pictures: rotation, scale and shift that are the same for all frames.

    Parameters
    ----------
    scene : Scene
        Scene of the motion; its gravity defines which axis is up.
    frame : Frame
        Frame of the world at any time, for sizes and walls.
    pos : (samples, bodies, 3) float
        Positions of the bodies over the motion, world frame [m].

    Attributes
    ----------
    bounds : pair of (3,) float or None
        Lower and upper corner of the drawn motion [m]. None: the picture travels with body 0.
    notes : tuple of str
        Lines of text for the picture, such as the scale of the grid.
    """

    def __init__(self, scene: Scene, frame: Frame, pos: np.ndarray):
        turn = _upright(scene)
        self._turn, self._matrix = turn, rotation_matrix(turn)
        size = max((_extent(body) for body in frame.bodies), default=1.0)
        self._scale = max(1.0, DRAWN_SIZE / size)
        size *= self._scale
        self._body_scale, self._shift, self._path = self._scale, np.zeros(3), None
        self._ground: tuple[WallView, ...] = ()
        self.notes: tuple[str, ...] = ()
        turned = self._scale * np.asarray(pos) @ self._matrix.T
        lower, upper = turned.min(axis=(0, 1)) - 0.5 * size, turned.max(axis=(0, 1)) + 0.5 * size
        span = float((upper - lower).max())
        self._travels = span > FAR_SPAN * size or bool(np.abs(turned[0]).max() > SIGHT * self._scale)
        self._span = size if self._travels else span
        self.bounds = None if self._travels else (lower, upper)
        if len(frame.bodies) == 1 and span > FAR_SPAN * size:
            self._show_flight(frame, np.asarray(pos)[:, 0] @ self._matrix.T)

    def _show_flight(self, frame: Frame, path: np.ndarray) -> None:
        """Arrange the flight of one body with its whole path (samples, 3) [m] in view; the body may be enlarged."""
        lower, upper = path.min(axis=0), path.max(axis=0)
        span, size = float((upper - lower).max()), _extent(frame.bodies[0])
        cell = _round_up(span / FLIGHT_CELLS)
        self._travels, self._scale, self._shift = False, MAJOR / cell, 0.5 * (lower + upper)
        self._body_scale = max(self._scale, FLYING_SIZE / size)
        half = 0.5 * (upper - lower) + 0.5 * size * self._body_scale / self._scale
        half[[0, 2]] = np.maximum(half[[0, 2]], FLIGHT_DEPTH * span)
        self.bounds, self._span = (-self._scale * half, self._scale * half), self._scale * span
        self._path = self._scale * (path - self._shift)
        walls = map(self._wall, frame.walls)
        self._ground = tuple(wall for wall in walls if abs(wall.offset) <= FAR_WALL * self._span)
        times = self._body_scale / self._scale
        larger = f", body drawn {times:.2g} times as large" if times > 1.05 else ""
        self.notes = (f"grid {cell:g} m{larger}" if self._ground else f"flight {span:.3g} m across{larger}",)

    def place(self, frame: Frame, share: float = 1.0) -> Frame:
        """Transform a frame of the motion for drawing.

        The picture of a single far-flying body contains the first `share` (0 to 1) of its path. If several bodies go
        too far to be shown whole, the picture has no walls and travels with body 0.
        """
        matrix, scale = self._matrix, self._scale
        bodies, sensors = ([self._placed(each) for each in views] for views in (frame.bodies, frame.sensors))
        walls = [self._wall(wall) for wall in frame.walls] if self._path is None else self._ground
        points, forces = scale * (frame.contact_points @ matrix.T - self._shift), frame.contact_forces @ matrix.T
        if self._travels:
            origin = bodies[0].pos
            bodies = [replace(body, pos=body.pos - origin) for body in bodies]
            sensors = [replace(sensor, pos=sensor.pos - origin) for sensor in sensors]
            walls, points = [], points - origin
        if len(points) > MOST_ARROWS:
            points, forces = points[:0], forces[:0]
        longest = np.linalg.norm(forces, axis=1).max(initial=0.0)
        arrow = min(scale * frame.force_scale, LONGEST_ARROW * self._span / longest if longest else np.inf)
        return replace(
            frame, bodies=bodies, walls=walls, sensors=sensors, contact_points=points, contact_forces=forces,
            force_scale=arrow, path=() if self._path is None else _thinned(self._path, share),
        )  # fmt: skip

    def camera(self, shot: Shot) -> Camera | None:
        """Camera of a shot, in the coordinates of `place`; None if the shot has no eye.

        The scene's up direction points upwards. Without a target, the camera looks at the middle of the motion. If the
        picture travels with body 0, eye and target are relative to that body.

        Raises
        ------
        ValueError
            Eye and target are the same point.
        """
        if shot.eye is None:
            return None
        middle = np.zeros(3) if self.bounds is None else 0.5 * np.add(*self.bounds)
        eye = self._placed_point(shot.eye)
        target = middle if shot.target is None else self._placed_point(shot.target)
        eye, target = tuple(eye.tolist()), tuple(target.tolist())
        return as_camera(Camera(eye, target, upwards(eye, target)))

    def _placed(self, body: BodyView) -> BodyView:
        scale = self._body_scale
        corners = {} if body.corners is None else {"corners": scale * np.asarray(body.corners)}
        return replace(
            body, pos=self._placed_point(body.pos), quat=quaternion_product(self._turn, body.quat),
            dimensions=scale * body.dimensions, parts=tuple(_scaled(part, scale) for part in body.parts), **corners,
        )  # fmt: skip

    def _placed_point(self, point) -> np.ndarray:
        return self._scale * (self._matrix @ point - self._shift)

    def _wall(self, wall: WallView) -> WallView:
        normal = self._matrix @ wall.normal
        return WallView(normal, self._scale * (wall.offset - float(normal @ self._shift)))


def _round_up(length: float) -> float:
    """Smallest of 1, 2, 5, 10, ..., times any power of ten, that is not below `length` [m]."""
    power = 10.0 ** math.floor(math.log10(length))
    return power * next(step for step in (1, 2, 5, 10) if step * power >= length * (1 - 1e-9))


def _thinned(path: np.ndarray, share: float) -> np.ndarray:
    """First `share` (0 to 1) of a path, as at most `PATH_POINTS` points, with its end among them."""
    last = round(share * (len(path) - 1))
    return path[np.unique(np.linspace(0, last, min(last + 1, PATH_POINTS)).round().astype(int))]


def _scaled(part: BodyView, scale: float) -> BodyView:
    """Part of a compound that is drawn `scale` times as large."""
    return replace(part, pos=scale * part.pos, dimensions=scale * part.dimensions, corners=scale * part.corners)


def _extent(body: BodyView) -> float:
    return float(body.dimensions.max() * (1.0 if body.kind == "block" else 2.0))


def _upright(scene: Scene) -> np.ndarray:
    """Quaternion (4,) that rotates the axis nearest to up onto y; the identity without gravity."""
    gravity = scene.effect(Gravity)
    up = -np.asarray(gravity.acceleration) if gravity is not None else Y
    k = int(np.abs(up).argmax())
    axis = np.sign(up[k]) * np.eye(3)[k] if up[k] else Y
    if axis @ Y < -0.5:
        return np.array((0.0, 1.0, 0.0, 0.0))
    half = np.concatenate(([1.0 + axis @ Y], np.cross(axis, Y)))
    return half / np.linalg.norm(half)
