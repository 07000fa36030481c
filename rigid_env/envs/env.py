"""A task as a single Gymnasium environment: a batch of one world."""

from __future__ import annotations

import inspect
from dataclasses import dataclass
from typing import Any

import gymnasium as gym
import numpy as np
from numpy.typing import ArrayLike, NDArray

from physics.parallel.exclusive import Exclusive, exclusive, in_use
from physics.undo import Undo, undo_on_error
from rigid_env.envs.arguments import CommonArguments, TaskArgument
from rigid_env.envs.attributes import EpisodeParameters
from rigid_env.envs.goals import lend_goals
from rigid_env.envs.infos import info_maker
from rigid_env.envs.plain import PlainSpec
from rigid_env.envs.sources import Obs, StateSource, make_source
from rigid_env.envs.spaces import action_space
from rigid_env.rendering.view import RENDER_MODES, View
from rigid_env.tasks.arguments import takes
from rigid_env.tasks.describe import Section, markdown, sections
from rigid_env.tasks.layout import FAILURE, REWARD
from rigid_env.tasks.restoring import capture, reinstate
from rigid_env.tasks.state import TaskState
from rigid_env.tasks.task import shaped

RENDER_FPS = 40  # pictures per second: one for each control step of the default length, 5 physics steps of 5 ms


@dataclass(frozen=True)
class _Arguments(CommonArguments, TaskArgument):
    pass


class RigidEnv(Exclusive, PlainSpec, EpisodeParameters, gym.Env[Obs, NDArray[Any]]):
    """A `Task` of one world as a Gymnasium environment.

    Parameters
    ----------
    task : Task
        Task with one world.
    render_mode : {"rgb_array", "human"} or None
    width, height : int
        Size of the pictures that `render` returns [px].
    obs : {"state", "pixels"}
        Observations: "state" has the numbers of the task's entries, "pixels" has pictures; see
        `rigid_env.envs.sources`.
    obs_size : (2,) int
        Height and width of observed pictures [px].
    obs_stack : int
        Pictures in one observation, of the last control steps.
    contacts : int
        Number of contacts in every info, those with the largest forces; see `physics.Contacts`. 0: none.
    impacts : int
        Number of pairs in every info that collided in the control step, those with the largest impulses; see
        `physics.Impacts`. 0: none, and impacts are not recorded.
    camera : Camera, mapping or None
        Camera of `render`: a `rigid_env.rendering.Camera`, or a mapping of its parameters. None has the whole room in
        view. Observed pictures have their own camera.
    arrows : bool
        Whether pictures of `render` show contact points, forces and torques.

    Raises
    ------
    ValueError
        The message names the field, its value and what is allowed.
    """

    metadata: dict[str, Any] = {"render_modes": list(RENDER_MODES), "render_fps": RENDER_FPS}  # noqa: RUF012

    @takes(_Arguments)
    def __init__(self, given: _Arguments) -> None:
        self.task = task = given.task
        self._source: Any = make_source(task, given)
        lend_goals(task, self)
        fps = max(1, round(1.0 / task.control_dt))
        self.metadata = {**self.metadata, "render_fps": fps}
        self.render_mode = given.render_mode
        self.observation_space = self._source.space
        self.action_space = action_space(task)
        self._view = View(given, fps, type(task).__name__)
        self._world = np.zeros(1, dtype=np.int64)
        self._is_plain = type(self._source) is StateSource
        self._action_shape = self.action_space.shape
        self._info = info_maker(task, given.contacts, given.impacts)
        self._ends_on_success = task.ends_on_success
        self._has_reset = self._is_closed = False

    @exclusive
    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Obs, dict[str, Any]]:
        """Start an episode; see `gymnasium.Env.reset`.

        Parameters
        ----------
        seed : int, optional
            Seed of a new generator, which draws starts, goals and parameters. None: continue with the present
            generator.
        options : dict, optional
            Values that are fixed instead of drawn, by name; see Starting State in the class.

        Returns
        -------
        observation : (entries,) float32
        info : dict
            As of `step`.

        Raises
        ------
        TypeError, ValueError
            An option that is unknown or out of range. Nothing has changed then, the generator included.
        """
        with undo_on_error(self._remember_generator()):
            super().reset(seed=seed)
            self.task.generators[0] = self.np_random
            self.task.start(self._world, options)
            self._source.start(self._world)
        self._has_reset, self._is_closed = True, False
        if self.render_mode == "human":
            self.render()
        return self._source.one(0), self._info(self.task.outcome[0].tolist(), self.task.status.item())

    def _remember_generator(self) -> Undo:
        kept = self._np_random, self._np_random_seed, self.task.generators[0]

        def undo() -> None:
            self._np_random, self._np_random_seed, self.task.generators[0] = kept

        return undo

    def step(self, action: ArrayLike) -> tuple[Obs, float, bool, bool, dict[str, Any]]:
        """Hold an action for one control step; see `gymnasium.Env.step`.

        Parameters
        ----------
        action : (entries,) array_like
            Forces, torques and impulses as shares of their limits, clipped to ±1.

        Returns
        -------
        observation : (entries,) float32
        reward : float
        terminated : bool
            True on success and on failure.
        truncated : bool
            Always False; the time limit is a wrapper of `gymnasium.make`.
        info : dict
            Numbers of the step, and values drawn for the episode, except those that `effects` take the place of.

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
            task = self.task
            if type(action) is not np.ndarray or action.shape != self._action_shape:
                action = shaped(action, self._action_shape, "action")
            task.apply(action)
            (outcome,) = task.outcome.tolist()  # one world: cheaper than the row of an array
            info = self._info(outcome, task.status.item())
            if self.render_mode == "human":
                self.render()
            if self._is_plain:
                obs = task.obs[0].copy()
            else:
                self._source.step()
                obs = self._source.one(0)
            return (
                obs,
                outcome[REWARD],
                (info["is_success"] and self._ends_on_success) or outcome[FAILURE] > 0.0,
                False,
                info,
            )
        finally:
            self.is_free = True

    @exclusive
    def get_state(self) -> TaskState:
        """Copy the whole state of the episode, random generator included; `set_state` continues it bit for bit.

        Returns
        -------
        TaskState
            ``save(path)`` writes it, `rigid_env.TaskState.load` reads it.
        """
        return capture(self.task, self._arrays(), [self._np_random_seed])

    @exclusive
    def set_state(self, state: TaskState, source: int = 0) -> None:
        """Continue from a state of this task, taken from an environment or from one world of a batch.

        Parameters
        ----------
        state : TaskState
            State that `get_state` of an environment or of a batch returned.
        source : int
            Index of the world of the state, 0 for a state of one world.

        Raises
        ------
        ValueError
            An object that is no state, a state of another task or of other settings (`TaskState.settings`), or one
            without this world. Nothing has changed then.
        """
        arrays = self._arrays()
        reinstate(self.task, arrays, state, source=None if source == 0 and getattr(state, "worlds", 0) == 1 else source)
        self._np_random, self._np_random_seed = self.task.generators[0], state.seeds[source]
        self._has_reset, self._is_closed = not arrays["waiting"][0], False

    def _arrays(self) -> dict[str, np.ndarray]:
        """Arrays of the environment that belong to its state, with one row; their names are those of a batch."""
        flags = {"waiting": np.array([not self._has_reset]), "ended": np.zeros(1, dtype=np.bool_)}
        return {**flags, **self._source.arrays}

    def render(self) -> NDArray[np.uint8] | None:
        """Draw the world: return the (height, width, 3) picture in mode "rgb_array", show it in mode "human"."""
        if self._is_closed:
            raise self._not_ready("render")
        if self.render_mode is None:
            gym.logger.warn("render() needs a render_mode: pass render_mode='rgb_array' or 'human' to make()")
            return None
        picture = self._view.draw(self.task)
        return picture if self.render_mode == "rgb_array" else None

    def describe(self) -> str:
        """Documentation of the task as Markdown: spaces, rewards, draws, episode end and arguments, in tables."""
        return markdown(self.documentation())

    def documentation(self) -> tuple[Section, ...]:
        """Sections of `describe`; includes the defaults of the environment's id, if it was made from one."""
        registered = None if self.spec is None else gym.registry.get(self.spec.id)
        documented = self._documented()
        added = {name: each.default for name, each in inspect.signature(CommonArguments).parameters.items()}
        return sections(self.task, documented, added, None if registered is None else registered.kwargs)

    def _documented(self) -> type:
        """Class whose docstring documents the task."""
        return type(self.task)

    def close(self) -> None:
        """Close the window, if there is one; `reset` opens the environment again."""
        self._view.close()
        self._is_closed, self._has_reset = True, False

    def _not_ready(self, call: str) -> Exception:
        if self._is_closed:
            return gym.error.ClosedEnvironmentError(f"{call}() after close(): allowed is reset() or a new environment")
        return gym.error.ResetNeeded(f"call reset() before {call}()")
