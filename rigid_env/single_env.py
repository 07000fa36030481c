"""A task as a single Gymnasium environment: a batch of one world."""

from __future__ import annotations

from typing import Any, ClassVar

import gymnasium as gym
import numpy as np

from physics.exclusive import exclusive
from rigid_env.spaces import action_space, observation_space
from rigid_env.tasks import Task
from rigid_env.tasks.kernels import AXES
from rigid_env.view import RENDER_MODES, View

RENDER_FPS = 40  # of the default control period, 5 steps of 5 ms


class RigidEnv(gym.Env):
    """A `Task` as a Gymnasium environment; subclasses name the task.

    Parameters
    ----------
    render_mode : {"rgb_array", "human"} or None
    width, height : int
        Of pictures [px].
    **parameters
        Of the task, see `Task`; all but `worlds` and `threads`.
    """

    metadata: ClassVar[dict[str, Any]] = {"render_modes": list(RENDER_MODES), "render_fps": RENDER_FPS}
    task_class: ClassVar[type[Task]]
    is_free = True  # no thread is in a call: of `physics.exclusive`

    def __init__(self, render_mode: str | None = None, width: int = 960, height: int = 600, **parameters):
        for name in ("worlds", "threads"):
            if name in parameters:
                raise ValueError(f"{name} is {parameters[name]!r}; allowed only in gymnasium.make_vec")
        self.task = self.task_class(1, **parameters)
        self.metadata = {**self.metadata, "render_fps": max(1, round(1.0 / self.task.control_dt))}
        self.render_mode = render_mode
        self.observation_space = observation_space(self.task)
        self.action_space = action_space()
        self._view = View(render_mode, width, height, self.metadata["render_fps"], self.task_class.__name__)
        self._world = np.zeros(1, dtype=np.int64)
        self._has_reset = False

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
        """
        super().reset(seed=seed)
        self.task.generators[0] = self.np_random
        self.task.begin(self._world, options)
        self._has_reset = True
        if self.render_mode == "human":
            self.render()
        return self.task.obs[0].copy(), self._info(self.task.outcome[0].tolist())

    @exclusive
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
        """
        if not self._has_reset:
            raise gym.error.ResetNeeded("call reset() before step()")
        action = np.asarray(action)
        if action.shape != (AXES,):
            raise ValueError(f"action has shape {action.shape}; allowed is shape ({AXES},)")
        self.task.step(action[None])
        outcome = self.task.outcome[0].tolist()
        info = self._info(outcome)
        if self.render_mode == "human":
            self.render()
        return self.task.obs[0].copy(), outcome[0], info["is_success"], False, info

    def _info(self, outcome: list[float]) -> dict[str, Any]:
        _, success, error, speed, spin = outcome
        return {
            "is_success": success > 0.0,
            self.task.error_name: error,
            "speed": speed,
            "spin": spin,
            "physics_status": int(self.task.status[0]),
        }

    def render(self):
        """(height, width, 3) uint8 picture in mode "rgb_array"; in mode "human" shows it and returns None."""
        if self.render_mode is None:
            gym.logger.warn("render() needs a render_mode: pass render_mode='rgb_array' or 'human' to make()")
            return None
        picture = self._view.draw(self.task)
        return picture if self.render_mode == "rgb_array" else None

    def close(self):
        """Close the window, if any."""
        self._view.close()
