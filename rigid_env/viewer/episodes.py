"""An environment that is played live: episode after episode, by a policy."""

from __future__ import annotations

import copy
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any, NamedTuple

import gymnasium as gym
import numpy as np

from physics import Event
from physics.analysis.events import Pair
from rigid_env.rendering.view import frame_of
from rigid_env.viewer.copies import accuracy_name
from rigid_env.viewer.env_copies import copied_env, put_chain, take_chain
from rigid_env.viewer.interface import WorldSubject, allowed_of
from rigid_env.viewer.listening import Listener
from rigid_env.viewer.worlds import direction_of

Policy = Callable[[Any], np.ndarray]


class State(NamedTuple):
    """All that decides how an environment goes on, the accuracy and the random actions included."""

    accuracy: str
    chain: tuple
    observation: Any
    is_ended: bool
    episode: tuple[int, float]
    shift: float
    generator: Mapping[str, Any]
    pushes: dict[Pair, float]


class LiveEnv(WorldSubject):
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
        self.name, self.seed, self._policy = name, seed, policy
        self._envs: dict[str, tuple[gym.Env, Listener]] = {}
        self._generator = np.random.default_rng(seed)
        env = copied_env(env, accuracy)
        self._use(self._add(env))
        self.can = allowed_of(self.world, seed=True)
        self._down = direction_of(self.world.gravity[0])
        self._is_ended, self._episode, self._observation = False, (0, 0.0), None
        self._shift = 0.0  # of the time [s]: where gusts blow, a reset sets that of the world to 0
        self._begin_first(seed)
        self._first = self.snapshot()

    def _add(self, env: gym.Env) -> str:
        world = env.unwrapped.task.world
        name = accuracy_name(world.accuracy)
        self._envs[name] = env, Listener(world)
        return name

    def _use(self, name: str) -> None:
        self._env, listener = self._envs[name]
        self._task = self._env.unwrapped.task
        self._set_world(self._task.world, listener)

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
    def time(self) -> float:
        """Simulated time of all episodes together [s]."""
        return self.world.time + self._shift

    @property
    def interval(self) -> float:
        return self._task.control_dt

    def events(self) -> list[Event]:
        return [replace(event, t=event.t + self._shift) for event in super().events()]

    @property
    def message(self) -> str:
        """Episode and return so far."""
        number, total = self._episode
        return f"episode {number + 1}, return {total:.2f}"

    def restart(self, seed: int) -> None:
        put_chain(self._env, self._first.chain, is_other=True)
        self._observation, _ = self._env.reset(seed=seed)
        self.seed, self._generator = seed, np.random.default_rng(seed)
        self._is_ended, self._episode, self._shift = False, (0, 0.0), 0.0
        self.listener.begin()
        self.listener.pushes, self.listener.is_changed = {}, False

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

    def snapshot(self) -> State:
        return State(
            self.accuracy, take_chain(self._env), copy.deepcopy(self._observation), self._is_ended, self._episode,
            self._shift, self._generator.bit_generator.state, self.listener.pushes,
        )  # fmt: skip

    def restore(self, snapshot: State) -> None:
        self._use(snapshot.accuracy)
        put_chain(self._env, snapshot.chain)
        self._observation = copy.deepcopy(snapshot.observation)
        self._is_ended, self._episode, self._shift = snapshot.is_ended, snapshot.episode, snapshot.shift
        self._generator.bit_generator.state = snapshot.generator
        self.listener.begin()
        self.listener.pushes, self.listener.is_changed = snapshot.pushes, False

    def frame(self):
        return frame_of(self._task)

    def rehearsal(self) -> Callable[[], None]:
        return _rehearsed(copied_env(self._env))

    # --- sliders ---------------------------------------------------------------------------------------------

    def set_gravity(self, strength: float) -> None:
        self._hold("gravity", strength, strength * self._down)

    def set_friction(self, coefficient: float) -> None:
        self._hold("friction", coefficient, coefficient)

    def set_restitution(self, coefficient: float) -> None:
        self._hold("restitution", coefficient, coefficient)

    def _hold(self, name: str, value: float, given: Any) -> None:
        """Change a parameter now, and in later episodes where they draw it."""
        if name in self._task.own_draws:
            self._task.hold(name, value)
        else:
            self.world.set_parameters(**{name: given})
        self.listener.is_changed = False  # the state is the same

    # --- accuracy --------------------------------------------------------------------------------------------

    def prepare(self, name: str) -> Callable[[], None]:
        env = copied_env(self._env, name)
        self._add(env)
        return _rehearsed(env)

    def switch(self, name: str) -> None:
        pushes, chain = self.listener.pushes, take_chain(self._env)
        self._use(name)
        put_chain(self._env, chain, is_other=True)
        self.listener.begin()
        self.listener.pushes, self.listener.is_changed = pushes, False


def _rehearsed(env: gym.Env) -> Callable[[], None]:
    """Work that compiles what an environment calls, by an episode of one step."""

    def work() -> None:
        env.reset(seed=0)
        env.step(np.zeros(env.action_space.shape, env.action_space.dtype))
        frame_of(env.unwrapped.task)

    return work
