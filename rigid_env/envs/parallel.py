"""Tasks of several agents: each agent has its part of the action, its view of the observation and its reward.

The methods are those of PettingZoo's parallel interface, for which `rigid_env.envs.pettingzoo` adds the base class.
Nothing of PettingZoo is needed here.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from copy import deepcopy
from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium import spaces
from numpy.typing import ArrayLike, NDArray

from physics import validation
from physics.keywords import nearest_first
from rigid_env.envs.env import RigidEnv
from rigid_env.envs.named import CLASS
from rigid_env.envs.task import TaskEnv
from rigid_env.envs.vector_arguments import episode_limit
from rigid_env.tasks import Task
from rigid_env.tasks.task import shaped

Parts = dict[str, Any]
"""Values by agent."""

OWN_TERM = re.compile(r".+\[(.+)\]")
"""Name of a reward term that counts for one agent alone, such as ``near[left]``."""

DUMMY = "options"
"""Option that PettingZoo's own tests pass to every environment; it is ignored."""


class Parallel:
    """A task of one world as an environment of several agents, who act at the same time.

    The attribute `agent` of the task's actions names each agent, and assigns the numbers of an action to the agents. If
    the task's `observation` is a mapping, it lists the entries that each agent sees. If it is a list, every agent sees
    all entries. A term of the reward called ``name[agent]`` counts for this agent alone, all others for everybody. An
    episode ends for all agents at once.

    Parameters
    ----------
    env : RigidEnv
    limit : int or None
        Control steps after which an episode is truncated.

    Attributes
    ----------
    possible_agents, agents : list of str
        All agents, and those of the running episode: all, or none before the first reset and after the end.
    action_spaces, observation_spaces : dict of str to Space
    state_space : Box
        Space of `state`.

    Raises
    ------
    ValueError
        A term of the reward for an agent that is not there, or views of agents in pictures or goals.
    """

    def __init__(self, env: RigidEnv[Any], limit: int | None):
        task: Task = env.task
        self._env, self._limit, self._places = env, limit, task.agents
        self.possible_agents, self.agents = list(task.agents), list[str]()
        self._terms, self._views = own_terms(task), _views(env)
        self._obs: Any = None
        self.action_spaces = {
            agent: spaces.Box(-1.0, 1.0, places.shape, dtype=np.float32) for agent, places in task.agents.items()
        }
        self.observation_spaces = {agent: _cut(env.observation_space, self._views.get(agent)) for agent in task.agents}
        self.state_space = spaces.flatten_space(env.observation_space)
        self.render_mode = env.render_mode
        self.metadata = {**env.metadata, "name": type(task).__name__, "is_parallelizable": True}

    def reset(
        self, seed: int | None = None, options: Mapping[str, Any] | None = None
    ) -> tuple[Parts, dict[str, dict[str, Any]]]:
        """Start an episode; arguments and errors as of `RigidEnv.reset`.

        Returns
        -------
        observations, infos : dict by agent
        """
        known = self._env.task.option_names
        given = {key: value for key, value in (options or {}).items() if key != DUMMY or key in known}
        self._obs, info = self._env.reset(seed=seed, options=given or None)
        self.agents = list(self.possible_agents)
        return self._seen(), self._each(info)

    def step(
        self, actions: Mapping[str, ArrayLike]
    ) -> tuple[Parts, dict[str, float], dict[str, bool], dict[str, bool], dict[str, dict[str, Any]]]:
        """Hold the actions of all agents for one control step.

        Parameters
        ----------
        actions : dict of str to (numbers,) array_like
            Action of every agent, as of `RigidEnv.step`.

        Returns
        -------
        observations, rewards, terminations, truncations, infos : dict by agent

        Raises
        ------
        ValueError
            An agent that is missing or unknown, or an action of another shape or that is not finite. Nothing has
            changed then.
        gymnasium.error.ResetNeeded
            Before the first reset, and after the end of an episode.
        """
        if not self.agents:
            raise gym.error.ResetNeeded("the episode has ended, or none has begun: call reset() before step()")
        self._obs, reward, is_terminated, is_truncated, info = self._env.step(self._joined(actions))
        is_truncated |= self._limit is not None and bool(self._env.task.steps[0] >= self._limit)
        told = self._seen(), self._rewards(reward, info), self._all(is_terminated), self._all(is_truncated)
        infos = self._each(info)
        if is_terminated or is_truncated:
            self.agents = []
        return *told, infos

    def _joined(self, actions: Mapping[str, ArrayLike]) -> np.ndarray:
        """Join the agents' actions to one action of the task."""
        if not isinstance(actions, Mapping) or actions.keys() != self._places.keys():
            given = ", ".join(map(repr, actions)) if isinstance(actions, Mapping) else repr(actions)
            raise ValueError(f"actions is of {given}; allowed is a dict of {', '.join(map(repr, self._places))}")
        action = np.zeros(self._env.task.action_size)
        for agent, places in self._places.items():
            name = f"action of {agent!r}"
            action[places] = shaped(validation.floats(actions[agent], name, "are numbers"), places.shape, name)
        return action

    def _rewards(self, reward: float, info: dict[str, Any]) -> dict[str, float]:
        if self._terms is None:
            return self._all(reward)
        return {agent: float(sum(info[key] for key in keys)) for agent, keys in self._terms.items()}

    def _seen(self) -> Parts:
        return {agent: _part(self._obs, self._views.get(agent)) for agent in self.agents}

    def _each(self, info: dict[str, Any]) -> dict[str, dict[str, Any]]:
        return {agent: dict(info) for agent in self.agents}

    def _all(self, value: Any) -> Parts:
        return dict.fromkeys(self.agents, value)

    def action_space(self, agent: str) -> spaces.Space[Any]:
        """Space of an agent's actions, the same object at each call."""
        return self.action_spaces[agent]

    def observation_space(self, agent: str) -> spaces.Space[Any]:
        """Space of an agent's observations, the same object at each call."""
        return self.observation_spaces[agent]

    def state(self) -> NDArray[Any]:
        """Observation of all entries in one row, for critics that see more than one agent."""
        if self._obs is None:
            raise gym.error.ResetNeeded("call reset() before state()")
        row: Any = spaces.flatten(self._env.observation_space, self._obs)
        return row.copy()

    def render(self) -> NDArray[np.uint8] | None:
        """Draw the world, as `RigidEnv.render` does."""
        return self._env.render()

    def close(self) -> None:
        """Close the window, if any."""
        self._env.close()
        self.agents = []


def own_terms(task: Task) -> dict[str, list[str]] | None:
    """Keys in `info` of the reward terms that each agent gets; None if all agents get the whole reward.

    Raises
    ------
    ValueError
        A term for an agent that is not there.
    """
    owners = {term: found[1] if (found := OWN_TERM.fullmatch(term)) else None for term in task.terms}
    for term, owner in owners.items():
        if owner is not None and owner not in task.agents:
            allowed = ", ".join(nearest_first(owner, task.agents))
            raise ValueError(f"term {term!r} of {type(task).__name__} is of agent {owner!r}; allowed are {allowed}")
    if not any(owners.values()):
        return None
    return {
        agent: [f"reward_{term}" for term, owner in owners.items() if owner in (None, agent)] for agent in task.agents
    }


def _views(env: RigidEnv[Any]) -> Mapping[str, np.ndarray]:
    """Indices of the observation's numbers that each agent sees; empty if all agents see the whole observation."""
    views = env.task.observed.views
    if views and env.observation_space.shape != (env.task.observed.size,):
        raise ValueError(
            f"observation of {type(env.task).__name__} has views of agents; allowed are obs='state' and tasks without "
            "goals, or a list that all agents see"
        )
    return views


def _cut(space: Any, view: np.ndarray | None) -> spaces.Space[Any]:
    if view is None:
        return deepcopy(space)
    return spaces.Box(space.low[view], space.high[view], dtype=space.dtype)


def _part(obs: Any, view: np.ndarray | None) -> Any:
    return deepcopy(obs) if view is None else obs[view]


def single_env(
    task: type[Task] | str, max_episode_steps: Any, settings: Mapping[str, Any]
) -> tuple[RigidEnv[Any], Any]:
    """Make an environment of one world from an id, ``module:Class`` or a class, and find its limit of steps.

    Raises
    ------
    ValueError
        An id of another package, or an argument that the environment refuses.
    """
    if not isinstance(task, str) or CLASS.fullmatch(task):
        env: Any = TaskEnv(task, **settings)
        registered = env.task.max_episode_steps
    else:
        made: Any = gym.make(task, disable_env_checker=True, **settings)
        env, registered = made.unwrapped, made.spec.max_episode_steps
    if not isinstance(env, RigidEnv):
        raise ValueError(f"task is {task!r}, a {type(env).__name__}; allowed are environments of rigid_env")
    is_registered = isinstance(max_episode_steps, str) and max_episode_steps == "registered"
    return env, registered if is_registered else episode_limit(max_episode_steps)
