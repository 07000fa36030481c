"""Common base of the block's environments, single and native vector."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any, ClassVar, Literal

from gymnasium.vector import AutoresetMode
from numpy.typing import NDArray

import physics
from physics import validation
from physics.annotations import Effect, Layout, Preset
from rigid_env.envs.attributes import EpisodeParameters
from rigid_env.envs.env import RigidEnv
from rigid_env.envs.sources import ObsKind
from rigid_env.envs.vector_arguments import Autoreset
from rigid_env.envs.vector_env import RigidVectorEnv
from rigid_env.rendering.camera_argument import CameraArgument
from rigid_env.rendering.view import RenderMode
from rigid_env.tasks.block import BlockTask
from rigid_env.tasks.parameters import Edges, Number


class BlockEnv(EpisodeParameters, RigidEnv[NDArray[Any]]):
    """A task of the block as a Gymnasium environment; subclasses name the task.

    Parameters
    ----------
    render_mode, width, height, obs, obs_size, obs_stack, contacts, impacts, camera, arrows
        As of `RigidEnv`.
    accuracy, walls, half_width, mass, size, friction, restitution, gravity, effects, frame_skip, dt, dump_faults
        Of the task, see `rigid_env.tasks.block.BlockTask`.
    threads : int
        Taken so that the same arguments make a batch; one world has one thread.

    Raises
    ------
    TypeError
        An unknown argument, with the known ones, the nearest first.
    ValueError
        Naming the field, the value and what is allowed.
    """

    task_class: ClassVar[type[BlockTask]]

    def __init__(
        self,
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
        accuracy: Preset | physics.Accuracy = "balanced",
        walls: Layout = "three",
        half_width: float = 10.0,
        mass: Number = 6.0,
        size: Edges = (5.0, 3.0, 2.0),
        friction: Number = 0.5,
        restitution: Number = 0.2,
        gravity: Number = 9.81,
        effects: Iterable[Effect] = (),
        frame_skip: int = 5,
        dt: float = 0.005,
        dump_faults: str | Path | None = None,
        threads: int = 1,
    ) -> None:
        task = self.task_class(
            1, threads=threads, accuracy=accuracy, walls=walls, half_width=half_width, mass=mass, size=size,
            friction=friction, restitution=restitution, gravity=gravity, effects=effects, frame_skip=frame_skip, dt=dt,
            dump_faults=dump_faults,
        )  # fmt: skip
        told = render_mode, width, height, obs, obs_size, obs_stack, contacts, impacts
        super().__init__(task, *told, camera=camera, arrows=arrows)

    def _documented(self) -> type:
        return type(self)


class BlockVectorEnv(RigidVectorEnv[NDArray[Any]]):
    """Many worlds of a task of the block; subclasses name the task.

    Parameters
    ----------
    num_envs : int
    autoreset_mode, max_episode_steps, render_mode, width, height, camera, arrows, obs, obs_size, obs_stack,
    contacts, impacts
        As of `RigidVectorEnv`.
    threads : int
        Threads that share a step.
    accuracy, walls, half_width, mass, size, friction, restitution, gravity, effects, frame_skip, dt, dump_faults
        Of the task, see `rigid_env.tasks.block.BlockTask`.

    Raises
    ------
    TypeError
        An unknown argument, with the known ones, the nearest first.
    ValueError
        Naming the field, the value and what is allowed.
    """

    task_class: ClassVar[type[BlockTask]]

    def __init__(
        self,
        num_envs: int = 1,
        autoreset_mode: AutoresetMode | Autoreset = AutoresetMode.NEXT_STEP,
        max_episode_steps: int | Literal["registered"] | None = "registered",
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
        threads: int = 1,
        accuracy: Preset | physics.Accuracy = "balanced",
        walls: Layout = "three",
        half_width: float = 10.0,
        mass: Number = 6.0,
        size: Edges = (5.0, 3.0, 2.0),
        friction: Number = 0.5,
        restitution: Number = 0.2,
        gravity: Number = 9.81,
        effects: Iterable[Effect] = (),
        frame_skip: int = 5,
        dt: float = 0.005,
        dump_faults: str | Path | None = None,
    ) -> None:
        task = self.task_class(
            validation.count(num_envs, "num_envs"), threads=threads, accuracy=accuracy, walls=walls,
            half_width=half_width, mass=mass, size=size, friction=friction, restitution=restitution, gravity=gravity,
            effects=effects, frame_skip=frame_skip, dt=dt, dump_faults=dump_faults,
        )  # fmt: skip
        told = render_mode, width, height, obs, obs_size, obs_stack, contacts, impacts
        super().__init__(task, autoreset_mode, max_episode_steps, *told, camera=camera, arrows=arrows)
