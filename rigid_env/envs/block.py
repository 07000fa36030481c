"""Base classes of the block's environments, single and native vector."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

from numpy.typing import NDArray

from physics import validation
from rigid_env.envs.arguments import CommonArguments, CountArgument, VectorArguments
from rigid_env.envs.env import RigidEnv
from rigid_env.envs.vector_env import RigidVectorEnv
from rigid_env.tasks.arguments import ControlArguments, part, takes
from rigid_env.tasks.block import BlockArguments, BlockTask


@dataclass(frozen=True)
class _SingleArguments(ControlArguments, BlockArguments, CommonArguments):
    pass


@dataclass(frozen=True)
class _BatchArguments(ControlArguments, BlockArguments, VectorArguments, CountArgument):
    pass


class BlockEnv(RigidEnv[NDArray[Any]]):
    """A task of the block as a Gymnasium environment; subclasses name the task.

    Parameters
    ----------
    render_mode, width, height, obs, obs_size, obs_stack, contacts, impacts, camera, arrows
        As of `RigidEnv`.
    accuracy, walls, half_width, mass, size, friction, restitution, gravity, effects, frame_skip, dt, dump_faults
        Arguments of the task, see `rigid_env.tasks.block.BlockTask`.
    threads : int
        Accepted so that the same arguments make a batch, too; a single world always has one thread.

    Raises
    ------
    TypeError
        An unknown argument, with the known ones, the nearest first.
    ValueError
        The message names the field, its value and what is allowed.
    """

    task_class: ClassVar[type[BlockTask]]

    @takes(_SingleArguments)
    def __init__(self, given: _SingleArguments) -> None:
        task = self.task_class(1, **part(given, BlockArguments, ControlArguments))
        super().__init__(task, **part(given, CommonArguments))

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
        Arguments of the task, see `rigid_env.tasks.block.BlockTask`.

    Raises
    ------
    TypeError
        An unknown argument, with the known ones, the nearest first.
    ValueError
        The message names the field, its value and what is allowed.
    """

    task_class: ClassVar[type[BlockTask]]

    @takes(_BatchArguments)
    def __init__(self, given: _BatchArguments) -> None:
        worlds = validation.count(given.num_envs, "num_envs")
        task = self.task_class(worlds, **part(given, BlockArguments, ControlArguments))
        super().__init__(task, **part(given, VectorArguments))
