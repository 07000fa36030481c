"""Contacts in infos, of single environments and of batches."""

from __future__ import annotations

from typing import Any

import numpy as np

from physics import validation
from physics.schemes.contacts import Contacts
from physics.world.contacts import read_contacts
from rigid_env.tasks import Task

KEYS = tuple(f"contact_{field}" for field in Contacts._fields)
"""Keys of infos, in the order of the fields of `physics.schemes.contacts.Contacts`."""

MOST_ROWS = 65_536


class ContactInfos:
    """Reader of a task's contacts for infos.

    Parameters
    ----------
    task : Task
    rows : int
        Contacts of each world that there is room for: those with the largest forces.
    """

    def __init__(self, task: Task, rows: int):
        self._task, self._rows, self._indices = task, rows, np.arange(task.worlds)

    def all(self) -> dict[str, np.ndarray]:
        """Entries of infos with a row for each world."""
        return dict(zip(KEYS, read_contacts(self._task.world, self._indices, self._rows)))

    def one(self) -> dict[str, Any]:
        """Entries of the info of a batch of one world."""
        count, *rows = read_contacts(self._task.world, self._indices, self._rows)
        return dict(zip(KEYS, (count.item(), *(values[0] for values in rows))))


def contact_infos(task: Task, contacts: int) -> ContactInfos | None:
    """Make the reader for the environment's argument `contacts`; None where it is 0.

    Raises
    ------
    ValueError
        It is no count, or the task has an info of the same key.
    """
    rows = validation.count(contacts, "contacts", least=0, most=MOST_ROWS)
    if rows == 0:
        return None
    for name in (*task.info_names, *task.own_draws):
        if name in KEYS:
            raise ValueError(
                f"contacts is {rows}, but {type(task).__name__} has {name!r} in its info; allowed are 0, and tasks "
                f"without {', '.join(KEYS)}"
            )
    return ContactInfos(task, rows)
