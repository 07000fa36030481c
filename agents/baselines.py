"""Policies for comparison with trained agents: random actions, and handwritten controllers.

A policy is a function from observations (n, entries) to actions (n, axes).
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from rigid_env.envs.controllers import AXES, CONTROLLERS, Policy, load_controller, reach_controller, reorient_controller
from rigid_env.envs.named import make_named

__all__ = ["CONTROLLERS", "Policy", "baseline_policy", "random_policy", "reach_controller", "reorient_controller"]


def random_policy(seed: int = 0, axes: int = AXES) -> Policy:
    """Make a policy whose actions are drawn uniformly from the action space.

    Parameters
    ----------
    seed : int
    axes : int
        Numbers of an action.

    Returns
    -------
    callable
        (n, entries) float32 to (n, axes) float32.
    """
    generator = np.random.default_rng(seed)
    return lambda observations: generator.uniform(-1.0, 1.0, (count_of(observations), axes)).astype(np.float32)


def count_of(observations: np.ndarray | Mapping[str, np.ndarray]) -> int:
    """Return the number of worlds in a batch of observations, which are dicts of arrays where a task has goals."""
    return len(next(iter(observations.values())) if isinstance(observations, Mapping) else observations)


def action_size(env_id: str) -> int:
    """Return how many numbers an action of an environment has."""
    env = make_named(env_id)
    shape = env.action_space.shape
    env.close()
    assert shape is not None  # actions of every environment are rows of numbers
    return shape[0]


def baseline_policy(name: str, env_id: str, seed: int = 0) -> Policy:
    """Make a baseline policy by its name.

    Parameters
    ----------
    name : {"random", "controller"}
    env_id : str
        Gymnasium id of the environment.
    seed : int
        Seed of the random policy.

    Returns
    -------
    callable

    Raises
    ------
    ValueError
        On an unknown name, or an environment without a controller.
    """
    if name == "random":
        return random_policy(seed, action_size(env_id))
    if name != "controller":
        raise ValueError(f"baseline is {name!r}; allowed are 'random' and 'controller'")
    if env_id not in CONTROLLERS:
        raise ValueError(f"baseline is 'controller', env is {env_id!r}; allowed are {', '.join(CONTROLLERS)}")
    return load_controller(env_id)
