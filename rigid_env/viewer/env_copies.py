"""Copies of environments with their wrappers: at any accuracy, and states of the whole chain."""

from __future__ import annotations

import copy
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium import spaces

from physics.accuracy import Accuracy
from physics.annotations import Preset
from rigid_env.tasks.disturbances import Disturbances
from rigid_env.tasks.state import TaskState
from rigid_env.viewer.copies import copied, fitted

APART = ("env", "spec", "metadata")
"""Attributes of wrappers that are no state."""


class HandOfUser:
    """Forces of the user in a task: in the place of its disturbances, which act besides.

    Parameters
    ----------
    inner : Disturbances or None

    Attributes
    ----------
    pull : (bodies, 6) float64 or None
        Force [N] and torque [N m] of the user in the coming control step.
    """

    def __init__(self, inner: Disturbances | None):
        self.inner, self.pull = inner, None

    @property
    def arrays(self) -> dict[str, np.ndarray]:
        """Arrays of the task's own disturbances."""
        return {} if self.inner is None else self.inner.arrays

    @property
    def load(self) -> np.ndarray | float:
        """Loads of the task's own disturbances in the last control step; the user's hand is drawn as a spring."""
        return 0.0 if self.inner is None else self.inner.load

    def due(self) -> np.ndarray:
        """Worlds in which a disturbance of the task starts in the coming control step."""
        return np.zeros(0, dtype=np.int64) if self.inner is None else self.inner.due()

    def begin(self, rows: np.ndarray) -> None:
        """Begin episodes."""
        if self.inner is not None:
            self.inner.begin(rows)

    def act(self) -> tuple[np.ndarray | None, np.ndarray | None]:
        """Load (1, bodies, 6) of the coming control step, and of its first physics step besides, or None."""
        load, push = (None, None) if self.inner is None else self.inner.act()
        if self.pull is None:
            return load, push
        return (self.pull[None] if load is None else load + self.pull), push


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


def take_chain(env: gym.Env) -> tuple[TaskState, list[dict[str, Any]]]:
    """State of an environment, and copies of what its wrappers remember."""
    remembered = []
    for wrapper in wrappers(env):
        kept = {name: value for name, value in vars(wrapper).items() if name not in APART}
        remembered.append({name: value for name, value in kept.items() if not isinstance(value, spaces.Space)})
    return env.unwrapped.get_state(), copy.deepcopy(remembered)


def put_chain(env: gym.Env, chain: tuple[TaskState, list[dict[str, Any]]], is_other: bool = False) -> None:
    """Let an environment and its wrappers go on from a state of `take_chain`; `is_other`: of another accuracy."""
    state, remembered = chain
    if is_other:
        state = replace(state, world=fitted(state.world, env.unwrapped.task.world))
    env.unwrapped.set_state(state)
    for wrapper, values in zip(wrappers(env), copy.deepcopy(remembered), strict=True):
        vars(wrapper).update(values)
