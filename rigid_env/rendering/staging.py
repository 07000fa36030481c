"""Place a motion before the camera: upright, at a size that can be drawn, and all of it in sight."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from physics import Gravity, Scene
from rigid_env.rendering import BodyView, Camera, Frame, WallView
from rigid_env.rendering.backdrop import MAJOR
from rigid_env.rendering.camera_argument import as_camera, upwards
from rigid_env.rendering.geometry import rotation_matrix

Y = np.array((0.0, 1.0, 0.0))
FAR_SPAN = 40.0  # largest extent of a motion that is shown whole, in sizes of its largest body
SIGHT = 100.0  # further from the origin than this the camera travels with the bodies [m]
DRAWN_SIZE = 2.0  # a largest body smaller than this is drawn that large [m]
LONGEST_ARROW = 0.3  # of the extent of the picture
MOST_ARROWS = 16  # contact points; of more of them no forces are drawn

# Of the flight of one body that goes further than `FAR_SPAN`, which is shown whole, with its path.
FLIGHT_CELLS = 8  # strong lines of the grid that the flight is longer than, at most
FLYING_SIZE = 1.6  # of the body as it is drawn, where 5 is a cell of the grid [m]
FLIGHT_DEPTH = 0.15  # least half width of the ground, in lengths of the flight
FAR_WALL = 2.0  # distance from the middle of the flight from which on a wall is left out, in lengths of the flight
PATH_POINTS = 600  # at most


@dataclass(frozen=True)
class Shot:
    """View of a motion in pictures.

    Parameters
    ----------
    eye : (3,) float, optional
        Place of the camera, world frame of the scene [m]. None: chosen so that the motion is in sight.
    target : (3,) float, optional
        Place in the middle of the picture [m]. None: the middle of the motion.
    arrows : bool
        Whether contact points and forces are drawn.
    """

    eye: tuple[float, float, float] | None = None
    target: tuple[float, float, float] | None = None
    arrows: bool = True


CHOSEN = Shot()
"""View of all of the motion."""


class Stage:
    """One camera's view of a whole motion.

    Parameters
    ----------
    scene : Scene
        Its gravity says which of the axes is up.
    frame : Frame
        The world at any time.
    pos : (samples, bodies, 3) float
        Positions over the motion, world frame [m].

    Attributes
    ----------
    bounds : pair of (3,) float or None
        Lower and upper corner of the drawn motion [m]. None: the picture travels with body 0.
    notes : tuple of str
        Lines that say what is not to scale.
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
        """Show all of a flight along `path` (samples, 3) [m]; near walls, enlarge the body as far as possible."""
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
        """Place a frame of the motion for drawing.

        Where one body goes far, its path is in the picture, the first `share` of it (0 to 1). Where several go too far
        to be shown whole, the picture is without walls and travels with body 0.
        """
        matrix, scale = self._matrix, self._scale
        bodies = [self._placed(body) for body in frame.bodies]
        walls = [self._wall(wall) for wall in frame.walls] if self._path is None else self._ground
        points, forces = scale * (frame.contact_points @ matrix.T - self._shift), frame.contact_forces @ matrix.T
        if self._travels:
            origin = bodies[0].pos
            bodies, walls, points = [replace(body, pos=body.pos - origin) for body in bodies], [], points - origin
        if len(points) > MOST_ARROWS:
            points, forces = points[:0], forces[:0]
        longest = np.linalg.norm(forces, axis=1).max(initial=0.0)
        arrow = min(scale * frame.force_scale, LONGEST_ARROW * self._span / longest if longest else np.inf)
        return replace(
            frame, bodies=bodies, walls=walls, contact_points=points, contact_forces=forces, force_scale=arrow,
            path=() if self._path is None else _thinned(self._path, share),
        )  # fmt: skip

    def camera(self, shot: Shot) -> Camera | None:
        """Camera of a shot, in the frame of `place`, with the scene's up direction upwards; None where none is chosen.

        Without a target it looks at the middle of the motion. Where the picture travels with body 0, both places are
        counted from it.

        Raises
        ------
        ValueError
            The two places are one.
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
            body, pos=self._placed_point(body.pos), quat=_product(self._turn, body.quat),
            dimensions=scale * body.dimensions, **corners,
        )  # fmt: skip

    def _placed_point(self, point) -> np.ndarray:
        return self._scale * (self._matrix @ point - self._shift)

    def _wall(self, wall: WallView) -> WallView:
        normal = self._matrix @ wall.normal
        return WallView(normal, self._scale * (wall.offset - float(normal @ self._shift)))


def _round_up(length: float) -> float:
    """The next of 1, 2, 5, 10, ... that is not smaller [m]."""
    power = 10.0 ** math.floor(math.log10(length))
    return power * next(step for step in (1, 2, 5, 10) if step * power >= length * (1 - 1e-9))


def _thinned(path: np.ndarray, share: float) -> np.ndarray:
    """First `share` of a path as at most `PATH_POINTS` points, its end included."""
    last = round(share * (len(path) - 1))
    return path[np.unique(np.linspace(0, last, min(last + 1, PATH_POINTS)).round().astype(int))]


def _extent(body: BodyView) -> float:
    return float(body.dimensions.max() * (1.0 if body.kind == "block" else 2.0))


def _upright(scene: Scene) -> np.ndarray:
    """Quaternion (4,) of the turn of the axis nearest to up onto y; none if that is y, or without gravity."""
    gravity = scene.effect(Gravity)
    up = -np.asarray(gravity.acceleration) if gravity is not None else Y
    k = int(np.abs(up).argmax())
    axis = np.sign(up[k]) * np.eye(3)[k] if up[k] else Y
    if axis @ Y < -0.5:
        return np.array((0.0, 1.0, 0.0, 0.0))
    half = np.concatenate(([1.0 + axis @ Y], np.cross(axis, Y)))
    return half / np.linalg.norm(half)


def _product(p: np.ndarray, q: np.ndarray) -> np.ndarray:
    """Quaternion (4,) of the turn q, then p; scalar first."""
    a, b, c, d = p.tolist()
    return np.array(((a, -b, -c, -d), (b, a, -d, c), (c, d, a, -b), (d, -c, b, a))) @ q
