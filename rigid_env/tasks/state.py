"""State of a task: all that decides how its worlds and episodes go on, copied."""

from __future__ import annotations

import io
import json
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from zipfile import is_zipfile

import numpy as np

import physics
from physics import validation
from physics.world import choice, restoring

FORMAT = 1
HELD = "held "
OF_ENVIRONMENTS = frozenset(("waiting", "ended", "pictures"))  # parts that a task without an environment leaves out
KIND = "task state"


@dataclass(frozen=True)
class TaskState:
    """Everything that decides how the worlds of a task go on.

    Parameters
    ----------
    task : str
        Name of the task's class.
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
    world: physics.Snapshot
    arrays: dict[str, np.ndarray]
    held: dict[str, np.ndarray]
    told: tuple[str, ...]
    generators: tuple[dict[str, Any] | None, ...]
    seeds: tuple[int | None, ...]

    @property
    def worlds(self) -> int:
        """Number of worlds that it is of."""
        return len(self.generators)

    def __repr__(self) -> str:
        return f"TaskState({self.task}, {self.worlds} worlds, time={self.world.time:.6g} s)"

    def save(self, path: str | os.PathLike) -> Path:
        """Write it as ``.npz`` (`load` reads it); returns the path.

        Parameters
        ----------
        path : str or Path
        """
        world = io.BytesIO()
        self.world.write(world)
        head = {
            "kind": KIND, "format": FORMAT, "task": self.task, "told": self.told, "seeds": self.seeds,
            "generators": list(map(_as_json, self.generators)),
        }  # fmt: skip
        parts = {f"{HELD}{name}": values for name, values in self.held.items()} | self.arrays
        with open(validation.path(path), "wb") as file:
            binary = np.frombuffer(world.getvalue(), dtype=np.uint8)
            np.savez_compressed(file, head=json.dumps(head), world=binary, **parts)
        return Path(path)

    @classmethod
    def load(cls, path: str | os.PathLike) -> TaskState:
        """Read a state that `save` has written, bit for bit; nothing in a file is run.

        Parameters
        ----------
        path : str or Path

        Raises
        ------
        ValueError
            It is no state of a task, a damaged one, or one of a newer format.
        OSError
            The file cannot be read.
        """
        content = io.BytesIO(Path(validation.path(path)).read_bytes())
        allowed = "allowed is what TaskState.save writes (.npz)"
        if not is_zipfile(content):
            raise ValueError(f"{path} is no state of a task; {allowed}")
        try:
            with np.load(content, allow_pickle=False) as file:
                parts = dict(file)
            head = json.loads(str(parts.pop("head")))
            if head["kind"] != KIND or validation.count(head["format"], "its format") > FORMAT:
                raise ValueError(f"it is a {head['kind']} of format {head['format']}")
            world = physics.Snapshot.read(io.BytesIO(parts.pop("world").tobytes()), path)
            held = {name.removeprefix(HELD): parts.pop(name) for name in list(parts) if name.startswith(HELD)}
            generators = tuple(map(_of_json, head["generators"]))
            return cls(str(head["task"]), world, parts, held, tuple(head["told"]), generators, tuple(head["seeds"]))
        except Exception as error:  # whatever is wrong with it, it is none
            told = f"there is no {error}" if isinstance(error, KeyError) else error
            raise ValueError(f"{path} is no state of a task ({told}); {allowed}") from None


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
    chosen = slice(None) if worlds is None else choice.chosen(worlds, task.worlds)
    indices = range(task.worlds) if worlds is None else chosen.tolist()
    states = [task.generators[world] for world in indices]
    return TaskState(
        type(task).__name__,
        task.world.snapshot(worlds),
        {name: array[chosen].copy() for name, array in {**task.state_arrays(), **arrays}.items()},
        {name: array[chosen].copy() for name, array in task.episodes.held.items()},
        tuple(sorted(task.episodes.varying)),
        tuple(None if each is None else each.bit_generator.state for each in states),
        tuple(seeds[world] for world in indices),
    )


def put(task, arrays: Mapping[str, np.ndarray], state: TaskState, worlds=None, source=None) -> tuple:
    """Let worlds of a task go on from a state; after an error nothing has changed.

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
    own = {**task.state_arrays(), **arrays}
    _check(task, own, state, OF_ENVIRONMENTS if not arrays else frozenset())
    places = restoring.places(task.world, state.world, worlds, source)
    chosen = np.arange(task.worlds) if places.worlds is None else places.worlds
    sources = places.source
    if sources is None:
        sources = np.arange(len(chosen)) if state.worlds == len(chosen) else np.zeros(len(chosen), dtype=np.int64)
    if not places.is_all and state.held.keys() != task.episodes.held.keys():
        ours, theirs = (", ".join(held) or "nothing" for held in (task.episodes.held, state.held))
        raise ValueError(f"state holds {theirs}, the task {ours}; allowed is the same, or a state for all worlds")
    task.world.restore(state.world, worlds, source)
    if places.worlds is None and places.source is None and state.worlds == task.worlds:
        for name, array in own.items():
            array[...] = state.arrays[name]
        task.adopt(slice(None), state.arrays["steps"])
    else:
        for name, array in own.items():
            array[chosen] = state.arrays[name][sources]
        task.adopt(chosen, state.arrays["steps"][sources])
    for name, values in state.held.items():
        task.episodes.held.setdefault(name, np.zeros((task.worlds, *values.shape[1:])))[chosen] = values[sources]
    if places.is_all:
        for name in task.episodes.held.keys() - state.held.keys():
            del task.episodes.held[name]
    task.episodes.varying.update(state.told)
    for world, of in zip(chosen.tolist(), sources.tolist()):
        _put_generator(task, world, state.generators[of])
    return chosen, sources


def _put_generator(task, world: int, state: dict[str, Any] | None) -> None:
    if state is None:
        task.generators[world] = None
        return
    if task.generators[world] is None:
        task.generators[world] = np.random.Generator(np.random.PCG64())
    task.generators[world].bit_generator.state = state


def _check(task, own: Mapping[str, np.ndarray], state: TaskState, more: frozenset[str]) -> None:
    """Refuse a state of another task, or of the same with other settings; it may have `more` parts."""
    name = type(task).__name__
    if state.task != name:
        raise ValueError(f"state is {state!r}; allowed are states of {name}")
    odd = own.keys() ^ state.arrays.keys()
    if odd - more:
        odd = ", ".join(sorted(odd))
        raise ValueError(f"state is {state!r}, with other parts ({odd}); allowed are states of the same settings")
    count, is_alike = state.worlds, state.worlds == task.worlds
    for part, array in own.items():
        given = state.arrays[part]
        if given.dtype is array.dtype and is_alike and given.shape == array.shape:  # the most frequent
            continue
        if given.shape[1:] != array.shape[1:] or given.dtype != array.dtype or len(given) != count:
            raise ValueError(
                f"{part} of state has shape {given.shape} of {given.dtype}; allowed is "
                f"{(state.worlds, *array.shape[1:])} of {array.dtype}"
            )
