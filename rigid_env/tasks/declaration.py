"""Interface that a subclass of `Task` fills in: attributes, and NumPy functions of `Worlds`."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, ClassVar

import numpy as np

import physics
from rigid_env.tasks.actions import Wrench
from rigid_env.tasks.distribution import Distribution
from rigid_env.tasks.entries import Entries
from rigid_env.tasks.worlds import Worlds


class Declaration:
    """Attributes and functions of a task, with defaults; `Task` documents the attributes not listed here.

    All functions get arrays with one row for each world. In each control step they are called once, in this order:
    `measure`, `update`, `success`, `failure`, `rewards`, then `read` of the observation's entries. At the start of
    episodes the order is `place`, `measure`, `begin`, then `read` of the entries; the arrays then have rows only for
    the worlds in which an episode begins.

    Attributes
    ----------
    compiled : callable or None
        A kernel that replaces `measure`, `update`, `success`, `failure`, `rewards` and `read` of the entries, for
        speed. It takes ``(taken, state, record, walls, actions, obs, outcome)``, is decorated with
        `rigid_env.compiled.kernel`, and runs in the threads that step the worlds. None: the NumPy functions run.
    measures, terms : tuple of str
        Only for a compiled task: names of the numbers, and of the terms of the reward, that the kernel writes into
        `outcome` after reward, success and failure.
    camera : mapping or None
        Parameters of the `rigid_env.rendering.Camera` of `render`, such as ``{"eye": (0, 8, 20)}``; None has the room
        in view. The environment's argument of this name replaces it. Observed pictures have their own camera.
    shown_box : pair of (3,) float or None
        Lower and upper corner of a box that pictures of `render` show besides the bodies [m]; None: no such box.
    explanations : mapping of str to str
        Short explanations with units, for the tables of documentation: of measures and draws by name, of terms of the
        reward by their key in infos, such as ``reward_near``. Those of base classes hold, too.
    record_size : int
        Only for a compiled task: length of each world's row in `record`, the kernel's memory. `note_episodes` writes
        drawn values into it.
    """

    scene: ClassVar[physics.Scene]
    actions: ClassVar[Any] = Wrench()
    observation: ClassVar[Entries] = ()
    draws: ClassVar[Mapping[str, Any]] = {}
    memory: ClassVar[Mapping[str, int]] = {}
    disturbances: ClassVar[Sequence] = ()
    max_episode_steps: ClassVar[int | None] = None
    ends_on_success: ClassVar[bool] = True
    explanations: ClassVar[Mapping[str, str]] = {}
    camera: ClassVar[Mapping[str, Any] | None] = None
    shown_box: ClassVar[tuple[Sequence[float], Sequence[float]] | None] = None

    compiled: ClassVar[Callable | None] = None
    measures: ClassVar[tuple[str, ...]] = ()
    terms: ClassVar[tuple[str, ...]] = ()
    record_size: ClassVar[int] = 0

    def declared_draws(self) -> Mapping[str, Any]:
        """Distributions that each episode draws from, by name: `draws`, or those made from constructor arguments."""
        return self.draws

    def make_scene(self, distributions: Mapping[str, Distribution]) -> physics.Scene:
        """Scene of all worlds: `scene`, or one made from constructor arguments and the task's `distributions`."""
        return self.scene

    def place(self, drawn: Mapping[str, np.ndarray]) -> Mapping[str, Any]:
        """Return the starting poses and velocities of the bodies.

        Parameters
        ----------
        drawn : dict of str to (n,) or (n, k) float64
            Drawn values of the n episodes that begin, by the names of `draws`.

        Returns
        -------
        dict
            Arrays ``pos``, ``quat``, ``linvel`` and ``angvel`` of shape (n, bodies, 3|4|3|3). A scene with one body may
            leave out the axis of bodies; an array without the axis of episodes holds for all. The scene's values
            replace missing arrays.
        """
        return {}

    def begin(self, worlds: Worlds) -> None:
        """Set the starting values of `worlds.memory`, which holds zeros, for the episodes that begin."""

    def note_episodes(self, rows: np.ndarray, values: Mapping[str, np.ndarray]) -> None:
        """Write drawn values into `record`, where a compiled task's kernel finds them; NumPy functions do not need it.

        Parameters
        ----------
        rows : (n,) int64
            Worlds in which episodes begin. Their rows of `record` still hold the numbers of the last episode.
        values : mapping of str to (n,) or (n, k) float64
            Drawn values of these episodes, by the names of `draws`.
        """

    def update(self, worlds: Worlds) -> None:
        """Update `worlds.memory` from the state of the worlds; it is called after `measure` in each control step."""

    def success(self, worlds: Worlds) -> np.ndarray:
        """Flags (n,) bool of worlds that have solved the task, which ends the episode if `ends_on_success` is True."""
        return np.zeros(len(worlds), dtype=np.bool_)

    def failure(self, worlds: Worlds) -> np.ndarray:
        """Flags (n,) bool of worlds that can no longer solve the task; an episode ends with it."""
        return np.zeros(len(worlds), dtype=np.bool_)

    def rewards(self, worlds: Worlds) -> Mapping[str, np.ndarray]:
        """Terms of the reward, each (n,), by name: their sum is the reward, and `info` holds each of them."""
        return {}

    def measure(self, worlds: Worlds) -> Mapping[str, np.ndarray]:
        """Numbers (n,) by name: `info` holds them, and other functions of the task read them as `worlds.measured`."""
        return {}

    def goal_mark(self, world: int) -> Mapping[str, Any] | None:
        """Return the mark that pictures show for the goal of one world.

        Parameters
        ----------
        world : int

        Returns
        -------
        dict or None
            Arguments of `rigid_env.rendering.GoalView`: ``pos`` (3,) of a disc on the floor and its ``radius`` [m],
            or ``goal_face`` of body 0; ``reached`` chooses the colour. With ``axis`` (3,) a ring around ``pos`` itself
            replaces the disc. None: no goal is drawn.
        """
        return None
