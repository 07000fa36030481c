"""Make the info dict of a single environment's step."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache
from itertools import chain, pairwise
from typing import Any

import numpy as np

from rigid_env.envs.contact_infos import ContactInfos, contact_infos
from rigid_env.tasks import Task
from rigid_env.tasks.layout import INFO, SUCCESS

ROWS = 256
"""Number of copies of an array that are made at once."""


class InfoMaker:
    """Maker of the info dict of a step or a start, from its row of outcomes and its status; see `info_maker`.

    The drawn values stay the same from step to step: an info is a copy of a dict that holds them, and the other numbers
    are written into it. Gymnasium requires new arrays in each info. They are rows of tables with many copies, which
    take half the time of single copies.

    Parameters
    ----------
    task : Task
        Task of one world.
    """

    def __init__(self, task: Task):
        self.task, self.episodes = task, task.episodes
        self.changes = -1  # no drawn values have been copied yet
        self.pattern: dict[str, Any] = {}

    def __call__(self, row: list[float], status: int) -> dict[str, Any]:
        """Info dict of a step or a start, from its row of outcomes and its status."""
        raise NotImplementedError

    def tell(self) -> None:
        """Copy the drawn values of the running episode into the dict that infos are copied from."""
        self.changes = self.episodes.changes
        drawn = {name: self.task.drawn[name][0] for name in self.task.own_draws}
        keys = ("is_success", *self.task.info_names, "physics_status")
        told = {name: None if np.ndim(value) else float(value) for name, value in drawn.items()}
        self.pattern = {**dict.fromkeys(keys), **told}
        self.arrays = chain.from_iterable(_copies([drawn[name].copy() for name in arrays_of(self.task)])).__next__

    def __reduce__(self):
        return plain_maker, (self.task,)


def plain_maker(task: Task) -> InfoMaker:
    """Make the maker of infos without contacts."""
    return _compiled(task.info_names, arrays_of(task))(task)


def arrays_of(task: Task) -> tuple[str, ...]:
    """Names of the draws whose values are arrays of several numbers."""
    return tuple(name for name in task.own_draws if task.drawn[name].ndim > 1)


@cache
def _compiled(names: tuple[str, ...], arrays: tuple[str, ...]) -> type[InfoMaker]:
    """Class of makers whose call is compiled for these names: numbers of an outcome, and arrays of drawn values.

    A loop over the names would take three times as long. The difference is a twentieth of a step of one environment.
    """
    lines = [
        "if self.episodes.changes != self.changes:",
        "    self.tell()",
        "info = self.pattern.copy()",
        f"info['is_success'] = row[{SUCCESS}] > 0.0",
        *(f"info[{name!r}] = row[{k}]" for k, name in enumerate(names, INFO)),
        "info['physics_status'] = status",
    ]
    if arrays:
        lines.append("".join(f"info[{name!r}], " for name in arrays) + "= self.arrays()")
    found: dict[str, Any] = {}
    exec("\n    ".join(["def call(self, row, status):", *lines, "return info"]), found)
    return type("InfoMaker", (InfoMaker,), {"__call__": found["call"]})


def _copies(values: list[np.ndarray]) -> Iterator[Iterator[tuple[np.ndarray, ...]]]:
    """Yield blocks of tuples without end; each tuple has a new copy of every array."""
    row = np.concatenate(values)
    ends = np.cumsum([0, *map(len, values)]).tolist()
    while True:
        table = np.broadcast_to(row, (ROWS, len(row))).copy()
        yield zip(*(table[:, first:end] for first, end in pairwise(ends)))


class ContactInfoMaker:
    """Maker of an info dict that also contains contacts or impacts of the world.

    Parameters
    ----------
    plain : InfoMaker
    contacts : ContactInfos
    """

    def __init__(self, plain: InfoMaker, contacts: ContactInfos):
        self._plain, self._contacts = plain, contacts

    def __call__(self, row: list[float], status: int) -> dict[str, Any]:
        """Info dict for a row of outcomes and a `physics.Status`, with the present contacts and impacts."""
        return {**self._plain(row, status), **self._contacts.one()}


def info_maker(task: Task, contacts: int, impacts: int) -> InfoMaker | ContactInfoMaker:
    """Make the maker of infos for a task of one world; other arguments as of `contact_infos.contact_infos`."""
    plain, reader = plain_maker(task), contact_infos(task, contacts, impacts)
    return plain if reader is None else ContactInfoMaker(plain, reader)
