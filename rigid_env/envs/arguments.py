"""Groups of constructor arguments that several environments share, as dataclasses."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from gymnasium.vector import AutoresetMode

from rigid_env.envs.sources import ObservationArguments
from rigid_env.envs.vector_arguments import Autoreset
from rigid_env.rendering.view import RenderArguments
from rigid_env.tasks import Task


@dataclass(frozen=True)
class TaskArgument:
    """Argument `task` of an environment: the task that it wraps."""

    task: Task


@dataclass(frozen=True)
class CountArgument:
    """Argument `num_envs` of a vector environment: the number of its worlds."""

    num_envs: int = 1


@dataclass(frozen=True)
class EpisodeArguments:
    """Arguments about the ends of episodes in a batch; see `rigid_env.envs.vector_env.RigidVectorEnv`."""

    autoreset_mode: AutoresetMode | Autoreset = AutoresetMode.NEXT_STEP
    max_episode_steps: int | Literal["registered"] | None = "registered"


@dataclass(frozen=True)
class CommonArguments(ObservationArguments, RenderArguments):
    """Arguments that all environments take; see `rigid_env.envs.env.RigidEnv`."""


@dataclass(frozen=True)
class VectorArguments(CommonArguments, EpisodeArguments):
    """Arguments that all vector environments take."""
