"""Entries of infos about contacts and impacts, for single environments and batches."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from physics import Contacts, Impacts, validation
from physics.world.touching import MOST_ROWS
from rigid_env.tasks import Task

CONTACT_KEYS = tuple(f"contact_{field}" for field in Contacts._fields)
"""Keys of infos for `physics.Contacts`, in the order of its fields."""

IMPACT_KEYS = tuple(f"impact_{field}" for field in Impacts._fields)
"""Keys of infos for `physics.Impacts`, in the order of its fields."""


class _Reader(NamedTuple):
    """Function that reads `rows` contacts or impacts of each world, and the keys of its arrays in infos."""

    keys: tuple[str, ...]
    read: Callable[..., tuple[np.ndarray, ...]]
    rows: int


class ContactInfos:
    """Reader of a task's contacts and impacts for infos.

    Parameters
    ----------
    task : Task
    contacts, impacts : int
        Rows of each world: contacts with the largest forces, and pairs that collided with the largest impulses. 0:
        none.

    Attributes
    ----------
    keys : tuple of str
        Keys of all entries.
    """

    def __init__(self, task: Task, contacts: int, impacts: int):
        world = task.world
        self._readers = []
        if contacts:
            self._readers.append(_Reader(CONTACT_KEYS, world.read_contacts, contacts))
        if impacts:
            world.keep_impacts()
            self._readers.append(_Reader(IMPACT_KEYS, world.read_impacts, impacts))
        self.keys = tuple(key for reader in self._readers for key in reader.keys)

    def all(self) -> dict[str, np.ndarray]:
        """Entries of infos with a row for each world."""
        return {
            key: values
            for reader in self._readers
            for key, values in zip(reader.keys, reader.read(rows=reader.rows), strict=True)
        }

    def one(self) -> dict[str, Any]:
        """Entries of the info of a batch of one world."""
        return {key: values[0].item() if values.ndim == 1 else values[0] for key, values in self.all().items()}


def contact_infos(task: Task, contacts: int, impacts: int) -> ContactInfos | None:
    """Make the reader for the environment's arguments `contacts` and `impacts`; None if both are 0.

    Raises
    ------
    ValueError
        One of them is no count, or the task has an info of the same key.
    """
    given = {"contacts": contacts, "impacts": impacts}
    rows = {name: validation.count(value, name, least=0, most=MOST_ROWS) for name, value in given.items()}
    for name, keys in (("contacts", CONTACT_KEYS), ("impacts", IMPACT_KEYS)):
        same = [key for key in (*task.info_names, *task.own_draws) if key in keys]
        if rows[name] and same:
            raise ValueError(
                f"{name} is {rows[name]}, but {type(task).__name__} has {same[0]!r} in its info; allowed are 0, and "
                f"tasks without {', '.join(keys)}"
            )
    return ContactInfos(task, **rows) if any(rows.values()) else None
