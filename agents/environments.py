"""Make environments by their Gymnasium id, without PyTorch."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium.vector import AutoresetMode

import physics
from agents.config import RunConfig
from rigid_env.envs.named import not_there

# Text in the errors of Python and of `physics.keywords` for an unknown argument.
UNKNOWN_ARGUMENT = "unexpected keyword argument"


def make_single_env(env: str, **arguments: Any) -> gym.Env:
    """Make a single environment; arguments as of `make_vector_env`, without `num_envs`."""
    return _make(gym.make, env, arguments)


def make_vector_env(env: str, num_envs: int, **arguments: Any) -> gym.vector.VectorEnv:
    """Make the native batch of an environment.

    Parameters
    ----------
    env : str
        Gymnasium id.
    num_envs : int
        Number of worlds.
    **arguments
        Arguments of the environment, with `autoreset_mode` and `threads`. `accuracy` may also be a dict with the fields
        of a `physics.Accuracy`.

    Raises
    ------
    ValueError
        If there is no such environment, or an argument is out of range.
    """
    native = {"num_envs": num_envs, "vectorization_mode": "vector_entry_point"}
    return _make(gym.make_vec, env, {**native, **arguments})


def make_training_batch(config: RunConfig) -> gym.vector.VectorEnv:
    """Make the native batch that a run trains on."""
    return make_vector_env(
        config.env,
        config.num_envs,
        autoreset_mode=AutoresetMode.SAME_STEP,
        threads=config.threads,
        accuracy=config.accuracy,
        **config.env_kwargs,
    )


def warm_kernels(config: RunConfig) -> None:
    """Compile the kernels of a run's training, or load them, by one step of its environment."""
    batch = make_training_batch(config)
    batch.reset(seed=config.seed)
    batch.step(np.zeros(batch.action_space.shape, batch.action_space.dtype))
    batch.close()


def _make(maker: Callable[..., Any], env: str, arguments: dict[str, Any]) -> Any:
    if isinstance(arguments.get("accuracy"), dict):
        arguments = {**arguments, "accuracy": physics.Accuracy(**arguments["accuracy"])}
    try:
        return maker(env, **arguments)
    except gym.error.UnregisteredEnv as error:
        raise not_there(env) from error
    except TypeError as error:
        if UNKNOWN_ARGUMENT in str(error):
            raise ValueError(f"env_kwargs: {error}") from error
        raise
