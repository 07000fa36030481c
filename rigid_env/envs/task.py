"""Any task as an environment, and as a batch of worlds."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Literal

from gymnasium.vector import AutoresetMode

from physics import validation
from rigid_env.envs.env import RigidEnv
from rigid_env.envs.making import make_task
from rigid_env.envs.sources import ObsKind
from rigid_env.envs.vector_arguments import Autoreset
from rigid_env.envs.vector_env import RigidVectorEnv
from rigid_env.rendering.camera_argument import CameraArgument
from rigid_env.rendering.view import RenderMode
from rigid_env.tasks import Task


class TaskEnv(RigidEnv[Any]):
    """Any task as a Gymnasium environment; see `rigid_env.register_task`.

    Parameters
    ----------
    task : class of Task, or str
        Class, or its name ``module:Class``.
    render_mode, width, height, obs, obs_size, obs_stack, contacts, impacts, camera, arrows
        As of `RigidEnv`.
    settings
        Arguments of the task.

    Raises
    ------
    TypeError
        An unknown argument, with the known ones, the nearest first.
    ValueError
        The message names the field, its value and what is allowed.
    """

    def __init__(
        self,
        task: type[Task] | str,
        render_mode: RenderMode | None = None,
        width: int = 960,
        height: int = 600,
        *,
        camera: CameraArgument = None,
        arrows: bool = True,
        obs: ObsKind = "state",
        obs_size: Sequence[int] = (84, 84),
        obs_stack: int = 1,
        contacts: int = 0,
        impacts: int = 0,
        **settings: Any,
    ) -> None:
        told = render_mode, width, height, obs, obs_size, obs_stack, contacts, impacts
        super().__init__(make_task(task, 1, settings), *told, camera=camera, arrows=arrows)


class TaskVectorEnv(RigidVectorEnv[Any]):
    """Many worlds of any task as a Gymnasium vector environment; see `rigid_env.register_task`.

    Parameters
    ----------
    num_envs : int
        Number of worlds.
    task : class of Task, or str
        Class, or its name ``module:Class``.
    autoreset_mode, max_episode_steps, render_mode, width, height, camera, arrows, obs, obs_size, obs_stack,
    contacts, impacts
        As of `RigidVectorEnv`.
    settings
        Arguments of the task, ``threads`` among them.

    Raises
    ------
    TypeError
        An unknown argument, with the known ones, the nearest first.
    ValueError
        The message names the field, its value and what is allowed.
    """

    def __init__(
        self,
        num_envs: int = 1,
        *,
        task: type[Task] | str,
        autoreset_mode: AutoresetMode | Autoreset = AutoresetMode.NEXT_STEP,
        max_episode_steps: int | Literal["registered"] | None = "registered",
        render_mode: RenderMode | None = None,
        width: int = 960,
        height: int = 600,
        camera: CameraArgument = None,
        arrows: bool = True,
        obs: ObsKind = "state",
        obs_size: Sequence[int] = (84, 84),
        obs_stack: int = 1,
        contacts: int = 0,
        impacts: int = 0,
        **settings: Any,
    ) -> None:
        batch = make_task(task, validation.count(num_envs, "num_envs"), settings)
        told = render_mode, width, height, obs, obs_size, obs_stack, contacts, impacts
        super().__init__(batch, autoreset_mode, max_episode_steps, *told, camera=camera, arrows=arrows)
