"""State of a task: a copy of everything that decides the future of its worlds and episodes, and its file format."""

from __future__ import annotations

import io
import os
from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

import physics
from physics import validation
from physics.html_table import parts_table
from physics.world.headed_file import FileKind, head_value, is_count, is_text
from rigid_env.tasks.draws import parameter_of

HELD = "held "
FILE = FileKind(
    "task state", "state of a task", "TaskState.save", format=3, oldest=3, missing="all settings of the task"
)


@dataclass(frozen=True)
class TaskState:
    """Copy of everything that decides the future of a task's worlds, with the settings that restoring requires.

    Accuracy, `max_episode_steps` and the distributions of draws may differ: the worlds then continue with those of the
    task that restores the state.

    Parameters
    ----------
    task : str
        Name of the task's class.
    settings : dict of str to str, int or float
        Settings that the restoring task must have, too: ``frame_skip``, ``dt`` and others, see
        `rigid_env.tasks.state_settings`.
    world : physics.Snapshot
        Poses, velocities, parameters, warm starts, actuators and time of the worlds.
    arrays : dict of str to array
        Arrays with a row for each world: drawn values, memory, actions, potential and hold of compiled tasks,
        disturbances, observations and outcomes of the last step.
    held : dict of str to array
        Values that `Task.hold` holds, with a row for each world.
    told : tuple of str
        Physical parameters that are written into the worlds at the start of an episode.
    generators, seeds : tuple
        State of each world's random generator, and the seed that it began with; None before the world's first reset.
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
        """Write the state to a ``.npz`` file, which `load` reads; return the path.

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
        """Read a state from a file of `save`, bit for bit, without running code from the file.

        Parameters
        ----------
        path : str or Path

        Raises
        ------
        ValueError
            The file holds no state of a task, a damaged one, or one of another format than 3.
        OSError
            The file cannot be read.
        """
        return FILE.read(io.BytesIO(Path(validation.path(path)).read_bytes()), path, partial(_from_parts, path))


def _from_parts(path: str | os.PathLike, head: Mapping[str, Any], parts: dict[str, np.ndarray]) -> TaskState:
    """Make a state from the head and the arrays of a file at `path`.

    The head and the shapes are checked here; `rigid_env.tasks.restoring` checks whether the state fits a task.
    """
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
    """True if the value is a list of `count` seeds: integers, or -1 or None for a world before its first reset."""
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
    """Raise a ValueError for an array that does not have `count` rows, one for each world."""
    for name, array in arrays.items():
        if array.ndim == 0 or len(array) != count:
            raise ValueError(f"{name} has shape {array.shape}; allowed is a row for each of {count} worlds")


def _as_json(state: Mapping[str, Any] | None) -> Any:
    """State of a random generator for JSON, whose large integers become text; None stays None."""
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
