"""Make the batch and the model of Stable-Baselines3 from the configuration of a run."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from functools import partial
from typing import Any

import gymnasium as gym
import numpy as np
import torch
from stable_baselines3 import PPO, SAC, HerReplayBuffer
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.noise import OrnsteinUhlenbeckActionNoise

from agents.config import RunConfig
from agents.environments import make_training_batch
from agents.features import GoalDifference
from physics.keywords import nearest_first
from rigid_env import RigidVecEnv

CLASSES: dict[str, type[BaseAlgorithm]] = {"ppo": PPO, "sac": SAC}

# Adam of PPO as Stable-Baselines3 makes it, updating all parameters in one call: the same bits in less time.
PPO_ADAM = {"eps": 1e-5, "foreach": True}


def make_training_env(config: RunConfig) -> RigidVecEnv:
    """Make the batch that a run trains on; world i draws its episodes from the seed `config.seed` + i."""
    env = RigidVecEnv(make_training_batch(config))
    env.seed(config.seed)
    return env


def algorithm_arguments(config: RunConfig, action_size: int = 6) -> dict[str, Any]:
    """Keyword arguments of the algorithm's class, with objects that YAML cannot hold made from names and numbers.

    Parameters
    ----------
    config : RunConfig
    action_size : int
        Length of an action.

    Raises
    ------
    ValueError
        If `torch.nn` has no such activation, or an entry has unknown keys.
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
    if config.algo == "ppo" and "optimizer_class" not in policy:
        policy["optimizer_kwargs"] = {**PPO_ADAM, **policy.get("optimizer_kwargs", {})}
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
    """Make exploration noise that is correlated over steps; white noise cancels out before a block has moved."""
    if given.keys() != {"sigma", "theta"}:
        raise ValueError(f"action_noise has the keys {', '.join(given)}; allowed are sigma, theta")
    return OrnsteinUhlenbeckActionNoise(np.zeros(size), np.full(size, given["sigma"]), given["theta"], dt=1.0)


def _falling_rate(given: dict[str, float]) -> Callable[[float], float]:
    """Make a learning rate that decreases linearly from the first step of a run to `max_steps`."""
    if given.keys() != {"start", "end"}:
        raise ValueError(f"learning_rate has the keys {', '.join(given)}; allowed are a number, or start, end")
    return partial(_between, given["start"], given["end"])


def _between(start: float, end: float, left: float) -> float:
    """Linear interpolation from `start` to `end`, where the share `left` of the run is still to come."""
    return end + (start - end) * left


def set_up_torch(config: RunConfig) -> None:
    """Set the threads of PyTorch, and leave out its checks of distributions, which cost 3 % of a training.

    A network that has become NaN is found by the environment, which refuses such an action.
    """
    torch.set_num_threads(config.torch_threads)
    torch.distributions.Distribution.set_default_validate_args(False)


def make_model(config: RunConfig, env: RigidVecEnv) -> BaseAlgorithm:
    """Make a new model on the CPU, where small networks are fastest.

    Raises
    ------
    ValueError
        If the algorithm refuses its arguments; the message quotes Stable-Baselines3.
    """
    policy = "MultiInputPolicy" if isinstance(env.observation_space, gym.spaces.Dict) else "MlpPolicy"
    arguments = algorithm_arguments(config, env.action_space.shape[0])
    try:
        return CLASSES[config.algo](policy, env, seed=config.seed, device="cpu", **arguments)
    except (AssertionError, TypeError, ValueError, ZeroDivisionError) as error:
        told = str(error).strip() or type(error).__name__
        raise ValueError(f"algorithm is {config.algorithm}, which {config.algo} refuses: {told}") from error
