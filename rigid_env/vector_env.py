"""The native vector environments: a batch of worlds behind Gymnasium's `VectorEnv`, stepped in one call."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, ClassVar

import gymnasium as gym
import numpy as np
from gymnasium.vector import AutoresetMode
from gymnasium.vector.utils import batch_space

from physics.exclusive import exclusive
from rigid_env.registration import MAX_EPISODE_STEPS
from rigid_env.spaces import action_space, observation_space
from rigid_env.tasks import BlockReach, BlockReorient, Task
from rigid_env.tasks import layout as col
from rigid_env.view import RENDER_MODES, View


class RigidVectorEnv(gym.vector.VectorEnv):
    """A `Task` as a Gymnasium vector environment; subclasses name the task.

    World i goes through the same bits as the single environment with the same seed, whatever `num_envs`.

    Parameters
    ----------
    num_envs : int
    autoreset_mode : AutoresetMode or str
        ``NextStep`` (default), ``SameStep`` or ``Disabled``.
    max_episode_steps : int or None
        Control steps after which an episode is truncated; None: never. The default is the registered number.
    render_mode : {"rgb_array", "human"} or None
        ``human`` shows world 0.
    width, height : int
        Of one world's picture [px].
    **parameters
        Of the task, `threads` among them; see `Task`.

    Raises
    ------
    ValueError
        Naming the field, the value and what is allowed.
    """

    task_class: ClassVar[type[Task]]
    is_free = True  # no thread is in a call: of `physics.exclusive`

    def __init__(
        self,
        num_envs: int = 1,
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
        max_episode_steps: int | str | None = "registered",
        render_mode: str | None = None,
        width: int = 960,
        height: int = 600,
        **parameters,
    ):
        self.num_envs = num_envs
        self.autoreset_mode = _autoreset_mode(autoreset_mode)
        if max_episode_steps == "registered":
            max_episode_steps = MAX_EPISODE_STEPS[self.task_class.__name__]
        if max_episode_steps is not None and not (
            isinstance(max_episode_steps, (int, np.integer)) and max_episode_steps >= 1
        ):
            raise ValueError(f"max_episode_steps is {max_episode_steps!r}; allowed are None and positive integers")
        self.max_episode_steps = max_episode_steps
        self.task = self.task_class(num_envs, **parameters)
        fps = max(1, round(1.0 / self.task.control_dt))
        self.metadata = {
            "render_modes": list(RENDER_MODES),
            "render_fps": fps,
            "autoreset_mode": self.autoreset_mode,
        }
        self.render_mode = render_mode
        self.single_observation_space = observation_space(self.task)
        self.single_action_space = action_space()
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self._view = View(render_mode, width, height, fps, self.task_class.__name__)
        self._seeds = [-1] * num_envs
        self._elapsed = np.zeros(num_envs, dtype=np.int64)
        self._ended = np.zeros(num_envs, dtype=np.bool_)
        self._waiting = np.ones(num_envs, dtype=np.bool_)  # for their first reset

    @property
    def np_random(self) -> tuple[np.random.Generator | None, ...]:
        """One generator per world."""
        return tuple(self.task.generators)

    @property
    def np_random_seed(self) -> tuple[int, ...]:
        """The seed of each world's generator; -1 before the first reset."""
        return tuple(self._seeds)

    # --- Gymnasium's two calls ----------------------------------------------------------------------------

    @exclusive
    def reset(
        self, *, seed: int | Sequence[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[np.ndarray, dict[str, Any]]:
        """Start episodes; see `gymnasium.vector.VectorEnv.reset`.

        Parameters
        ----------
        seed : int, list of int or None, optional
            An int s gives world i the seed s + i; None lets a generator go on.
        options : dict, optional
            ``reset_mask`` (num_envs,) bool: the worlds to reset, the others stay as they are. The other keys
            fix what is otherwise drawn, for all worlds reset or for each of them; see the single environment.

        Returns
        -------
        observations : (num_envs, entries) float32
        infos : dict of arrays
        """
        options = dict(options or {})
        mask = self._reset_mask(options)
        seeds = self._seed_list(seed)
        rows = np.flatnonzero(mask)
        for i in rows:
            if seeds[i] is not None or self.task.generators[i] is None:
                self._seeds[i] = self.task.seed(i, seeds[i])
        self._begin(rows, options)
        self._waiting[rows] = False
        self._show()
        return self.task.obs.copy(), self._infos(mask)

    @exclusive
    def step(self, actions) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, dict[str, Any]]:
        """Hold actions for one control step; see `gymnasium.vector.VectorEnv.step`.

        Parameters
        ----------
        actions : (num_envs, 6) array_like

        Returns
        -------
        observations : (num_envs, entries) float32
        rewards : (num_envs,) float64
        terminations, truncations : (num_envs,) bool
        infos : dict of arrays
            With ``final_obs`` and ``final_info`` of the episodes that ended, in mode ``SameStep``.

        Raises
        ------
        gymnasium.error.ResetNeeded
            Before the first reset; in mode ``Disabled`` also after the end of an episode.
        """
        self._check_ready()
        task = self.task
        task.step(actions)
        self._elapsed += 1
        rewards = task.outcome[:, col.REWARD].copy()
        terminations = task.outcome[:, col.SUCCESS] > 0.0
        truncations = np.zeros(self.num_envs, dtype=np.bool_)
        if self.max_episode_steps is not None:
            truncations = self._elapsed >= self.max_episode_steps
        finals = {}
        if self.autoreset_mode is AutoresetMode.NEXT_STEP:
            rows = np.flatnonzero(self._ended)
            rewards[rows], terminations[rows], truncations[rows] = 0.0, False, False
        self._ended = terminations | truncations
        if self.autoreset_mode is AutoresetMode.SAME_STEP:
            rows = np.flatnonzero(self._ended)
            if len(rows):
                finals = self._finals(rows)
        if self.autoreset_mode is not AutoresetMode.DISABLED and len(rows):
            ended = self._ended
            self._begin(rows, {})
            self._ended = ended & (self.autoreset_mode is AutoresetMode.NEXT_STEP)
        self._show()
        return task.obs.copy(), rewards, terminations, truncations, {**self._infos(), **finals}

    # --- parts of these -----------------------------------------------------------------------------------

    def _check_ready(self) -> None:
        if self._waiting.any():
            raise gym.error.ResetNeeded("call reset() before step()")
        if self.autoreset_mode is AutoresetMode.DISABLED and self._ended.any():
            raise gym.error.ResetNeeded(
                f"the episodes of the worlds {np.flatnonzero(self._ended).tolist()} have ended and autoreset "
                "is disabled: reset(options={'reset_mask': terminations | truncations}) first"
            )

    def _begin(self, rows: np.ndarray, options: dict[str, Any]) -> None:
        self.task.begin(rows, options)
        self._elapsed[rows] = 0
        self._ended[rows] = False

    def _infos(self, mask: np.ndarray | None = None) -> dict[str, Any]:
        """Info arrays with their masks, as `VectorEnv._add_info` makes them; zero where the mask is False."""
        outcome = self.task.outcome
        infos = {
            "is_success": outcome[:, col.SUCCESS] > 0.0,
            self.task.error_name: outcome[:, col.ERROR].copy(),
            "speed": outcome[:, col.SPEED].copy(),
            "spin": outcome[:, col.SPIN].copy(),
            "physics_status": self.task.status.copy(),
        }
        if mask is None:
            mask = np.ones(self.num_envs, dtype=np.bool_)
        else:
            for values in infos.values():
                values[~mask] = 0
        infos.update({f"_{key}": mask.copy() for key in tuple(infos)})
        return infos

    def _finals(self, rows: np.ndarray) -> dict[str, Any]:
        """`final_obs` and `final_info` of the episodes that end, before their worlds start anew."""
        final_obs = np.full(self.num_envs, None, dtype=object)
        for i in rows:
            final_obs[i] = self.task.obs[i].copy()
        mask = self._ended
        return {
            "final_obs": final_obs,
            "_final_obs": mask.copy(),
            "final_info": self._infos(mask),
            "_final_info": mask.copy(),
        }

    def _reset_mask(self, options: dict[str, Any]) -> np.ndarray:
        mask = options.pop("reset_mask", None)
        if mask is None:
            return np.ones(self.num_envs, dtype=np.bool_)
        if not isinstance(mask, np.ndarray) or mask.dtype != np.bool_ or mask.shape != (self.num_envs,):
            raise ValueError(f"options reset_mask is {mask!r}; allowed is a bool array of shape ({self.num_envs},)")
        if not mask.any():
            raise ValueError(f"options reset_mask is {mask!r}; allowed are arrays with at least one True")
        return mask

    def _seed_list(self, seed) -> list[int | None]:
        if seed is None:
            return [None] * self.num_envs
        if isinstance(seed, (int, np.integer)):
            return [int(seed) + i for i in range(self.num_envs)]
        seeds = list(seed)
        if len(seeds) != self.num_envs:
            raise ValueError(f"seed has {len(seeds)} entries; allowed are an int, None, or {self.num_envs} entries")
        return seeds

    # --- pictures -----------------------------------------------------------------------------------------

    def render(self) -> tuple[np.ndarray, ...] | None:
        """A picture of each world, (height, width, 3) uint8; mode ``human`` shows world 0 and gives None."""
        if self.render_mode is None:
            gym.logger.warn("render() needs a render_mode: pass render_mode='rgb_array' or 'human' to make_vec()")
            return None
        if self.render_mode == "human":
            self._view.draw(self.task)
            return None
        return tuple(self._view.draw(self.task, i) for i in range(self.num_envs))

    def _show(self) -> None:
        if self.render_mode == "human":
            self.render()

    def close_extras(self, **kwargs) -> None:
        """Close the window, if any."""
        self._view.close()


def _autoreset_mode(mode: AutoresetMode | str) -> AutoresetMode:
    try:
        return AutoresetMode(mode)
    except ValueError:
        allowed = ", ".join(repr(m.value) for m in AutoresetMode)
        raise ValueError(f"autoreset_mode is {mode!r}; allowed are {allowed}") from None


class BlockReachVectorEnv(RigidVectorEnv):
    """Many worlds of `rigid_env.env.BlockReachEnv`, which documents the task."""

    task_class = BlockReach


class BlockReorientVectorEnv(RigidVectorEnv):
    """Many worlds of `rigid_env.env.BlockReorientEnv`, which documents the task."""

    task_class = BlockReorient
