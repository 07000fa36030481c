"""History of a run: states to return to, inputs and records by which steps are repeated, and samples for plots."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Mapping
from dataclasses import is_dataclass
from typing import Any, NamedTuple

import numpy as np

EVERY = 16
"""Number of steps between two kept states at first; it doubles when they exceed `ROOM`."""

ROOM = 128 * 2**20
"""Memory that kept states may take [bytes]; beyond it every second state is dropped and the interval is doubled."""

UNITS = {
    "time": "s",
    "kinetic_energy": "J",
    "potential_energy": "J",
    "energy": "J",
    "momentum": "kg m/s",
    "penetration": "m",
    "residual": "1",
    "error": "m",
    "angle": "rad",
    "error_of_reference": "m",
    "cost": "µs/s",
    "cost_of_reference": "µs/s",
}
"""Columns of `Samples` in their order, with their units."""

FIRST_ROOM = 1024
"""Rows of the table of samples at first; it is doubled when it is full."""


class Input(NamedTuple):
    """Action of the user before a step: the name of an action that `run.Run.give` knows, and its arguments."""

    name: str
    arguments: tuple


class Entry(NamedTuple):
    """State of a run before step `index`, when the first `inputs` of the user's inputs before it had been applied.

    `size` is the memory of the state [bytes].
    """

    index: int
    state: Any
    inputs: int
    size: int


class History:
    """States of some steps of a run, and inputs and records of all steps.

    Parameters
    ----------
    time : float
        Time at the start of the run [s].
    room : int
        Memory that the kept states may take [bytes].

    Attributes
    ----------
    times : list of float
        Time before each step, and after the last [s].
    records : list
        For each step, the object from `Subject.step` with which the subject can repeat it.
    event_counts : list of int
        Number of events up to each of the `times`.
    inputs : dict of int to list of Input
        Inputs before each step, by the index of the step.
    """

    def __init__(self, time: float, room: int = ROOM):
        self.times, self.records, self.event_counts = [time], [], [0]
        self.inputs: dict[int, list[Input]] = {}
        self._entries: list[Entry] = []
        self._every, self._room, self._size = EVERY, room, 0

    @property
    def last(self) -> int:
        """Index of the latest of the `times`: the number of steps."""
        return len(self.records)

    @property
    def size(self) -> int:
        """Memory that the kept states take [bytes]."""
        return self._size

    def index_at(self, time: float) -> int:
        """Index of the latest of the `times` that is not after `time` [s], within rounding."""
        return max(0, bisect_right(self.times, time * (1.0 + 1e-12) + 1e-12) - 1)

    def is_due(self, index: int) -> bool:
        """True if the state before step `index` is to be kept."""
        return index % self._every == 0

    def keep(self, index: int, state: Any) -> None:
        """Keep the state before step `index`; kept states of the same or a later step are dropped."""
        while self._entries and self._entries[-1].index >= index:
            self._size -= self._entries.pop().size
        entry = Entry(index, state, len(self.inputs.get(index, ())), size_of(state))
        self._entries.append(entry)
        self._size += entry.size
        while self._size > self._room and len(self._entries) > 2:
            self._thin()

    def _thin(self) -> None:
        self._every *= 2
        self._entries = [entry for entry in self._entries if entry.index % self._every == 0]
        self._size = sum(entry.size for entry in self._entries)

    def before(self, index: int) -> Entry | None:
        """Kept state of the latest step up to `index`; None if no state is kept."""
        place = bisect_right(self._entries, index, key=lambda entry: entry.index)
        return self._entries[place - 1] if place else None

    def add(self, time: float, record: Any, events: int) -> None:
        """Add a step: the time after it [s], its record, and the number of events so far."""
        self.times.append(time)
        self.records.append(record)
        self.event_counts.append(events)

    def forget(self, index: int) -> None:
        """Remove everything after the time with this index; inputs at that time stay."""
        if index == self.last:
            return
        del self.times[index + 1 :], self.records[index:], self.event_counts[index + 1 :]
        self.inputs = {k: given for k, given in self.inputs.items() if k <= index}
        while self._entries[-1].index > index:
            self._size -= self._entries.pop().size


def size_of(thing: Any) -> int:
    """Approximate memory of the arrays in a state [bytes]."""
    if isinstance(thing, np.ndarray):
        return thing.nbytes
    if is_dataclass(thing) and not isinstance(thing, type):
        return sum(map(size_of, vars(thing).values()))
    if isinstance(thing, Mapping):
        return sum(map(size_of, thing.values()))
    if isinstance(thing, (list, tuple)):
        return sum(map(size_of, thing))
    return 32


class Samples:
    """Table of samples; each column of `UNITS` is an attribute, a read-only view of shape (n,) float64.

    Numbers that a subject does not know are NaN.

    Attributes
    ----------
    time : (n,) float64
        Simulated time [s].
    kinetic_energy, potential_energy, energy : (n,) float64
        Energies of all bodies together, and the sum of both [J].
    momentum : (n,) float64
        Length of the sum of all momenta [kg m/s].
    penetration, residual : (n,) float64
        Largest penetration [m] and residual [1] of the step; see `physics.StepReport`.
    error, angle : (n,) float64
        Largest distance between a body's centre of mass and the ghost's [m], and largest angle between their attitudes
        [rad].
    error_of_reference : (n,) float64
        Error of the ghost itself, if it is only an estimate [m].
    cost, cost_of_reference : (n,) float64
        Computing time per simulated second, smoothed [µs/s], of the subject and of the ghost.
    """

    def __init__(self):
        self._table, self._count = np.empty((FIRST_ROOM, len(UNITS))), 0

    def __len__(self) -> int:
        return self._count

    def __getattr__(self, name: str) -> np.ndarray:
        if name not in UNITS:
            raise AttributeError(f"Samples has no column {name!r}; allowed are {', '.join(UNITS)}")
        column = self._table[: self._count, list(UNITS).index(name)]
        column.flags.writeable = False
        return column

    def append(self, **values: float) -> None:
        """Add a sample by column names; missing columns are NaN."""
        if self._count == len(self._table):
            self._table = np.concatenate((self._table, np.empty_like(self._table)))
        self._table[self._count] = [values.get(name, np.nan) for name in UNITS]
        self._count += 1

    def truncate(self, count: int) -> None:
        """Keep only the first `count` samples."""
        self._count = min(self._count, count)
