"""Sources of observations: the numbers of a task's entries, or pictures of its worlds."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal, TypeVar

import numpy as np
from gymnasium import spaces

from physics import validation
from rigid_env.envs.goals import GoalSource
from rigid_env.rendering.pixels import PixelObserver
from rigid_env.rendering.view import frame_of, room_of
from rigid_env.tasks import Task
from rigid_env.tasks.goal import GoalTask

KINDS = ("state", "pixels")

ObsKind = Literal["state", "pixels"]
"""Kind of observation, one of `KINDS`."""

Obs = TypeVar("Obs")
"""Type of an observation: an array, or a dict of arrays for a task with goals."""


@dataclass(frozen=True)
class ObservationArguments:
    """Arguments about observations and infos of an environment; see `rigid_env.envs.env.RigidEnv`."""

    obs: ObsKind = "state"
    obs_size: Sequence[int] = (84, 84)
    obs_stack: int = 1
    contacts: int = 0
    impacts: int = 0


class StateSource:
    """Source of observations that are the numbers of a task's entries.

    Parameters
    ----------
    task : Task

    Attributes
    ----------
    space : gymnasium.spaces.Box
        Space of one world's observation.
    """

    def __init__(self, task: Task):
        self._task = task
        self.space = spaces.Box(task.observed.low, task.observed.high, dtype=np.float32)

    def start(self, rows: np.ndarray) -> None:
        """Do nothing for worlds `rows` in which episodes begin: the task has observed them."""

    def step(self) -> None:
        """Do nothing after a step: the task has observed all worlds."""

    @property
    def arrays(self) -> dict[str, np.ndarray]:
        """Arrays of the source that belong to a state: none."""
        return {}

    def one(self, world: int) -> np.ndarray:
        """Copy of the observation of one world."""
        return self._task.obs[world].copy()

    def all(self) -> np.ndarray:
        """Copy of the observations of all worlds."""
        return self._task.obs.copy()


class PixelSource:
    """Source of observations that are pictures of the worlds, without text and arrows.

    Parameters
    ----------
    task : Task
    size : (2,) int
        Height and width [px].
    stack : int
        Pictures in one observation, one for each of the last control steps, the newest last. At the start of an episode
        all of them show the start.

    Attributes
    ----------
    space : gymnasium.spaces.Box
        Space of one world's observation: (height, width, 3 * stack) uint8.

    Raises
    ------
    ValueError
        A size or a number of pictures that is not positive.
    gymnasium.error.DependencyNotInstalled
        If pygame is missing.
    """

    def __init__(self, task: Task, size: Sequence[int], stack: int):
        try:
            height, width = size
        except (TypeError, ValueError):
            raise ValueError(f"obs_size is {size!r}; allowed are two integers, height and width") from None
        height, width = validation.count(height, "height of obs_size"), validation.count(width, "width of obs_size")
        self.stack = validation.count(stack, "obs_stack")
        self._task = task
        self._observer = PixelObserver(width, height, room=room_of(task))
        self.space = spaces.Box(0, 255, (height, width, 3 * self.stack), dtype=np.uint8)
        self._pictures = np.zeros((task.worlds, self.stack, height, width, 3), dtype=np.uint8)

    def start(self, rows: np.ndarray) -> None:
        """Draw the worlds `rows` in which episodes begin, and fill their stacks of pictures."""
        for world in rows:
            self._draw(world)
            self._pictures[world, :-1] = self._pictures[world, -1]

    def step(self) -> None:
        """Draw all worlds after a step."""
        self._pictures[:, :-1] = self._pictures[:, 1:]
        for world in range(self._task.worlds):
            self._draw(world)

    @property
    def arrays(self) -> dict[str, np.ndarray]:
        """Arrays of the source that belong to a state, by name, worlds first: the last pictures."""
        return {"pictures": self._pictures}

    def _draw(self, world: int) -> None:
        frame = frame_of(self._task, world, arrows=False)
        if frame.goal is not None and frame.goal.axis is not None:  # pixels of an id never change: a disc on the floor
            frame = replace(frame, goal=replace(frame.goal, axis=None))
        self._observer.observe(frame, self._pictures[world, -1])

    def one(self, world: int) -> np.ndarray:
        """Copy of the observation of one world."""
        return np.concatenate(tuple(self._pictures[world]), axis=-1)

    def all(self) -> np.ndarray:
        """Copy of the observations of all worlds."""
        return np.concatenate(tuple(self._pictures.swapaxes(0, 1)), axis=-1)


def make_source(task: Task, given: ObservationArguments) -> Any:
    """Make the source of observations for an environment's arguments.

    Raises
    ------
    ValueError
        Naming the argument, its value and what is allowed.
    """
    validation.one_of(given.obs, KINDS, "obs")
    source: Any = StateSource(task) if given.obs == "state" else PixelSource(task, given.obs_size, given.obs_stack)
    return GoalSource(task, source) if isinstance(task, GoalTask) else source
