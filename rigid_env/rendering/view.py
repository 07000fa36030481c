"""Pictures of a task: the frame of one world, and the renderer that draws it."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np

from physics import Body, Scene
from rigid_env.extras import require
from rigid_env.rendering import Frame, GoalView, Renderer, Room, make_room
from rigid_env.rendering.camera_argument import CameraArgument, as_camera, as_switch
from rigid_env.rendering.geometry import rotation_matrix
from rigid_env.rendering.picture import WEIGHT_ARROW, world_frame
from rigid_env.tasks import Task

NO_WEIGHT = 1.0
"""Force that is as long as a weight where no body has one [N]."""

RenderMode = Literal["rgb_array", "human"]
"""Type of the argument `render_mode`: one of `RENDER_MODES`."""

RENDER_MODES = ("rgb_array", "human")


def frame_of(task: Task, world: int = 0, arrows: bool = True) -> Frame:
    """Make the frame of a picture of one world of a task.

    Parameters
    ----------
    task : Task
    world : int
        Index of the world in the task's batch.
    arrows : bool
        Whether contacts, forces and torques are drawn.

    Returns
    -------
    Frame
        Walls, bodies, goal, contact points with their forces, the wrench on each body, and lines of text.
    """
    mark = task.goal_mark(world)
    goal = None if mark is None else GoalView(**mark)
    frame = world_frame(task.world, world, task.lines(world), goal, task.load[world], arrows=arrows)
    return replace(frame, force_scale=WEIGHT_ARROW / (task.weights[world].max() or NO_WEIGHT))


def room_of(task: Task) -> Room:
    """Part of space that pictures of a task show, the same for all its worlds and episodes."""
    frame = world_frame(task.world, arrows=False)
    return make_room(frame.walls, frame.bodies, bounds_of(task.world.scene))


def seen_of(task: Task) -> tuple[np.ndarray, np.ndarray]:
    """Lower and upper corner (3,) [m] of the box that pictures of a task show: its bodies, and its `shown_box`.

    Observed pictures leave `shown_box` out; see `room_of`.
    """
    lower, upper = bounds_of(task.world.scene)
    if task.shown_box is None:
        return lower, upper
    return np.minimum(lower, task.shown_box[0]), np.maximum(upper, task.shown_box[1])


def bounds_of(scene: Scene) -> tuple[np.ndarray, np.ndarray]:
    """Lower and upper corner (3,) [m] of a box around all bodies of a scene, at the poses that it declares."""
    boxes = np.array([_box_of(body) for body in scene.bodies])
    return boxes[:, 0].min(axis=0), boxes[:, 1].max(axis=0)


def _box_of(body: Body) -> tuple[np.ndarray, np.ndarray]:
    """Lower and upper corner (3,) [m] of a box around a body, within the box around its bounding sphere."""
    rotation = rotation_matrix(np.array(body.quat))
    reach = np.minimum(np.abs(rotation) @ body.dimensions, body.bounding_radius(body.dimensions))
    middle = np.array(body.pos) + rotation @ np.array(body.center)
    return middle - reach, middle + reach


@dataclass(frozen=True)
class RenderArguments:
    """Arguments of an environment about its pictures.

    Attributes
    ----------
    render_mode : {"rgb_array", "human"} or None
        None draws nothing.
    width, height : int
        Size of the picture [px].
    camera : Camera, mapping or None
        As of `rigid_env.rendering.camera_argument.as_camera`.
    arrows : bool
        Whether contacts, forces and torques are drawn.
    """

    render_mode: RenderMode | None = None
    width: int = 960
    height: int = 600
    camera: CameraArgument = field(default=None, kw_only=True)
    arrows: bool = field(default=True, kw_only=True)


class View:
    """Pictures of a task's worlds; the first picture makes the renderer, which pickles leave out.

    Parameters
    ----------
    given : RenderArguments
    fps : float
        Most pictures per second in the window [1/s].
    title : str
        Title of the window.

    Raises
    ------
    ValueError
        On an unknown mode, a size that is not positive, or a camera with impossible parameters.
    gymnasium.error.DependencyNotInstalled
        If there is a mode, but no pygame.
    """

    def __init__(self, given: RenderArguments, fps: float, title: str):
        mode = given.render_mode
        if mode is not None and mode not in RENDER_MODES:
            raise ValueError(f"render_mode is {mode!r}; allowed are None, {', '.join(map(repr, RENDER_MODES))}")
        for name, value in (("width", given.width), ("height", given.height)):
            if isinstance(value, bool) or not isinstance(value, (int, np.integer)) or value < 1:
                raise ValueError(f"{name} is {value!r}; allowed are integers of at least 1")
        self.camera, self.arrows = as_camera(given.camera), as_switch(given.arrows, "arrows")
        if mode is not None:
            require("render", "pygame", purpose="rendering")
        self.mode, self.width, self.height, self.fps, self.title = mode, given.width, given.height, fps, title
        self._renderer: Renderer | None = None

    def draw(self, task: Task, world: int = 0) -> np.ndarray:
        """Draw one world of a task: returns (height, width, 3) uint8; the mode "human" shows it in the window, too."""
        return self.draw_frame(task, frame_of(task, world, self.arrows))

    def draw_frame(self, task: Task, frame: Frame) -> np.ndarray:
        """Draw a frame in the room of a task, with the user's camera or that of the task; as `draw`."""
        if self._renderer is None:
            camera = self.camera or as_camera(task.camera, f"camera of {type(task).__name__}")
            self._renderer = Renderer(self.width, self.height, self.mode, self.fps, self.title, camera, seen_of(task))
        return self._renderer.draw(frame)

    def close(self) -> None:
        """Close the window, if there is one; further calls do nothing."""
        if self._renderer is not None:
            self._renderer.close()
            self._renderer = None

    def __getstate__(self):
        return {**vars(self), "_renderer": None}
