"""Environments of this package by what a user types: an id, or a task's class; modules of the working folder count."""

from __future__ import annotations

import os
import re
import sys

import gymnasium as gym

from rigid_env.envs.env import RigidEnv
from rigid_env.envs.task import TaskEnv

CLASS = re.compile(r"[\w.]+:[A-Za-z_]\w*")

ALLOWED = "allowed are ids such as 'rigid_env/BlockReach-v0', 'module:id', and 'module:Class' of a task"


def make_named(name: str, field: str = "env") -> gym.Env:
    """Make an environment that a user names.

    Parameters
    ----------
    name : str
        Id, ``module:id``, or ``module:Class`` of a task.
    field : str
        What the name is called in errors.

    Returns
    -------
    gymnasium.Env
        Wrapped as its id says; of a class, limited to the steps of its episodes.

    Raises
    ------
    ValueError
        There is none, or it is not of this package.
    """
    if os.getcwd() not in sys.path:  # as `python -m` has it; an installed command does not
        sys.path.append(os.getcwd())
    if CLASS.fullmatch(name):
        env = TaskEnv(name)
        limit = env.task.max_episode_steps
        return env if limit is None else gym.wrappers.TimeLimit(env, limit)
    try:
        made = gym.make(name, disable_env_checker=True)
    except (gym.error.Error, ImportError) as error:
        raise ValueError(f"{field} is {name!r}, which is not there ({error}); {ALLOWED}") from error
    if not isinstance(made.unwrapped, RigidEnv):
        kind = type(made.unwrapped).__name__
        raise ValueError(f"{field} is {name!r}, a {kind}; allowed are environments of rigid_env")
    return made
