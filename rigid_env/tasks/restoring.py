"""Copy the state of a task, and restore it, in all worlds or in chosen ones."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from physics import validation
from physics.undo import Undo
from physics.world import choice, restoring
from rigid_env.tasks.state import TaskState
from rigid_env.tasks.state_settings import check_settings

OF_ENVIRONMENTS = frozenset(("waiting", "ended", "pictures"))  # an environment's arrays, which a task alone ignores


def capture(task, arrays: Mapping[str, np.ndarray], seeds: Sequence[int | None], worlds=None) -> TaskState:
    """Copy the state of a task.

    Parameters
    ----------
    task : Task
    arrays : mapping of str to (worlds, ...) array
        Arrays of the task's environment that belong to the state.
    seeds : sequence of int or None
        Seed of each world's random generator.
    worlds : (k,) array_like of int, or mask, optional
        Worlds whose state is copied; None: all.

    Raises
    ------
    ValueError
        A world that does not exist, or one that is named twice.
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


def reinstate(task, arrays: Mapping[str, np.ndarray], state: TaskState, worlds=None, source=None) -> tuple:
    """Continue worlds of a task from a state; after an error nothing has changed.

    Parameters
    ----------
    task : Task
    arrays : mapping of str to (worlds, ...) array
        Arrays of the task's environment, as of `capture`; they are overwritten.
    state : TaskState
    worlds, source
        Worlds that continue, and the worlds of the state that they continue from, as of `physics.World.restore`.

    Returns
    -------
    chosen, sources : (k,) int64
        Worlds that changed, and the worlds of the state that they continue from.

    Raises
    ------
    ValueError
        An object that is no state, the state of another task or of other settings, or indices out of range.
    """
    validation.instance(state, TaskState, "state", "what get_state gives")
    _check(task, arrays, state)
    targets = restoring.find_targets(task.world, state.world, worlds, source)
    if not targets.is_all and state.held.keys() != task.episodes.held.keys():
        ours, theirs = (", ".join(held) or "nothing" for held in (task.episodes.held, state.held))
        raise ValueError(f"state holds {theirs}, the task {ours}; allowed is the same, or a state for all worlds")
    task.world.restore_targets(state.world, targets)
    chosen, sources = _indices(task.worlds, state.worlds, targets)
    if targets.worlds is None and targets.source is None and state.worlds == task.worlds:
        _write(task, arrays, state, slice(None), slice(None))
    else:
        _write(task, arrays, state, chosen, sources)
    if state.held or task.episodes.held:
        _hold(task, state, chosen, sources, targets.is_all)
    task.episodes.varying.update(state.told)
    _put_generators(task.generators, state.generators, chosen.tolist(), sources.tolist())
    return chosen, sources


def remember(task, rows: np.ndarray | None = None) -> Undo:
    """Copy the state of worlds `rows` of a task (None: all), and return a function that restores it."""
    before = capture(task, {}, [None] * task.worlds, rows)

    def undo() -> None:
        reinstate(task, {}, before, rows)

    return undo


def _indices(worlds: int, held: int, targets: restoring.Targets) -> tuple[np.ndarray, np.ndarray]:
    """Return indices of the worlds that change, and of the worlds of the state from which they continue.

    `worlds` and `held` are the numbers of worlds in the task and in the state.
    """
    chosen = np.arange(worlds) if targets.worlds is None else targets.worlds
    if targets.source is not None:
        return chosen, targets.source
    return chosen, np.arange(held) if held == len(chosen) else np.zeros(len(chosen), dtype=np.int64)


def _write(task, arrays: Mapping[str, np.ndarray], state: TaskState, chosen, sources) -> None:
    """Copy rows `sources` of a state into rows `chosen` of a task and its environment."""
    given = state.arrays
    task.episodes.changes += 1
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
    """Give held values of the state's worlds `sources` to worlds `chosen` of the task.

    `is_all` means that all worlds are restored: values that the state does not hold are then released.
    """
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
    """Raise a ValueError for a state of another task, or for one with other settings, arrays or worlds."""
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
            if not is_alike or value.shape != array.shape or value.dtype is not array.dtype:  # a rare case
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
