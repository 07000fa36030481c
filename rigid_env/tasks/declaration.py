"""Declaration of a task by a subclass of `Task`: attributes, and NumPy functions of `Worlds`."""

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
    """Attributes and functions of a task; `Task` documents the attributes.

    All functions see arrays with one row for each world, and are called once in a control step: `measure`, `update`,
    `success`, `failure`, `rewards`, then the entries of the observation. At the start of episodes it is `place`,
    `measure`, `begin` and the entries, with the worlds in which they begin.

    Attributes
    ----------
    compiled : callable or None
        A kernel in place of the functions `update` to `measure` and of the entries' `read`, for speed:
        ``(taken, state, record, walls, actions, obs, outcome)``, decorated with `rigid_env.compiled.kernel`. It
        runs in the threads that step the worlds.
    measures, terms : tuple of str
        Of a compiled task: the names of what it writes into `outcome` behind reward, success and failure.
    record_size : int
        Of a compiled task: numbers per world in `record`, which is its memory; `note_episodes` writes draws into it.
    """

    scene: ClassVar[physics.Scene]
    actions: ClassVar[Any] = Wrench()
    observation: ClassVar[Entries] = ()
    draws: ClassVar[Mapping[str, Any]] = {}
    memory: ClassVar[Mapping[str, int]] = {}
    disturbances: ClassVar[Sequence] = ()
    max_episode_steps: ClassVar[int | None] = None
    ends_on_success: ClassVar[bool] = True

    compiled: ClassVar[Callable | None] = None
    measures: ClassVar[tuple[str, ...]] = ()
    terms: ClassVar[tuple[str, ...]] = ()
    record_size: ClassVar[int] = 0

    def declared_draws(self) -> Mapping[str, Any]:
        """Distributions of the task by name: `draws`, or distributions from the task's arguments."""
        return self.draws

    def make_scene(self, distributions: Mapping[str, Distribution]) -> physics.Scene:
        """Scene of all worlds: `scene`, or one made from the task's arguments."""
        return self.scene

    def place(self, drawn: Mapping[str, np.ndarray]) -> Mapping[str, Any]:
        """Return the starting poses of bodies.

        Parameters
        ----------
        drawn : dict of str to (n,) or (n, k) float64
            Values of the n episodes that begin.

        Returns
        -------
        dict
            Of ``pos``, ``quat``, ``linvel`` and ``angvel``, (n, bodies, 3|4|3|3), of one body also (n, 3|4|3|3), or one
            for all. Arrays that are left out are the scene's.
        """
        return {}

    def begin(self, worlds: Worlds) -> None:
        """Prepare `memory` for episodes that begin; it is zero before."""

    def note_episodes(self, rows: np.ndarray, values: Mapping[str, np.ndarray]) -> None:
        """Write draws into `record`, where a compiled function finds them; NumPy functions do not need it.

        Parameters
        ----------
        rows : (n,) int64
            Worlds in which episodes begin: rows of `record`, which are as the last episode left them.
        values : mapping of str to (n,) or (n, k) float64
            Values of these episodes, by the names of `draws`.
        """

    def update(self, worlds: Worlds) -> None:
        """Change `memory` from the state of the worlds, first in a control step."""

    def success(self, worlds: Worlds) -> np.ndarray:
        """Worlds (n,) bool that have solved the task, which ends the episode unless `ends_on_success` is False."""
        return np.zeros(len(worlds), dtype=np.bool_)

    def failure(self, worlds: Worlds) -> np.ndarray:
        """Worlds (n,) bool that cannot solve the task any more, which ends the episode, too."""
        return np.zeros(len(worlds), dtype=np.bool_)

    def rewards(self, worlds: Worlds) -> Mapping[str, np.ndarray]:
        """Terms of the reward (n,), by name: their sum is the reward, and each is in `info`."""
        return {}

    def measure(self, worlds: Worlds) -> Mapping[str, np.ndarray]:
        """Numbers (n,) by name for `info`, and for the functions below as `worlds.measured`."""
        return {}

    def goal_mark(self, world: int) -> Mapping[str, Any] | None:
        """Return the mark of one world's goal in pictures.

        Parameters
        ----------
        world : int

        Returns
        -------
        dict or None
            Arguments of `rigid_env.rendering.GoalView`: ``pos`` (3,) of a disc on the floor and its ``radius`` [m],
            or ``goal_face`` of body 0; ``reached`` chooses the colour. None: no goal is drawn.
        """
        return None
