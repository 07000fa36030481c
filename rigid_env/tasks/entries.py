"""Entries of an observation: their names, units, bounds, and the function that reads them."""

from __future__ import annotations

import numbers
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np


@dataclass(frozen=True)
class Entry:
    """One or several numbers of an observation, which one function reads.

    Parameters
    ----------
    name : str or sequence of str
        Name of the number, or of each number.
    unit : str
        Unit of the numbers, such as ``m/s``.
    low, high : float
        Bounds, in units of `scale` times `unit`; numbers outside are clipped to them.
    read : callable, optional
        Function from `Worlds` to the numbers, (n,) or (n, numbers), in `unit`. None: the task has a compiled function
        that writes the observation.
    scale : float
        Number that the observation is divided by: with 5 and ``m`` an observation of 1 means 5 m.

    Raises
    ------
    ValueError
        No name, the same name twice, `low` not below `high`, or a scale that is not positive.
    """

    name: str | tuple[str, ...]
    unit: str
    low: float
    high: float
    read: Callable | None = None
    scale: float = 1.0

    def __post_init__(self):
        if not isinstance(self.name, str):
            object.__setattr__(self, "name", tuple(self.name) if isinstance(self.name, Iterable) else ())
        names = self.names
        if not names or not all(isinstance(name, str) and name for name in names):
            raise ValueError(f"name of an Entry is {self.name!r}; allowed are a text and several of them")
        refuse_twice(names)
        for field in ("low", "high", "scale"):
            value = getattr(self, field)
            if isinstance(value, bool) or not isinstance(value, numbers.Real) or value != value:
                raise ValueError(f"{field} of entry {names[0]!r} is {value!r}; allowed is a number")
        if not self.low < self.high:
            raise ValueError(
                f"entry {names[0]!r} has low {self.low:g} and high {self.high:g}; allowed is low below high"
            )
        if not 0.0 < self.scale < np.inf:
            raise ValueError(f"scale of entry {names[0]!r} is {self.scale:g}; allowed are finite numbers above 0")
        if self.read is not None and not callable(self.read):
            raise ValueError(f"read of entry {names[0]!r} is {self.read!r}; allowed is a function of Worlds")

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the entry's numbers, one for each."""
        return (self.name,) if isinstance(self.name, str) else self.name

    @property
    def told_unit(self) -> str:
        """Unit with its scale for tables, such as "5 m"."""
        return self.unit if self.scale == 1.0 else f"{self.scale:g} {self.unit}".removesuffix(" 1")


def refuse_twice(names: Sequence[str]) -> None:
    """Raise a ValueError if a name occurs twice in `names`."""
    twice = sorted({name for name in names if list(names).count(name) > 1})
    if twice:
        raise ValueError(f"observation has two entries of the name {twice[0]!r}; allowed are different names")


Entries = Sequence[Entry] | Mapping[str, Sequence[Entry]]
"""Type of a task's observation: entries, or those that each agent sees."""


def _checked(entries) -> tuple[Entry, ...]:
    """Entries of a list, or one."""
    if isinstance(entries, Entry):
        return (entries,)
    if not isinstance(entries, (list, tuple)):
        raise ValueError(f"observation is {entries!r}; allowed is a list of Entry, or a dict of such by agent")
    for entry in entries:
        if not isinstance(entry, Entry):
            raise ValueError(f"observation holds {entry!r}; allowed are Entry and the functions of rigid_env.observe")
    return tuple(entries)


class Observation:
    """All entries of a task's observation, in the order of their numbers.

    Parameters
    ----------
    entries : sequence of Entry, or mapping of str to such
        A mapping has the entries that each agent sees; one that several agents see is one object in their lists.

    Attributes
    ----------
    size : int
        Numbers in an observation.
    views : dict of str to (k,) int64
        For an observation by agents: indices of the numbers that each agent sees, in the order of its list.
    low, high : (size,) float32
        Bounds of each number.
    scales : (size,) float64
        `Entry.scale` of each number.

    Raises
    ------
    ValueError
        An object that is no `Entry`, or two entries of one name.
    """

    def __init__(self, entries: Entries):
        parts = entries if isinstance(entries, Mapping) else {None: entries}
        lists = {agent: _checked(part) for agent, part in parts.items()}
        self.entries = tuple(dict.fromkeys(entry for part in lists.values() for entry in part))
        refuse_twice(self.names)
        for part in lists.values():
            refuse_twice([name for entry in part for name in entry.names])
        self.size = sum(len(entry.names) for entry in self.entries)
        spread = [len(entry.names) for entry in self.entries]
        self.low, self.high = (
            np.repeat(np.array([getattr(entry, end) for entry in self.entries], dtype=np.float32), spread)
            for end in ("low", "high")
        )
        ends = np.cumsum([0, *spread]).tolist()
        self._places = [slice(first, end) for first, end in pairwise(ends)]
        where = {entry: range(place.start, place.stop) for entry, place in zip(self.entries, self._places)}
        self.views = {
            agent: np.array([k for entry in part for k in where[entry]], dtype=np.int64)
            for agent, part in lists.items()
            if agent is not None
        }
        self.scales = np.repeat([entry.scale for entry in self.entries], spread)
        self._factors = np.repeat([1.0 / entry.scale for entry in self.entries], spread)
        self._targets: tuple[np.ndarray, list] = np.empty((0, self.size)), []

    def read(self, worlds, out: np.ndarray) -> np.ndarray:
        """Read the numbers of all entries from `worlds`; write them scaled and clipped into `out` (n, size) float32.

        Returns
        -------
        (n, size) float64
            Numbers before scaling and clipping, so that the caller can see infinite ones. The next call overwrites
            them.
        """
        table, targets = self._targets
        if len(table) != len(out):
            table, targets = self._make_targets(len(out))
            if len(out) > len(self._targets[0]):  # the largest table, which every step needs, is kept
                self._targets = table, targets
        for entry, columns, column in targets:
            values = entry.read(worlds)
            if type(values) is not np.ndarray or values.shape not in (columns.shape, column.shape):
                raise self._misfit(entry, values, columns.shape)
            (columns if values.ndim == 2 else column)[...] = values
        np.multiply(table, self._factors, out=out, casting="same_kind")
        np.maximum(out, self.low, out=out)
        np.minimum(out, self.high, out=out)
        return table

    @property
    def names(self) -> list[str]:
        """Names of the numbers of the whole observation, one for each."""
        return [name for entry in self.entries for name in entry.names]

    def _make_targets(self, count: int) -> tuple[np.ndarray, list]:
        """Make a table (count, size) for the numbers of all entries.

        Returns the table, and for each entry the view of it that the entry's numbers go into, as (n, numbers) and, if
        it has one number, as (n,).
        """
        table = np.empty((count, self.size))
        return table, [
            (entry, table[:, place], table[:, place.start] if len(entry.names) == 1 else table[:, place])
            for entry, place in zip(self.entries, self._places)
        ]

    @staticmethod
    def _misfit(entry: Entry, values, shape: tuple[int, int]) -> ValueError:
        given = f"shape {np.shape(values)}" if isinstance(values, np.ndarray) else repr(values)
        allowed = f"shape {shape}" if shape[1] > 1 else f"shape ({shape[0]},), one number for each world"
        return ValueError(f"read of entry {entry.names[0]!r} gave {given}; allowed is {allowed}")
