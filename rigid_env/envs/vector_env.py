"""Native vector environment: a batch of worlds with the interface of Gymnasium's `VectorEnv`, stepped in one call."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium.vector import AutoresetMode
from gymnasium.vector.utils import batch_space
from numpy.typing import ArrayLike, NDArray

from physics.parallel.exclusive import Exclusive, exclusive
from physics.undo import Undo, undo_on_error
from rigid_env.envs import vector_arguments as arguments
from rigid_env.envs.arguments import TaskArgument, VectorArguments
from rigid_env.envs.attributes import BatchAttributes
from rigid_env.envs.contact_infos import contact_infos
from rigid_env.envs.goals import lend_goals
from rigid_env.envs.plain import PlainSpec
from rigid_env.envs.sources import Obs, make_source
from rigid_env.envs.spaces import action_space
from rigid_env.envs.vector_infos import BatchInfos
from rigid_env.rendering.view import RENDER_MODES, View
from rigid_env.tasks import Task
from rigid_env.tasks import layout as col
from rigid_env.tasks.arguments import takes
from rigid_env.tasks.options import require_known
from rigid_env.tasks.restoring import capture, reinstate, remember
from rigid_env.tasks.state import TaskState

Step = tuple[Obs, NDArray[np.float64], NDArray[np.bool_], NDArray[np.bool_], dict[str, Any]]
"""Observations, rewards, terminations, truncations and infos of one control step."""


@dataclass(frozen=True)
class _Arguments(VectorArguments, TaskArgument):
    pass


class RigidVectorEnv(Exclusive, PlainSpec, BatchAttributes[Obs]):
    """A `Task` as a Gymnasium vector environment.

    World i has the same bits as a single environment with the same seed, for any number of worlds.

    Parameters
    ----------
    task : Task
        Task with a batch of worlds.
    autoreset_mode : AutoresetMode or str
        ``NextStep`` (default), ``SameStep`` or ``Disabled``.
    max_episode_steps : int or None
        Control steps after which an episode is truncated; None or -1: never. The default is that of the task.
    render_mode : {"rgb_array", "human"} or None
        ``human`` shows world 0.
    width, height : int
        Size of the picture of one world that `render` returns [px].
    obs, obs_size, obs_stack, contacts, impacts, camera, arrows
        As of `rigid_env.envs.env.RigidEnv`.

    Raises
    ------
    ValueError
        The message names the field, its value and what is allowed.
    """

    task: Task
    _view: Any = None  # a `View`; None if the constructor has failed, after which Gymnasium still calls `close`

    @takes(_Arguments)
    def __init__(self, given: _Arguments) -> None:
        self.task = task = given.task
        self._source: Any = make_source(task, given)
        self.contact_infos = contact_infos(task, given.contacts, given.impacts)
        self._infos = BatchInfos(task, self.contact_infos)
        lend_goals(task, self)
        self.num_envs = num_envs = task.worlds
        self.autoreset_mode = arguments.autoreset_mode(given.autoreset_mode)
        limit: Any = given.max_episode_steps
        is_registered = isinstance(limit, str) and limit == "registered"
        self.max_episode_steps = arguments.episode_limit(task.max_episode_steps if is_registered else limit)
        fps = max(1, round(1.0 / task.control_dt))
        self.metadata = {"render_modes": list(RENDER_MODES), "render_fps": fps, "autoreset_mode": self.autoreset_mode}
        self.render_mode = given.render_mode
        self.single_observation_space = self._source.space
        self.single_action_space = action_space(task)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self._view = View(given, fps, type(task).__name__)
        self._seeds = [-1] * num_envs
        self._ended = np.zeros(num_envs, dtype=np.bool_)
        self._waiting = np.ones(num_envs, dtype=np.bool_)  # for their first reset

    @property  # type: ignore[misc]
    def np_random(self) -> tuple[np.random.Generator | None, ...]:  # type: ignore[override]
        """Random generators, one for each world; None before its first reset."""
        return tuple(self.task.generators)

    @property
    def np_random_seed(self) -> tuple[int, ...]:  # type: ignore[override]
        """Seeds of the worlds' generators; -1 before the first reset."""
        return tuple(self._seeds)

    # --- Gymnasium's two calls ----------------------------------------------------------------------------

    @exclusive
    def reset(
        self, *, seed: int | Sequence[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Obs, dict[str, Any]]:
        """Start episodes; see `gymnasium.vector.VectorEnv.reset`.

        Parameters
        ----------
        seed : int, list of int or None, optional
            An int s gives world i the seed s + i. None continues with the present generator.
        options : dict, optional
            ``reset_mask`` (num_envs,) bool: worlds to reset; the others stay as they are. Other keys fix values that
            are otherwise drawn, one for all worlds to reset or one for each; see the single environment.

        Returns
        -------
        observations : (num_envs, entries) float32
        infos : dict of arrays
            As of `step`; zero in worlds that are not reset.

        Raises
        ------
        TypeError, ValueError
            An option or a seed that is unknown or out of range. Nothing has changed then, the generators included.
        gymnasium.error.ClosedEnvironmentError
            After `close`.
        """
        self._check_open("reset")
        options = dict(require_known(options, (*self.task.option_names, "reset_mask")))
        mask = arguments.reset_mask(options, self.num_envs)
        seeds = arguments.seed_list(seed, self.num_envs)
        rows = np.flatnonzero(mask)
        with undo_on_error(self._remember_generators()):
            for i in rows.tolist():
                if seeds[i] is not None or self.task.generators[i] is None:
                    self._seeds[i] = self.task.seed(i, seeds[i])
            self._begin(rows, options)
        self._waiting[rows] = False
        self._show()
        return self._source.all(), self._infos(mask)

    @exclusive
    def step(self, actions: ArrayLike) -> Step[Obs]:
        """Hold actions for one control step; see `gymnasium.vector.VectorEnv.step`.

        Parameters
        ----------
        actions : (num_envs, numbers) array_like

        Returns
        -------
        observations : (num_envs, entries) float32
        rewards : (num_envs,) float64
        terminations, truncations : (num_envs,) bool
        infos : dict of arrays
            Numbers of the step, and values drawn for the running episodes, except those that `effects` take the place
            of. The mask of all keys is one array, which is read-only. In mode ``SameStep`` also ``final_obs`` and
            ``final_info`` of the episodes that ended.

        Raises
        ------
        gymnasium.error.ResetNeeded
            Before the first reset; in mode ``Disabled`` also after the end of an episode.
        gymnasium.error.ClosedEnvironmentError
            After `close`.
        ValueError
            Actions of another shape, or that are not finite numbers. Nothing has changed then.
        """
        self._check_ready()
        undo_memory = self._remember()
        kept = self._generators_of_ended()
        self.task.step(actions)
        for generator, state in kept:
            generator.bit_generator.state = state
        if undo_memory is None:
            return self._conclude()
        with undo_on_error(self.task.undo_step, undo_memory):  # starting an episode or drawing a picture may fail
            return self._conclude()

    def _conclude(self) -> Step[Obs]:
        """Observe the worlds after a step, and start new episodes where the mode of automatic resets requires it."""
        task = self.task
        self._source.step()
        rewards = task.outcome[:, col.REWARD].copy()
        terminations = task.outcome[:, col.FAILURE] > 0.0
        if task.ends_on_success:
            terminations |= task.outcome[:, col.SUCCESS] > 0.0
        truncations = np.zeros(self.num_envs, dtype=np.bool_)
        if self.max_episode_steps is not None:
            truncations = task.steps >= self.max_episode_steps
        finals: dict[str, Any] = {}
        if self.autoreset_mode is AutoresetMode.NEXT_STEP:
            rows = np.flatnonzero(self._ended)
            rewards[rows], terminations[rows], truncations[rows] = 0.0, False, False
        self._ended = terminations | truncations
        if self.autoreset_mode is AutoresetMode.SAME_STEP:
            rows = np.flatnonzero(self._ended)
            if len(rows):
                finals = self._infos.of_ended(self._source, self._ended)
        if self.autoreset_mode is not AutoresetMode.DISABLED and len(rows):
            ended = self._ended
            self._begin(rows, {})
            self._ended = ended & (self.autoreset_mode is AutoresetMode.NEXT_STEP)
        self._show()
        return self._source.all(), rewards, terminations, truncations, {**self._infos(), **finals}

    @exclusive
    def get_state(self, worlds: ArrayLike | None = None) -> TaskState:
        """Copy the whole state of all episodes, generators included; `set_state` continues it bit for bit.

        Parameters
        ----------
        worlds : (k,) array_like of int, or mask, optional
            Worlds whose state is copied; None: all.

        Returns
        -------
        TaskState
            ``save(path)`` writes it, `rigid_env.TaskState.load` reads it.

        Raises
        ------
        ValueError
            A world that is not there, or named twice.
        """
        return capture(self.task, self._arrays(), self._seeds, worlds)

    @exclusive
    def set_state(
        self, state: TaskState, worlds: ArrayLike | None = None, source: ArrayLike | int | None = None
    ) -> None:
        """Continue worlds from a state of this task, which a single environment or a batch has made.

        Parameters
        ----------
        state : TaskState
        worlds : (k,) array_like of int, or mask, optional
            Worlds that change; None: all.
        source : (k,) array_like of int, or int, optional
            Worlds of the state from which they continue; an int is for all. None: the state has one world, for all of
            them, or k worlds, in this order.

        Raises
        ------
        ValueError
            An object that is no state, a state of another task or of other settings (`TaskState.settings`), or indices
            out of range. Nothing has changed then.
        """
        chosen, sources = reinstate(self.task, self._arrays(), state, worlds, source)
        for world, of in zip(chosen.tolist(), sources.tolist()):
            self._seeds[world] = state.seeds[of]

    def _arrays(self) -> dict[str, np.ndarray]:
        return {"waiting": self._waiting, "ended": self._ended, **self._source.arrays}

    # --- parts of the methods above -----------------------------------------------------------------------

    def _check_open(self, call: str) -> None:
        if self.closed:
            raise gym.error.ClosedEnvironmentError(f"{call}() after close(): allowed is a new environment")

    def _check_ready(self) -> None:
        self._check_open("step")
        if self._waiting.any():
            raise gym.error.ResetNeeded("call reset() before step()")
        if self.autoreset_mode is AutoresetMode.DISABLED and self._ended.any():
            raise gym.error.ResetNeeded(
                f"the episodes of the worlds {np.flatnonzero(self._ended).tolist()} have ended and autoreset "
                "is disabled: reset(options={'reset_mask': terminations | truncations}) first"
            )

    def _generators_of_ended(self) -> list[tuple[Any, Any]]:
        """Random generators of the worlds whose episodes have ended, each with its state, which the step will restore.

        In mode ``NextStep`` ended worlds still move in the step that restarts them. A disturbance due in that step must
        not use random numbers of the next episode.
        """
        if self.task.disturbed is None:
            return []
        ended: Any = [self.task.generators[world] for world in np.flatnonzero(self._ended).tolist()]
        return [(generator, generator.bit_generator.state) for generator in ended]

    def _remember_generators(self) -> Undo:
        kept = list(self.task.generators), list(self._seeds)

        def undo() -> None:
            self.task.generators[:], self._seeds[:] = kept

        return undo

    def _remember(self) -> Undo | None:
        """Copy the environment's own arrays, if a user's code may fail; returns a function that restores them."""
        if not self.task.may_fail:
            return None
        ended, pictures = self._ended, {name: array.copy() for name, array in self._source.arrays.items()}

        def undo() -> None:
            self._ended = ended
            for name, array in pictures.items():
                self._source.arrays[name][...] = array

        return undo

    def _begin(self, rows: np.ndarray, options: dict[str, Any]) -> None:
        """Start episodes in worlds `rows`; after an error nothing has changed."""
        undo_task = remember(self.task, rows) if self.task.may_fail and self._source.arrays else None
        with undo_on_error(undo_task, self._remember()):
            self.task.start(rows, options)
            self._source.start(rows)
        self._ended[rows] = False

    # --- pictures -----------------------------------------------------------------------------------------

    def render(self) -> tuple[NDArray[np.uint8], ...] | None:
        """Pictures of all worlds, (height, width, 3) uint8 each; mode ``human`` shows world 0 and returns None."""
        self._check_open("render")
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

    def close_extras(self, **kwargs: Any) -> None:
        """Close the window, if any."""
        if self._view is not None:
            self._view.close()
