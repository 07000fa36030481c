"""Find an environment by a user's input: an id, or a task class, also of a module in the working folder."""

from __future__ import annotations

import os
import re
import sys
from collections.abc import Iterable

import gymnasium as gym

from physics.keywords import alike
from rigid_env.envs.env import RigidEnv
from rigid_env.envs.task import TaskEnv

CLASS = re.compile(r"[\w.]+:[A-Za-z_]\w*")

NAMED = 5
"""Largest number of known names that the error about an unknown name lists."""


def known_ids() -> list[str]:
    """Ids of all environments of this package, those of registered tasks included."""
    return [name for name, spec in gym.registry.items() if str(spec.entry_point).startswith("rigid_env.")]


def near_names(name: str, others: Iterable[str] = ()) -> list[str]:
    """Ids, and names of `others`, that are similar to a name; the first ids if none is similar.

    Namespace, version and module of the names are ignored. Gymnasium's own suggestions include environments of other
    packages, and do not work for an id without namespace.
    """
    bare = {_bare(each): each for each in [*others, *known_ids()]}
    found = [bare[each] for each in alike(_bare(name), bare)]
    return (found or known_ids())[:NAMED]


def _bare(name: str) -> str:
    """Bare name of an id: BlockReach of ``module:rigid_env/BlockReach-v0``."""
    return re.sub(r"-v\d+$", "", re.split("[:/]", name)[-1])


def not_there(name: str, field: str = "env", why: object = "", others: Iterable[str] = ()) -> ValueError:
    """Make the error for a name that no environment has; it lists similar names.

    Parameters
    ----------
    name, field
        As of `make_named`.
    why : object
        Reason in brackets, such as the error of an import.
    others : sequence of str
        Further names that are allowed.
    """
    near = ", ".join(map(repr, near_names(name, others)))
    reason = f" ({why})" if why else ""
    allowed = f"allowed are names such as {near}, 'module:id', and 'module:Class' of a task"
    return ValueError(f"{field} is {name!r}, which is not there{reason}; {allowed}")


def make_named(name: str, field: str = "env", others: Iterable[str] = ()) -> gym.Env:
    """Make the environment of a user's input.

    Parameters
    ----------
    name : str
        Id, ``module:id``, or ``module:Class`` of a task.
    field : str
        Name of the argument in errors.
    others : sequence of str
        Further names that the caller allows, for errors.

    Returns
    -------
    gymnasium.Env
        For an id with the wrappers of `gymnasium.make`, for a class with the limit of its episodes.

    Raises
    ------
    ValueError
        There is no such environment, or it is not of this package.
    """
    if os.getcwd() not in sys.path:  # as `python -m` has it; an installed command does not
        sys.path.append(os.getcwd())
    if CLASS.fullmatch(name):
        env = TaskEnv(name)
        limit = env.task.max_episode_steps
        return env if limit is None else gym.wrappers.TimeLimit(env, limit)
    try:
        made = gym.make(name, disable_env_checker=True)
    except gym.error.UnregisteredEnv as error:
        raise not_there(name, field, others=others) from error
    except (gym.error.Error, ImportError) as error:
        raise not_there(name, field, error, others) from error
    if not isinstance(made.unwrapped, RigidEnv):
        kind = type(made.unwrapped).__name__
        raise ValueError(f"{field} is {name!r}, a {kind}; allowed are environments of rigid_env")
    return made
