"""State of a task: a copy of all that decides the future of its worlds and episodes."""

from __future__ import annotations

import io
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

import physics
from physics import validation
from physics.html_table import parts_table
from physics.undo import Undo
from physics.world import choice, restoring
from physics.world.headed_file import FileKind, head_value, is_count, is_text
from rigid_env.tasks.draws import parameter_of
from rigid_env.tasks.state_settings import check_settings

HELD = "held "
OF_ENVIRONMENTS = frozenset(("waiting", "ended", "pictures"))  # parts that a task without an environment leaves out
FILE = FileKind(
    "task state", "state of a task", "TaskState.save", format=3, oldest=3, missing="all settings of the task"
)


@dataclass(frozen=True)
class TaskState:
    """Copy of all that decides the future of a task's worlds, and the settings that must agree where it is restored.

    Accuracy, `max_episode_steps` and distributions of draws may differ: the same worlds then continue with the new
    ones.

    Parameters
    ----------
    task : str
        Name of the task's class.
    settings : dict of str to str, int or float
        Settings that must be the same where it goes on: ``frame_skip``, ``dt`` and others, see
        `rigid_env.tasks.state_settings`.
    world : physics.Snapshot
        The worlds: poses, velocities, parameters, warm starts, actuators, time.
    arrays : dict of str to array
        Rows of each world: drawn values, memory, actions, the potential and the hold of compiled tasks, disturbances,
        observations and outcomes of the last step.
    held : dict of str to array
        Values that `Task.hold` gave, of each world.
    told : tuple of str
        Physical parameters that the worlds are told of at the start of an episode.
    generators, seeds : tuple
        State of each world's random generator, and the seed that it began with; None before its first reset.
    """

    task: str
    settings: dict[str, str | int | float]
    world: physics.Snapshot
    arrays: dict[str, np.ndarray]
    held: dict[str, np.ndarray]
    told: tuple[str, ...]
    generators: tuple[dict[str, Any] | None, ...]
    seeds: tuple[int | None, ...]

    @property
    def worlds(self) -> int:
        """Number of worlds in the state."""
        return len(self.generators)

    def __repr__(self) -> str:
        return f"TaskState({', '.join(self._parts())})"

    _repr_html_ = parts_table

    def _parts(self) -> tuple[str, ...]:
        return self.task, f"{self.worlds} worlds", f"time={self.world.time:.6g} s"

    def save(self, path: str | os.PathLike) -> Path:
        """Write the state as ``.npz`` (`load` reads it); return the path.

        Parameters
        ----------
        path : str or Path
        """
        world = io.BytesIO()
        self.world.write(world)
        head = {
            "task": self.task, "settings": self.settings, "told": self.told, "seeds": self.seeds,
            "generators": list(map(_as_json, self.generators)),
        }  # fmt: skip
        parts = {f"{HELD}{name}": values for name, values in self.held.items()} | self.arrays
        parts["world"] = np.frombuffer(world.getvalue(), dtype=np.uint8)
        with open(validation.path(path), "wb") as file:
            FILE.write(file, head, parts)
        return Path(path)

    @classmethod
    def load(cls, path: str | os.PathLike) -> TaskState:
        """Read a state that `save` has written, bit for bit, without running code from the file.

        Parameters
        ----------
        path : str or Path

        Raises
        ------
        ValueError
            It is no state of a task, a damaged one, or one of another format than 2.
        OSError
            The file cannot be read.
        """
        return FILE.read(io.BytesIO(Path(validation.path(path)).read_bytes()), path, partial(_from_parts, path))


def _from_parts(path: str | os.PathLike, head: Mapping[str, Any], parts: dict[str, np.ndarray]) -> TaskState:
    """Make a state of the head and the arrays of a file; `put` finds out whether it fits a task."""
    world = physics.Snapshot.read(io.BytesIO(parts.pop("world").tobytes()), path)
    held = {name.removeprefix(HELD): parts.pop(name) for name in list(parts) if name.startswith(HELD)}
    count = world.worlds
    task = head_value(head, "task", is_text, "the name of a class")
    settings = head_value(head, "settings", _are_settings, "names and texts or numbers")
    told = head_value(head, "told", _are_names, "a list of physical parameters")
    generators = head_value(head, "generators", lambda value: _are_generators(value, count), f"{count} states of PCG64")
    seeds = head_value(head, "seeds", lambda value: _are_seeds(value, count), f"a list of {count} integers, or null")
    _check_rows(parts | held, count)
    return TaskState(task, settings, world, parts, held, tuple(told), tuple(map(_of_json, generators)), tuple(seeds))


def _are_settings(value: Any) -> bool:
    return isinstance(value, dict) and all(isinstance(each, (str, int, float)) for each in value.values())


def _are_names(value: Any) -> bool:
    return isinstance(value, list) and all(isinstance(name, str) and parameter_of(name) for name in value)


def _are_seeds(value: Any, count: int) -> bool:
    """True if these are seeds: integers, or -1 or None before the first reset."""
    return (
        isinstance(value, list) and len(value) == count and all(each in (None, -1) or is_count(each) for each in value)
    )


def _are_generators(value: Any, count: int) -> bool:
    for state in value:
        if state is not None:
            bits: Any = np.random.PCG64()
            bits.state = _of_json(state)
    return isinstance(value, list) and len(value) == count


def _check_rows(arrays: Mapping[str, np.ndarray], count: int) -> None:
    """Refuse an array that does not have a row for each world."""
    for name, array in arrays.items():
        if array.ndim == 0 or len(array) != count:
            raise ValueError(f"{name} has shape {array.shape}; allowed is a row for each of {count} worlds")


def _as_json(state: Mapping[str, Any] | None) -> Any:
    """State of a generator with its large integers as text."""
    if state is None:
        return None
    return {key: _as_json(value) if isinstance(value, Mapping) else str(value) for key, value in state.items()}


def _of_json(state: Mapping[str, Any] | None) -> dict[str, Any] | None:
    if state is None:
        return None
    found: dict[str, Any] = {}
    for key, value in state.items():
        if isinstance(value, Mapping):
            found[key] = _of_json(value)
        else:
            found[key] = int(value) if str(value).lstrip("-").isdigit() else str(value)
    return found


def take(task, arrays: Mapping[str, np.ndarray], seeds: Sequence[int | None], worlds=None) -> TaskState:
    """Copy the state of a task.

    Parameters
    ----------
    task : Task
    arrays : mapping of str to (worlds, ...) array
        More that goes along, of an environment.
    seeds : sequence
        Of the generators.
    worlds : (k,) array_like of int, or mask, optional
        Worlds meant; None: all.

    Raises
    ------
    ValueError
        A world that is not there, or named twice.
    """
    chosen: Any = slice(None) if worlds is None else choice.world_indices(worlds, task.worlds)
    indices = range(task.worlds) if worlds is None else chosen.tolist()
    states = [task.generators[world] for world in indices]
    return TaskState(
        type(task).__name__,
        task.settings_of_state,
        task.world.snapshot(worlds),
        {name: array[chosen].copy() for name, array in {**task.state_arrays(), **arrays}.items()},
        {name: array[chosen].copy() for name, array in task.episodes.held.items()},
        tuple(sorted(task.episodes.varying)),
        tuple(None if each is None else each.bit_generator.state for each in states),
        tuple(seeds[world] for world in indices),
    )


def put(task, arrays: Mapping[str, np.ndarray], state: TaskState, worlds=None, source=None) -> tuple:
    """Continue worlds of a task from a state; after an error nothing has changed.

    Parameters
    ----------
    task : Task
    arrays : mapping of str to (worlds, ...) array
        As of `take`; they are written.
    state : TaskState
    worlds, source
        As of `physics.World.restore`.

    Returns
    -------
    chosen, sources : (k,) int64
        Worlds that changed, and the worlds of the state that they go on from.

    Raises
    ------
    ValueError
        It is no state, one of another task or of other settings, or indices out of range.
    """
    validation.instance(state, TaskState, "state", "what get_state gives")
    _check(task, arrays, state)
    places = restoring.find_targets(task.world, state.world, worlds, source)
    if not places.is_all and state.held.keys() != task.episodes.held.keys():
        ours, theirs = (", ".join(held) or "nothing" for held in (task.episodes.held, state.held))
        raise ValueError(f"state holds {theirs}, the task {ours}; allowed is the same, or a state for all worlds")
    task.world.restore_targets(state.world, places)
    chosen, sources = _indices(task.worlds, state.worlds, places)
    if places.worlds is None and places.source is None and state.worlds == task.worlds:
        _write(task, arrays, state, slice(None), slice(None))
    else:
        _write(task, arrays, state, chosen, sources)
    if state.held or task.episodes.held:
        _hold(task, state, chosen, sources, places.is_all)
    task.episodes.varying.update(state.told)
    _put_generators(task.generators, state.generators, chosen.tolist(), sources.tolist())
    return chosen, sources


def remember(task, rows: np.ndarray | None = None) -> Undo:
    """Copy a task, some worlds or all: to put it back is to go on from there."""
    before = take(task, {}, [None] * task.worlds, rows)

    def put_back() -> None:
        put(task, {}, before, rows)

    return put_back


def _indices(worlds: int, held: int, places: restoring.Targets) -> tuple[np.ndarray, np.ndarray]:
    """Indices of the worlds that change, and of those of the state from which they continue."""
    chosen = np.arange(worlds) if places.worlds is None else places.worlds
    if places.source is not None:
        return chosen, places.source
    return chosen, np.arange(held) if held == len(chosen) else np.zeros(len(chosen), dtype=np.int64)


def _write(task, arrays: Mapping[str, np.ndarray], state: TaskState, chosen, sources) -> None:
    """Copy rows `sources` of a state into rows `chosen` of a task and its environment."""
    given = state.arrays
    if type(sources) is slice:  # all, in their order
        for own in (task.kept_arrays, arrays):
            for name, array in own.items():
                array[...] = given[name]
    else:
        for own in (task.kept_arrays, arrays):
            for name, array in own.items():
                array[chosen] = given[name][sources]
    task.adopt(chosen, given["steps"][sources])


def _hold(task, state: TaskState, chosen: np.ndarray, sources: np.ndarray, is_all: bool) -> None:
    """Give the task the held values of the state."""
    held = task.episodes.held
    for name, values in state.held.items():
        held.setdefault(name, np.zeros((task.worlds, *values.shape[1:])))[chosen] = values[sources]
    if is_all:
        for name in held.keys() - state.held.keys():
            del held[name]


def _put_generators(generators: list, states: Sequence[dict[str, Any] | None], chosen: list, sources: list) -> None:
    for world, of in zip(chosen, sources):
        state = states[of]
        if state is None:
            generators[world] = None
            continue
        if generators[world] is None:
            generators[world] = np.random.Generator(np.random.PCG64())
        generators[world].bit_generator.state = state


def _check(task, arrays: Mapping[str, np.ndarray], state: TaskState) -> None:
    """Refuse a state of another task, or of one with other settings or parts."""
    name = type(task).__name__
    if state.task != name:
        raise ValueError(f"state is {state!r}; allowed are states of {name}")
    if state.settings != task.settings_of_state:
        check_settings(name, task.settings_of_state, state.settings)
    given, kept = state.arrays, task.kept_arrays
    has_all = given.keys() >= kept.keys() and given.keys() >= arrays.keys()
    if not has_all or len(given) != len(kept) + len(arrays) + 1:
        odd = given.keys() ^ {*kept, *arrays, "steps"}
        if arrays or odd - OF_ENVIRONMENTS:
            names = ", ".join(sorted(odd))
            raise ValueError(f"state is {state!r}, with other parts ({names}); allowed are states of the same settings")
    count, is_alike = state.worlds, state.worlds == task.worlds
    for own in (kept, arrays):
        for part, array in own.items():
            value = given[part]
            if not is_alike or value.shape != array.shape or value.dtype is not array.dtype:  # rarely
                _check_part(part, value, array, count)
    _check_part("steps", given["steps"], task.status, count)
    for part in state.told:
        if part not in task.episodes.parameters:
            allowed = ", ".join(task.episodes.parameters) or "none"
            raise ValueError(f"state tells worlds of {part}, which {name} does not draw; allowed are {allowed}")
    for part, value in state.held.items():
        if part not in task.drawn:
            raise ValueError(f"state holds {part}, which {name} does not draw; allowed are {', '.join(task.drawn)}")
        _check_part(f"held {part}", value, task.drawn[part], count)


def _check_part(part: str, value: np.ndarray, array: np.ndarray, count: int) -> None:
    if value.shape[1:] != array.shape[1:] or value.dtype != array.dtype or len(value) != count:
        allowed = f"{(count, *array.shape[1:])} of {array.dtype}"
        raise ValueError(f"{part} of state has shape {value.shape} of {value.dtype}; allowed is {allowed}")
