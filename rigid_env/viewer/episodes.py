"""Environment that the viewer plays live: episodes in a copy of the environment, driven by a policy."""

from __future__ import annotations

import copy
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from typing import Any, NamedTuple

import gymnasium as gym
import numpy as np
from gymnasium import spaces

from physics.accuracy import Accuracy
from physics.annotations import Preset
from rigid_env.rendering.view import frame_of
from rigid_env.tasks.state import TaskState
from rigid_env.viewer.copies import accuracy_name, copied, fitted
from rigid_env.viewer.hand import HandOfUser
from rigid_env.viewer.worlds import LiveSubject

Policy = Callable[[Any], np.ndarray]

Chain = tuple[TaskState, list[dict[str, Any]]]
"""Type: state of an environment, and for each of its wrappers a dict with a copy of its attributes."""

APART = ("env", "spec", "metadata")
"""Attributes of wrappers that do not belong to a state."""


class State(NamedTuple):
    """Everything that decides how a played environment continues, random actions included."""

    chain: Chain
    observation: Any
    is_ended: bool
    episode: tuple[int, float]
    shift: float
    generator: Mapping[str, Any]


class LiveEnv(LiveSubject):
    """Environment that is played live: a policy acts in it, and so does the user.

    After the end of an episode, the next step begins a new one.

    Parameters
    ----------
    env : gymnasium.Env
        A `RigidEnv`, wrapped or not; it is copied and stays unchanged.
    name : str
        Short name for titles.
    seed : int
        Seed of random actions, and of the first episode if the environment has not begun one.
    policy : callable, optional
        Function from observations to actions, both with the worlds first: (1, entries) or a dict of such arrays to
        (1, numbers). None: random actions.
    accuracy : str or Accuracy, optional
        None: the environment's.
    """

    def __init__(self, env: gym.Env, name: str, seed: int = 0, policy: Policy | None = None, accuracy=None):
        env = copied_env(env, accuracy)
        world = env.unwrapped.task.world
        self._envs = {accuracy_name(world.accuracy): env}
        super().__init__(world, name, seed=True)
        self._policy = policy
        self._begin_run(seed)
        self._begin_first(seed)
        self._first = self._take()

    def _use(self, accuracy: str) -> None:
        super()._use(accuracy)
        self._env = self._envs[accuracy]
        self._task = self._env.unwrapped.task

    def _begin_run(self, seed: int) -> None:
        self.seed, self._generator = seed, np.random.default_rng(seed)
        self._is_ended, self._episode = False, (0, 0.0)
        self._shift = 0.0  # time of the viewer minus time of the world [s]: with gusts, a reset sets the latter to 0

    def _begin_first(self, seed: int) -> None:
        """Continue the environment's current episode, or begin one.

        A new episode begins if the environment has none, or if a policy needs an observation that only a wrapper can
        make.
        """
        inner = self._env.unwrapped
        is_waiting = inner.get_state().arrays["waiting"][0]
        is_changed = self._env.observation_space != inner.observation_space  # by a wrapper
        if is_waiting or (is_changed and self._policy is not None):
            self._observation, _ = self._env.reset(seed=seed)
        else:
            self._observation = inner._source.one(0)
        self.listener.is_changed = False

    @property
    def interval(self) -> float:
        return self._task.control_dt

    @property
    def message(self) -> str:
        """Number of the episode, and its return so far."""
        number, total = self._episode
        return f"episode {number + 1}, return {total:.2f}"

    def frame(self):
        return frame_of(self._task)

    # --- time ----------------------------------------------------------------------------------------------------

    def restart(self, seed: int) -> None:
        put_chain(self._env, self._first.chain, is_other=True)
        self._observation, _ = self._env.reset(seed=seed)
        self._begin_run(seed)
        self.listener.resume({})

    def step(self, load=None, record=None):
        self.listener.begin()
        if self._is_ended:
            before = self.world.time
            self._observation, _ = self._env.reset()
            self._shift += before - self.world.time
            self._is_ended, self._episode = False, (self._episode[0] + 1, 0.0)
        action = self._act() if record is None else record
        hand = self._task.disturbed
        hand.pull = load
        try:
            self._observation, reward, is_over, is_cut, _ = self._env.step(action)
        finally:
            hand.pull = None
        self._is_ended = bool(is_over or is_cut)
        self._episode = self._episode[0], self._episode[1] + float(reward)
        return action

    def _act(self) -> np.ndarray:
        space = self._env.action_space
        if self._policy is None:
            low, high = np.maximum(space.low, -1.0), np.minimum(space.high, 1.0)
            return self._generator.uniform(low, high).astype(space.dtype)
        seen = self._observation
        batch = {name: part[None] for name, part in seen.items()} if isinstance(seen, Mapping) else seen[None]
        actions = np.asarray(self._policy(batch))
        if actions.shape != (1, *space.shape):
            raise ValueError(f"policy gave actions of shape {actions.shape}; allowed is {(1, *space.shape)}")
        return actions[0].astype(space.dtype)

    def _take(self) -> State:
        return State(
            take_chain(self._env), copy.deepcopy(self._observation), self._is_ended, self._episode, self._shift,
            self._generator.bit_generator.state,
        )  # fmt: skip

    def _put(self, state: State, is_other: bool = False) -> None:
        put_chain(self._env, state.chain, is_other)
        self._observation = copy.deepcopy(state.observation)
        self._is_ended, self._episode, self._shift = state.is_ended, state.episode, state.shift
        self._generator.bit_generator.state = state.generator

    # --- parameters and accuracy ---------------------------------------------------------------------------------

    def _hold(self, name: str, value: float) -> None:
        """Change a parameter now, and also in later episodes if the task draws it."""
        if name in self._task.own_draws:
            self._task.hold(name, value)
        else:
            super()._hold(name, value)

    def rehearsal(self) -> Callable[[], None]:
        return _rehearsed(copied_env(self._env))

    def prepare(self, name: str) -> Callable[[], None]:
        env = copied_env(self._env, name)
        self._envs[self._add(env.unwrapped.task.world)] = env
        return _rehearsed(env)


def copied_env(env: gym.Env, accuracy: Preset | Accuracy | None = None) -> gym.Env:
    """Copy an environment with its wrappers; the copy has a world of its own in which sliders act, and opens no window.

    The copy's world has the same state, and the given accuracy (None: the same).
    """
    task = env.unwrapped.task
    own = copy.deepcopy(env, {id(task.world): copied(task.world, accuracy)})
    own.unwrapped.render_mode = None
    task = own.unwrapped.task
    if not isinstance(task.disturbed, HandOfUser):
        task.disturbed = HandOfUser(task.disturbed)
    return own


def wrappers(env: gym.Env) -> Iterator[gym.Wrapper]:
    """Wrappers around an environment, the outermost first."""
    while isinstance(env, gym.Wrapper):
        yield env
        env = env.env


def take_chain(env: gym.Env) -> Chain:
    """Copy the state of an environment, and the attributes of its wrappers."""
    remembered = []
    for wrapper in wrappers(env):
        kept = {name: value for name, value in vars(wrapper).items() if name not in APART}
        remembered.append({name: value for name, value in kept.items() if not isinstance(value, spaces.Space)})
    return env.unwrapped.get_state(), copy.deepcopy(remembered)


def put_chain(env: gym.Env, chain: Chain, is_other: bool = False) -> None:
    """Restore an environment and its wrappers from `take_chain`; `is_other`: taken at another accuracy."""
    state, remembered = chain
    if is_other:
        state = replace(state, world=fitted(state.world, env.unwrapped.task.world))
    env.unwrapped.set_state(state)
    for wrapper, values in zip(wrappers(env), copy.deepcopy(remembered), strict=True):
        vars(wrapper).update(values)


def _rehearsed(env: gym.Env) -> Callable[[], None]:
    """Make a function that compiles the kernels of an environment, by running one step of an episode."""

    def work() -> None:
        env.reset(seed=0)
        env.step(np.zeros(env.action_space.shape, env.action_space.dtype))
        frame_of(env.unwrapped.task)

    return work
