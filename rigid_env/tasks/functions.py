"""Calls of a task's NumPy functions in each control step, with checks of the results that they return."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from physics.undo import undo_on_error
from rigid_env.tasks import layout as col
from rigid_env.tasks.named import Named
from rigid_env.tasks.step_undo import StepUndo
from rigid_env.tasks.task_parts import Called
from rigid_env.tasks.worlds import Worlds


class Functions:
    """Caller of the NumPy functions of a task that is not compiled; it checks and stores their results.

    The constructor calls each function once for world 0, with drawn values. This rehearsal finds a mistake before the
    first episode.

    Parameters
    ----------
    task : Called
        The task. The first call of `measure` and `rewards` gives it the names `measures` and `terms`.
    is_first : bool
        False skips the rehearsal, for a copy of a task, which has these names already.

    Raises
    ------
    ValueError
        A function returns a wrong result: names the function, the result and what is allowed.
    """

    def __init__(self, task: Called, is_first: bool = True):
        self.task, self._name = task, type(task).__name__
        self._entries = task.observed.entries
        unread = [entry.names[0] for entry in self._entries if entry.read is None]
        if unread:
            raise ValueError(
                f"read of entry {unread[0]!r} is None; allowed is a function of Worlds, or a compiled task"
            )
        self._all = Worlds(task)
        if is_first:
            self._rehearse()
        self._outcome = np.zeros((task.worlds, col.INFO + len(task.measures) + len(task.terms)))
        if is_first:
            task.set_outcome(np.zeros_like(self._outcome))
        self._obs = np.zeros_like(task.obs)
        self.undo = StepUndo(task)

    def _rehearse(self) -> None:
        """Call each function once in world 0, with drawn values, and restore the world; errors name the rehearsal."""
        task = self.task
        world, kept = task.world.snapshot(), {name: array[0].copy() for name, array in task.drawn.items()}
        values = task.episodes.draw(np.zeros(1, dtype=np.int64), task.episodes.rehearsal(), {})
        try:
            for name, value in values.items():
                task.drawn[name][0] = value[0]
            self._call_each(values)
        except Exception as error:
            drawn = ", ".join(f"{name} = {value[0].tolist()}" for name, value in values.items())
            told = f"in the rehearsal of {self._name}, when it is made, {f'with {drawn}' if drawn else 'without draws'}"
            if isinstance(error, ValueError):
                raise ValueError(f"{error} ({told})") from error
            if hasattr(error, "add_note"):  # from Python 3.11 on
                error.add_note(told)
            raise
        finally:
            task.world.restore(world)
            for name, array in kept.items():
                task.drawn[name][0] = array

    def _call_each(self, values: Mapping[str, np.ndarray]) -> None:
        """Call each function with two rows that both stand for world 0, so that a wrong shape does not fit by chance.

        `values` are the drawn values of one episode, by name. The call sets the task's `measures` and `terms`.
        """
        task = self.task
        task.move(np.zeros(1, dtype=np.int64), values, {})
        worlds = Worlds(task, np.zeros(2, dtype=np.int64))
        self._measure(worlds)
        task.begin(worlds)
        terms = self._look(worlds)
        own: Any = task  # set on the instance, where they hide the class's attributes
        own.measures, own.terms = tuple(map(str, worlds.measured)), tuple(map(str, terms))
        out = np.zeros((2, col.INFO + len(terms) + len(worlds.measured)))
        self._fill("measure", worlds.measured, task.measures, out, col.INFO)
        self._fill("rewards", terms, task.terms, out, col.INFO)
        try:
            task.observed.read(worlds, np.empty((2, task.obs.shape[1]), dtype=np.float32))
        except (IndexError, KeyError) as error:
            parts = f"{task.world.body_count} bodies and {len(task.world.walls)} walls"
            if task.world.scene.sensors:
                sensors = f"{len(task.world.scene.sensors)} sensors"
                parts = f"{task.world.body_count} bodies, {len(task.world.walls)} walls and {sensors}"
            told = f"observation of {self._name} ends with {type(error).__name__}: {error}"
            raise ValueError(f"{told}; allowed are parts of its scene, {parts}") from error

    def begin(self, rows: np.ndarray) -> None:
        """Write the first observations and measures of the episodes that begin in worlds `rows` (n,) into the task."""
        task = self.task
        worlds = Worlds(task, rows)
        self._measure(worlds)
        task.begin(worlds)
        outcome = np.zeros((len(rows), self._outcome.shape[1]))
        self._fill("measure", worlds.measured, task.measures, outcome, col.INFO)
        obs = np.empty((len(rows), task.obs.shape[1]), dtype=np.float32)
        seen = task.observed.read(worlds, obs)
        self._check_finite(outcome, seen, obs, rows)
        for name, values in worlds.memory.items():
            task.memory_arrays[name][rows] = values
        task.outcome[rows], task.obs[rows] = outcome, obs

    def step(self, actions: np.ndarray) -> None:
        """Advance all worlds by one control step, and observe them; an error restores the task."""
        task = self.task
        task.given[...] = actions
        if not np.isfinite(task.given).all():
            raise task.not_finite(int(np.flatnonzero(~np.isfinite(task.given).all(axis=1))[0]))
        with undo_on_error(self.undo.keep()):
            task.previous_action[...] = task.action
            np.clip(task.given, -1.0, 1.0, out=task.given)
            task.act()
            self._conclude()

    def _conclude(self) -> None:
        task, worlds, outcome = self.task, self._all, self._outcome
        worlds.renew()
        terms = self._look(worlds)
        first = col.INFO + len(task.measures)
        self._fill("measure", worlds.measured, task.measures, outcome, col.INFO)
        self._fill("rewards", terms, task.terms, outcome, first)
        outcome[:, first:].sum(axis=1, out=outcome[:, col.REWARD])
        outcome[:, col.SUCCESS], outcome[:, col.FAILURE] = worlds.success, worlds.failure
        seen = task.observed.read(worlds, self._obs)
        self._check_finite(outcome, seen, self._obs, worlds.indices)
        task.outcome[...], task.obs[...] = outcome, self._obs

    def _look(self, worlds: Worlds) -> Mapping:
        """Call `measure`, `update`, `success`, `failure`, `rewards` in this order; return the terms of the reward."""
        task = self.task
        self._measure(worlds)
        task.update(worlds)
        worlds.success = self._flags("success", task.success(worlds), len(worlds))
        worlds.failure = self._flags("failure", task.failure(worlds), len(worlds))
        return self._numbers("rewards", task.rewards(worlds), len(worlds))

    def _measure(self, worlds: Worlds) -> None:
        worlds.measured = Named(self._numbers("measure", self.task.measure(worlds), len(worlds)), "measured")

    def _numbers(self, function: str, values, count: int) -> dict:
        """Check that a function's result is a dict of numbers, each (count,) or one for all; return it."""
        if type(values) is not dict:
            raise ValueError(f"{function} of {self._name} gave {values!r}; allowed is a dict of arrays by name")
        shape = (count,)
        for name, value in values.items():
            if type(value) in (float, int) or (getattr(value, "shape", None) == shape and value.dtype.kind in "fiub"):
                continue
            given = f"of {value.dtype} in shape {value.shape}" if isinstance(value, np.ndarray) else repr(value)
            what = f"{name!r} of {function} of {self._name} is {given}"
            raise ValueError(f"{what}; allowed are numbers of shape {shape}, or one for all")
        return values

    def _flags(self, function: str, values, count: int) -> np.ndarray:
        values = np.asarray(values)
        if values.shape != (count,) or values.dtype.kind != "b":
            raise ValueError(
                f"{function} of {self._name} gave {values.dtype} of shape {values.shape}; allowed are bools of shape "
                f"({count},), one for each world"
            )
        return values

    def _fill(self, function: str, values: Mapping, names: tuple[str, ...], out: np.ndarray, first: int) -> None:
        """Write the numbers of a function's result into columns of `out` from `first` on; other names are refused."""
        if tuple(values) != names:
            raise ValueError(
                f"{function} of {self._name} gave the names {', '.join(map(repr, values))}; allowed are those of its "
                f"first call, {', '.join(map(repr, names))}, in this order"
            )
        for k, value in enumerate(values.values(), first):
            out[:, k] = value

    def _check_finite(self, outcome: np.ndarray, seen: np.ndarray, obs: np.ndarray, indices: np.ndarray) -> None:
        """Raise a ValueError if a number is not finite, with its name and its world.

        Parameters
        ----------
        outcome : (n, numbers) float64
            Rewards, flags, measures and terms.
        seen : (n, entries) float64
            Observations before scaling and clipping.
        obs : (n, entries) float32
            Observations.
        indices : (n,) int64
            Worlds of the rows.
        """
        with np.errstate(invalid="ignore", over="ignore"):
            total = outcome.sum() + seen.sum() + obs.sum()  # not finite if any number is not
        if math.isfinite(total):
            return
        task = self.task
        names = ["reward", "success", "failure", *task.measures, *(f"reward term {term!r}" for term in task.terms)]
        names += 2 * [f"observation {name!r}" for name in task.observed.names]
        table = np.concatenate((outcome, seen, obs), axis=1)
        bad = np.argwhere(~np.isfinite(table))
        if len(bad) == 0:
            return
        row, column = min(bad.tolist(), key=lambda place: (place[1] == col.REWARD, place))  # a term before the sum
        what = f"{names[column]} of {self._name} is {table[row, column]} in world {indices[row]}"
        raise ValueError(f"{what}; allowed are finite numbers")
