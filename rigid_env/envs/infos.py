"""Make the info dict of a single environment's step."""

from __future__ import annotations

from typing import Any

from rigid_env.envs.contact_infos import ContactInfos, contact_infos
from rigid_env.tasks import Task
from rigid_env.tasks.layout import INFO, SUCCESS


class InfoMaker:
    """Maker of the info dict of a step, from a row of the task's outcomes and the step's status.

    It compiles a function that consists of a dict display with these names. `dict(zip(names, row))` would take three
    times as long, which is a twentieth of a step of one environment.

    Parameters
    ----------
    names : tuple of str
        Names of the numbers in the row from the column `INFO` on.
    """

    def __init__(self, names: tuple[str, ...]):
        self._names = names
        entries = [
            f"'is_success': row[{SUCCESS}] > 0.0",
            *(f"{name!r}: row[{k}]" for k, name in enumerate(names, INFO)),
        ]
        source = f"lambda row, status: {{{', '.join(entries)}, 'physics_status': status}}"
        self._make = eval(source)

    def __call__(self, row: list[float], status: int) -> dict[str, Any]:
        """Info dict for a row of outcomes and a `physics.Status`."""
        return self._make(row, status)

    def __reduce__(self):
        return InfoMaker, (self._names,)


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
    plain, reader = InfoMaker(task.info_names), contact_infos(task, contacts, impacts)
    return plain if reader is None else ContactInfoMaker(plain, reader)
