"""Observations and rewards of environments with goals."""

from __future__ import annotations

import numpy as np
from gymnasium import spaces

from rigid_env.tasks import Task
from rigid_env.tasks.goal import GoalTask

METHODS = ("compute_reward", "compute_terminated", "compute_truncated")
"""Methods that depend only on goals, not on the state of an environment, as in Gymnasium-Robotics."""


def lend_goals(task: Task, env) -> None:
    """Give an environment the methods `METHODS` of its task, if the task has goals."""
    if isinstance(task, GoalTask):
        for name in METHODS:
            setattr(env, name, getattr(task, name))


class GoalSource:
    """Source of observations as dicts, which contain the achieved and the desired goal.

    Parameters
    ----------
    task : GoalTask
    inner : StateSource or PixelSource
        Source of the part ``observation``.

    Attributes
    ----------
    space : gymnasium.spaces.Dict
        Space of one world's observation: ``observation``, ``achieved_goal`` and ``desired_goal``.
    """

    def __init__(self, task: GoalTask, inner):
        self._task, self._inner = task, inner
        goal = spaces.Box(task.goals.low, task.goals.high, dtype=np.float32)
        self.space = spaces.Dict({"observation": inner.space, "achieved_goal": goal, "desired_goal": goal})
        self.start, self.step = inner.start, inner.step

    @property
    def arrays(self) -> dict[str, np.ndarray]:
        """Memory of the source, by name, with the worlds first."""
        return self._inner.arrays

    def one(self, world: int) -> dict[str, np.ndarray]:
        """Copy of the observation of one world."""
        achieved, desired = self._task.achieved_goal[world], self._task.desired_goal[world]
        return self._dict(self._inner.one(world), achieved.copy(), desired.copy())

    def all(self) -> dict[str, np.ndarray]:
        """Copy of the observations of all worlds."""
        return self._dict(self._inner.all(), self._task.achieved_goal.copy(), self._task.desired_goal.copy())

    @staticmethod
    def _dict(observation, achieved, desired) -> dict[str, np.ndarray]:
        return {"achieved_goal": achieved, "desired_goal": desired, "observation": observation}
