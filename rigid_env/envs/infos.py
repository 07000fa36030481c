"""Infos of one environment."""

from __future__ import annotations

from typing import Any

import numpy as np

from rigid_env.envs.contact_infos import ContactInfos, contact_infos
from rigid_env.tasks import Task
from rigid_env.tasks.layout import INFO, SUCCESS


class InfoMaker:
    """Maker of the info dict of a step or a start, from the row of an outcome and the status.

    The drawn values stay the same from step to step. An info is a copy of a dict that holds them, with the other
    numbers written into it by a function compiled for their names: `dict(zip(names, row))` alone would take a twentieth
    of a step of one environment.

    Parameters
    ----------
    task : Task
        Of one world.
    """

    def __init__(self, task: Task):
        self._task, self._episodes = task, task.episodes
        self._told: Any = ()  # no values yet
        self._pattern: dict[str, Any] = {}
        lines = [
            "info = pattern.copy()",
            f"info['is_success'] = row[{SUCCESS}] > 0.0",
            *(f"info[{name!r}] = row[{k}]" for k, name in enumerate(task.info_names, INFO)),
            "info['physics_status'] = status",
            "return info",
        ]
        names: dict[str, Any] = {}
        exec("\n    ".join(["def fill(pattern, row, status):", *lines]), names)
        self._fill = names["fill"]

    def __call__(self, row: list[float], status: int) -> dict[str, Any]:
        """Info of an outcome."""
        if self._episodes.told is not self._told:
            self._tell()
        return self._fill(self._pattern, row, status)

    def _tell(self) -> None:
        """Take over the drawn values: numbers, and read-only arrays, which all infos share until a value changes."""
        self._told = self._episodes.tell()
        keys = ("is_success", *self._task.info_names, "physics_status")
        drawn = {name: self._told[name][0] for name in self._task.own_draws}
        told = {name: float(value) if np.ndim(value) == 0 else value for name, value in drawn.items()}
        self._pattern = {**dict.fromkeys(keys), **told}

    def __reduce__(self):
        return InfoMaker, (self._task,)


class ContactInfoMaker:
    """Maker of an info dict that also holds contacts or impacts of the world.

    Parameters
    ----------
    plain : InfoMaker
    contacts : ContactInfos
    """

    def __init__(self, plain: InfoMaker, contacts: ContactInfos):
        self._plain, self._contacts = plain, contacts

    def __call__(self, row: list[float], status: int) -> dict[str, Any]:
        """Info of an outcome, and of the contacts now."""
        return {**self._plain(row, status), **self._contacts.one()}


def info_maker(task: Task, contacts: int, impacts: int) -> InfoMaker | ContactInfoMaker:
    """Maker of the infos of a task of one world; other arguments as of `contact_infos.contact_infos`."""
    plain, reader = InfoMaker(task), contact_infos(task, contacts, impacts)
    return plain if reader is None else ContactInfoMaker(plain, reader)
