"""Environments and models of a run, made from its configuration."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from functools import partial
from typing import Any

import gymnasium as gym
import numpy as np
import torch
from gymnasium.vector import AutoresetMode
from stable_baselines3 import PPO, SAC, HerReplayBuffer
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.noise import OrnsteinUhlenbeckActionNoise

import physics
from agents.config import RunConfig
from agents.features import GoalDifference
from physics.keywords import nearest_first
from rigid_env import RigidVecEnv
from rigid_env.envs.named import not_there

# How Python, and `physics.keywords` with it, says that there is no such argument.
UNKNOWN_ARGUMENT = "unexpected keyword argument"

CLASSES: dict[str, type[BaseAlgorithm]] = {"ppo": PPO, "sac": SAC}


def make_single_env(env: str, **arguments: Any) -> gym.Env:
    """A single environment; arguments as `make_vector_env`, all except `num_envs`."""
    return _make(gym.make, env, arguments)


def make_vector_env(env: str, num_envs: int, **arguments: Any) -> gym.vector.VectorEnv:
    """The native batch of an environment.

    Parameters
    ----------
    env : str
        Gymnasium id.
    num_envs : int
    **arguments
        Of the environment, `autoreset_mode` and `threads` among them. `accuracy` may be a dict, too: the
        fields of a `physics.Accuracy`.

    Raises
    ------
    ValueError
        If there is no such environment, or an argument is out of range.
    """
    native = {"num_envs": num_envs, "vectorization_mode": "vector_entry_point"}
    return _make(gym.make_vec, env, {**native, **arguments})


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


def make_training_env(config: RunConfig) -> RigidVecEnv:
    """The batch that a run trains on, seeded: world i draws its episodes from the seed `config.seed` + i."""
    vector_env = make_vector_env(
        config.env,
        config.num_envs,
        autoreset_mode=AutoresetMode.SAME_STEP,
        threads=config.threads,
        accuracy=config.accuracy,
        **config.env_kwargs,
    )
    env = RigidVecEnv(vector_env)
    env.seed(config.seed)
    return env


def algorithm_arguments(config: RunConfig, action_size: int = 6) -> dict[str, Any]:
    """Keyword arguments of the algorithm's class, with what YAML cannot hold made from names and numbers.

    Parameters
    ----------
    config : RunConfig
    action_size : int
        Numbers of an action.

    Raises
    ------
    ValueError
        If `torch.nn` has no such activation, or an entry has keys that nothing reads.
    """
    arguments = dict(config.algorithm)
    known = [*inspect.signature(CLASSES[config.algo]).parameters, "hindsight", "action_noise"]
    for name in arguments.keys() - set(known):
        allowed = ", ".join(nearest_first(name, known))
        raise ValueError(f"algorithm.{name} is no argument of {config.algo}; allowed are {allowed}")
    policy = dict(arguments.pop("policy_kwargs", {}))
    if "activation_fn" in policy:
        name = policy["activation_fn"]
        if not hasattr(torch.nn, name):
            raise ValueError(f"policy_kwargs.activation_fn is {name!r}; allowed are class names of torch.nn")
        policy["activation_fn"] = getattr(torch.nn, name)
    if "hindsight" in arguments:
        policy["features_extractor_class"] = GoalDifference
        arguments["replay_buffer_class"] = HerReplayBuffer
        arguments["replay_buffer_kwargs"] = arguments.pop("hindsight")
    if isinstance(arguments.get("learning_rate"), dict):
        arguments["learning_rate"] = _falling_rate(arguments["learning_rate"])
    if "action_noise" in arguments:
        arguments["action_noise"] = _slow_noise(arguments["action_noise"], action_size)
    return {**arguments, "policy_kwargs": policy}


def _slow_noise(given: dict[str, float], size: int) -> OrnsteinUhlenbeckActionNoise:
    """Noise that lasts for some steps: white noise cancels out before a block has moved."""
    if given.keys() != {"sigma", "theta"}:
        raise ValueError(f"action_noise has the keys {', '.join(given)}; allowed are sigma, theta")
    return OrnsteinUhlenbeckActionNoise(np.zeros(size), np.full(size, given["sigma"]), given["theta"], dt=1.0)


def _falling_rate(given: dict[str, float]) -> Callable[[float], float]:
    """Learning rate that falls in a line from the first step of a run to `max_steps`."""
    if given.keys() != {"start", "end"}:
        raise ValueError(f"learning_rate has the keys {', '.join(given)}; allowed are a number, or start, end")
    return partial(_between, given["start"], given["end"])


def _between(start: float, end: float, left: float) -> float:
    """Value where the share `left` of a run is left."""
    return end + (start - end) * left


def make_model(config: RunConfig, env: RigidVecEnv) -> BaseAlgorithm:
    """A new model on the CPU, where small networks are fastest.

    Raises
    ------
    ValueError
        If the algorithm refuses its arguments, in the words of Stable-Baselines3.
    """
    policy = "MultiInputPolicy" if isinstance(env.observation_space, gym.spaces.Dict) else "MlpPolicy"
    arguments = algorithm_arguments(config, env.action_space.shape[0])
    try:
        return CLASSES[config.algo](policy, env, seed=config.seed, device="cpu", **arguments)
    except (AssertionError, TypeError, ValueError, ZeroDivisionError) as error:
        told = str(error).strip() or type(error).__name__
        raise ValueError(f"algorithm is {config.algorithm}, which {config.algo} refuses: {told}") from error
