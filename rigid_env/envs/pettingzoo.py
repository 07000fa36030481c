"""Adapter that gives tasks of several agents PettingZoo's parallel interface; it needs the extra ``pettingzoo``."""

from __future__ import annotations

from typing import Any, Literal

from rigid_env.envs.parallel import Parallel, single_env
from rigid_env.extras import require
from rigid_env.tasks import Task

try:
    from pettingzoo import ParallelEnv
except ImportError:
    require("pettingzoo", purpose="rigid_env.envs.pettingzoo")
    raise


class TaskParallelEnv(Parallel, ParallelEnv):
    """A `rigid_env.envs.parallel.Parallel` that also inherits from PettingZoo's base class."""


def parallel_env(
    task: type[Task] | str, max_episode_steps: int | Literal["registered"] | None = "registered", **settings: Any
) -> TaskParallelEnv:
    """Make an environment of several agents from a task.

    Parameters
    ----------
    task : class of Task, or str
        Class, its import path ``module:Class``, or the id of an environment.
    max_episode_steps : int or None
        Control steps after which an episode is truncated; None or -1: never. The default is that of the id or the task.
    settings
        Arguments of the task, such as ``accuracy``, and of its environment, such as ``render_mode``.

    Raises
    ------
    TypeError
        An unknown setting, with the known ones, the nearest first.
    ValueError
        Naming the field, the value and what is allowed.
    """
    return TaskParallelEnv(*single_env(task, max_episode_steps, settings))
