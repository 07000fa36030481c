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
"""Copies of an array that are made at once."""


class InfoMaker:
    """Maker of the info dict of a step or a start, from the row of an outcome and the status; see `info_maker`.

    The drawn values stay the same from step to step: an info is a copy of a dict that holds them, and the other numbers
    are written into it. Arrays are new in each info, as Gymnasium wants them: rows of tables with many copies, which
    take half the time of copies one by one.

    Parameters
    ----------
    task : Task
        Of one world.
    """

    def __init__(self, task: Task):
        self.task, self.episodes = task, task.episodes
        self.changes = -1  # nothing is told yet
        self.pattern: dict[str, Any] = {}

    def __call__(self, row: list[float], status: int) -> dict[str, Any]:
        """Info of an outcome."""
        raise NotImplementedError

    def tell(self) -> None:
        """Take over the drawn values."""
        self.changes = self.episodes.changes
        drawn = {name: self.task.drawn[name][0] for name in self.task.own_draws}
        keys = ("is_success", *self.task.info_names, "physics_status")
        told = {name: None if np.ndim(value) else float(value) for name, value in drawn.items()}
        self.pattern = {**dict.fromkeys(keys), **told}
        self.arrays = chain.from_iterable(_copies([drawn[name].copy() for name in arrays_of(self.task)])).__next__

    def __reduce__(self):
        return plain_maker, (self.task,)


def plain_maker(task: Task) -> InfoMaker:
    """Maker of infos without contacts."""
    return _compiled(task.info_names, arrays_of(task))(task)


def arrays_of(task: Task) -> tuple[str, ...]:
    """Names of draws of several numbers."""
    return tuple(name for name in task.own_draws if task.drawn[name].ndim > 1)


@cache
def _compiled(names: tuple[str, ...], arrays: tuple[str, ...]) -> type[InfoMaker]:
    """Class of makers with a call compiled for these names, of numbers of an outcome and of drawn arrays.

    A loop over the names would take three times as long, a twentieth of a step of one environment.
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
    """Copies of arrays without end: blocks of tuples."""
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
    """Maker of the infos of a task of one world; other arguments as of `contact_infos.contact_infos`."""
    plain, reader = plain_maker(task), contact_infos(task, contacts, impacts)
    return plain if reader is None else ContactInfoMaker(plain, reader)
