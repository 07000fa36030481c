"""An environment that is played live, in a copy of it and its wrappers: episode after episode, by a policy."""

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
"""State of an environment, and what each of its wrappers remembers."""

APART = ("env", "spec", "metadata")
"""Attributes of wrappers that are no state."""


class State(NamedTuple):
    """All that decides how an environment goes on, the random actions included."""

    chain: Chain
    observation: Any
    is_ended: bool
    episode: tuple[int, float]
    shift: float
    generator: Mapping[str, Any]


class LiveEnv(LiveSubject):
    """Environment in which a policy acts, and the user.

    An episode that has ended is followed by the next one, with the next step.

    Parameters
    ----------
    env : gymnasium.Env
        Of a `RigidEnv`, wrapped or not; it stays as it is.
    name : str
    seed : int
        Of the first episode, if the environment has none begun, and of random actions.
    policy : callable, optional
        Observations with the worlds first, (1, entries) or a dict of such arrays, to actions (1, numbers). None: random
        actions.
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
        self._shift = 0.0  # where gusts blow, a reset sets the time of the world to 0

    def _begin_first(self, seed: int) -> None:
        """Go on with the episode that has begun, or begin one: where none has, or its observation cannot be read."""
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
        """Episode and return so far."""
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
        """Change a parameter now, and in later episodes where they draw it."""
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
    """Copy an environment and its wrappers, in a world of its own in which sliders act; it opens no window.

    Every reference to the world in it becomes one to a new world at this accuracy (None: the same), in the same state.
    """
    task = env.unwrapped.task
    own = copy.deepcopy(env, {id(task.world): copied(task.world, accuracy)})
    own.unwrapped.render_mode = None
    task = own.unwrapped.task
    if not isinstance(task.disturbed, HandOfUser):
        task.disturbed = HandOfUser(task.disturbed)
    return own


def wrappers(env: gym.Env) -> Iterator[gym.Wrapper]:
    """Wrappers of an environment, the outermost first."""
    while isinstance(env, gym.Wrapper):
        yield env
        env = env.env


def take_chain(env: gym.Env) -> Chain:
    """State of an environment, and copies of what its wrappers remember."""
    remembered = []
    for wrapper in wrappers(env):
        kept = {name: value for name, value in vars(wrapper).items() if name not in APART}
        remembered.append({name: value for name, value in kept.items() if not isinstance(value, spaces.Space)})
    return env.unwrapped.get_state(), copy.deepcopy(remembered)


def put_chain(env: gym.Env, chain: Chain, is_other: bool = False) -> None:
    """Let an environment and its wrappers go on from a state of `take_chain`; `is_other`: of another accuracy."""
    state, remembered = chain
    if is_other:
        state = replace(state, world=fitted(state.world, env.unwrapped.task.world))
    env.unwrapped.set_state(state)
    for wrapper, values in zip(wrappers(env), copy.deepcopy(remembered), strict=True):
        vars(wrapper).update(values)


def _rehearsed(env: gym.Env) -> Callable[[], None]:
    """Work that compiles what an environment calls, by an episode of one step."""

    def work() -> None:
        env.reset(seed=0)
        env.step(np.zeros(env.action_space.shape, env.action_space.dtype))
        frame_of(env.unwrapped.task)

    return work
