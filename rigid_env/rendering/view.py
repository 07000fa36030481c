"""From a task to a picture: what of a world is drawn, and the renderer that draws it."""

from __future__ import annotations

import numpy as np

from rigid_env.extras import require
from rigid_env.rendering import BodyView, Frame, GoalView, Renderer, WallView
from rigid_env.tasks import Task
from rigid_env.tasks import layout as col
from rigid_env.tasks.base import FORCE_SHARE

RENDER_MODES = ("rgb_array", "human")

WEIGHT_ARROW = 2.5
"""[m] Length of the arrow of a force as large as the block's weight."""


GOAL_RADIUS = 1.0
"""[m] Of the goal's disc, to be seen beside a block that covers its tolerance."""


def frame_of(task: Task, world: int = 0) -> Frame:
    """Picture of one world of a task.

    Parameters
    ----------
    task : Task
    world : int

    Returns
    -------
    Frame
        Walls, block, goal, contact points with their forces, the applied wrench, and a line of text.
    """
    record, outcome, wrench = task.record[world], task.outcome[world], task.wrench[world, 0]
    points, forces = task.world.contacts(world)
    weight = record[col.FORCE_LIMIT] / FORCE_SHARE
    unit = "m" if task.error_name == "distance" else "rad"
    return Frame(
        bodies=(
            BodyView(
                kind="block",
                dimensions=2.0 * record[col.HALF : col.HALF + 3],
                pos=task.world.pos[world, 0],
                quat=task.world.quat[world, 0],
            ),
        ),
        walls=tuple(WallView(wall.normal, wall.offset) for wall in task.world.scene.walls),
        goal=_goal(task, record),
        contact_points=points,
        contact_forces=forces,
        applied_force=wrench[:3],
        applied_torque=wrench[3:],
        text=(
            f"{task.error_name} {outcome[col.ERROR]:.2f} {unit}",
            f"speed {outcome[col.SPEED]:.2f} m/s   spin {outcome[col.SPIN]:.2f} rad/s",
        ),
        force_scale=WEIGHT_ARROW / weight,
    )


def _goal(task: Task, record: np.ndarray) -> GoalView:
    is_held = bool(record[col.HOLD] > 0)
    if task.error_name == "angle":
        return GoalView(reached=is_held, goal_face=int(record[col.FACE]))
    x, z = record[col.GOAL : col.GOAL + 2]
    return GoalView(pos=(x, 0.0, z), radius=GOAL_RADIUS, reached=is_held)


class View:
    """Draws worlds of a task; the renderer is made with the first picture and is left out of pickles.

    Parameters
    ----------
    mode : {"rgb_array", "human"} or None
        None draws nothing.
    width, height : int
        [px].
    fps : float
        [1/s].
    title : str

    Raises
    ------
    ValueError
        On an unknown mode or a size that is not positive.
    gymnasium.error.DependencyNotInstalled
        If there is a mode, but no pygame.
    """

    def __init__(self, mode: str | None, width: int, height: int, fps: float, title: str):
        if mode is not None and mode not in RENDER_MODES:
            raise ValueError(f"render_mode is {mode!r}; allowed are None, {', '.join(map(repr, RENDER_MODES))}")
        for name, value in (("width", width), ("height", height)):
            if isinstance(value, bool) or not isinstance(value, (int, np.integer)) or value < 1:
                raise ValueError(f"{name} is {value!r}; allowed are integers of at least 1")
        if mode is not None:
            require("render", "pygame", purpose="rendering")
        self.mode, self.width, self.height, self.fps, self.title = mode, width, height, fps, title
        self._renderer: Renderer | None = None

    def draw(self, task: Task, world: int = 0) -> np.ndarray:
        """(height, width, 3) uint8 picture of one world; in mode "human" it is shown in the window, too."""
        if self._renderer is None:
            self._renderer = Renderer(self.width, self.height, self.mode, self.fps, self.title)
        return self._renderer.draw(frame_of(task, world))

    def close(self) -> None:
        """Close the window, if any. May be called again."""
        if self._renderer is not None:
            self._renderer.close()
            self._renderer = None

    def __getstate__(self):
        return {**vars(self), "_renderer": None}
