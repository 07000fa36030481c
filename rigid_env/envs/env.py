"""A task as a single Gymnasium environment: a batch of one world."""

from __future__ import annotations

import reprlib
from collections.abc import Sequence
from pathlib import Path
from typing import Any, ClassVar

import gymnasium as gym
import numpy as np

import physics
from physics.parallel.exclusive import exclusive, in_use
from rigid_env.envs.attributes import EpisodeParameters, value_of
from rigid_env.envs.spaces import action_space, observation_space
from rigid_env.rendering.view import RENDER_MODES, View
from rigid_env.tasks import Task
from rigid_env.tasks.kernels import AXES
from rigid_env.tasks.parameters import Edges, Number

RENDER_FPS = 40  # of the default control period, 5 steps of 5 ms


class RigidEnv(EpisodeParameters, gym.Env):
    """A `Task` as a Gymnasium environment; subclasses name the task.

    Parameters
    ----------
    render_mode : {"rgb_array", "human"} or None
    width, height : int
        Of pictures [px].
    accuracy, walls, half_width, mass, size, friction, restitution, gravity, effects, frame_skip, dt, dump_faults
        Of the task, see `Task`.

    Raises
    ------
    TypeError
        An unknown argument, with the known ones, the nearest first.
    ValueError
        Naming the field, the value and what is allowed.
    """

    metadata: ClassVar[dict[str, Any]] = {"render_modes": list(RENDER_MODES), "render_fps": RENDER_FPS}
    task_class: ClassVar[type[Task]]
    is_free = True  # no thread is in a call: of `physics.parallel.exclusive`

    def __init__(
        self,
        render_mode: str | None = None,
        width: int = 960,
        height: int = 600,
        *,
        accuracy: str | physics.Accuracy = "balanced",
        walls: str = "three",
        half_width: float = 10.0,
        mass: Number = 6.0,
        size: Edges = (5.0, 3.0, 2.0),
        friction: Number = 0.5,
        restitution: Number = 0.2,
        gravity: Number = 9.81,
        effects: Sequence = (),
        frame_skip: int = 5,
        dt: float = 0.005,
        dump_faults: str | Path | None = None,
    ):
        self.task = self.task_class(
            1, accuracy=accuracy, walls=walls, half_width=half_width, mass=mass, size=size, friction=friction,
            restitution=restitution, gravity=gravity, effects=effects, frame_skip=frame_skip, dt=dt,
            dump_faults=dump_faults,
        )  # fmt: skip
        self.metadata = {**self.metadata, "render_fps": max(1, round(1.0 / self.task.control_dt))}
        self.render_mode = render_mode
        self.observation_space = observation_space(self.task)
        self.action_space = action_space()
        self._view = View(render_mode, width, height, self.metadata["render_fps"], self.task_class.__name__)
        self._world = np.zeros(1, dtype=np.int64)
        self._has_reset = self._is_closed = False

    @exclusive
    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None):
        """Start an episode; see `gymnasium.Env.reset`.

        Parameters
        ----------
        seed : int, optional
            Of the generator that draws starts, goals and parameters. None: go on with the one there is.
        options : dict, optional
            What is fixed instead of drawn; see Starting State in the class.

        Returns
        -------
        observation : (entries,) float32
        info : dict
            As of `step`, and the parameters of the episode: ``mass``, ``size``, ``friction``, ``restitution``,
            ``gravity``, all except those that `effects` take the place of.

        Raises
        ------
        TypeError, ValueError
            An option that is unknown or out of range. Nothing has changed then, the generator included.
        """
        kept = self._np_random, self._np_random_seed, self.task.generators[0]
        try:
            super().reset(seed=seed)
            self.task.generators[0] = self.np_random
            self.task.begin(self._world, options)
        except (TypeError, ValueError):
            self._np_random, self._np_random_seed, self.task.generators[0] = kept
            raise
        self._has_reset, self._is_closed = True, False
        if self.render_mode == "human":
            self.render()
        values = self.task.values.now
        drawn = {field: value_of(values[field][0]) for field in self.task.own_parameters}
        return self.task.obs[0].copy(), {**self._info(self.task.outcome[0].tolist()), **drawn}

    def step(self, action):
        """Hold an action for one control step; see `gymnasium.Env.step`.

        Parameters
        ----------
        action : (6,) array_like
            Force and torque as shares of their limits, clipped to ±1.

        Returns
        -------
        observation : (entries,) float32
        reward : float
        terminated : bool
            True on success.
        truncated : bool
            Always False: the time limit is `gymnasium.make`'s.
        info : dict

        Raises
        ------
        ValueError
            An action of another shape, or that is not finite numbers. Nothing has changed then.
        gymnasium.error.ResetNeeded, gymnasium.error.ClosedEnvironmentError
            Before the first reset, after `close`.
        """
        if self.is_free:  # written out: the call of a decorator takes a fiftieth of a step
            self.is_free = False
        else:
            raise in_use(self)
        try:
            if not self._has_reset:
                raise self._not_ready("step")
            try:
                action = np.asarray(action)
            except ValueError:  # parts of different lengths
                raise ValueError(f"action is {reprlib.repr(action)}; allowed are {AXES} numbers") from None
            if action.shape != (AXES,):
                raise ValueError(f"action has shape {action.shape}; allowed is shape ({AXES},)")
            self.task.step(action[None])
            (outcome,) = self.task.outcome.tolist()  # one world: cheaper than the row of an array
            info = self._info(outcome)
            if self.render_mode == "human":
                self.render()
            return self.task.obs[0].copy(), outcome[0], info["is_success"], False, info
        finally:
            self.is_free = True

    def _info(self, outcome: list[float]) -> dict[str, Any]:
        _, success, error, speed, spin = outcome
        return {
            "is_success": success > 0.0,
            self.task.error_name: error,
            "speed": speed,
            "spin": spin,
            "physics_status": self.task.status.item(),
        }

    def render(self):
        """(height, width, 3) uint8 picture in mode "rgb_array"; in mode "human" shows it and returns None."""
        if self._is_closed:
            raise self._not_ready("render")
        if self.render_mode is None:
            gym.logger.warn("render() needs a render_mode: pass render_mode='rgb_array' or 'human' to make()")
            return None
        picture = self._view.draw(self.task)
        return picture if self.render_mode == "rgb_array" else None

    def close(self):
        """Close the window, if any; `reset` begins anew."""
        self._view.close()
        self._is_closed, self._has_reset = True, False

    def _not_ready(self, call: str) -> gym.error.Error:
        if self._is_closed:
            return gym.error.ClosedEnvironmentError(f"{call}() after close(): allowed is reset() or a new environment")
        return gym.error.ResetNeeded(f"call reset() before {call}()")
