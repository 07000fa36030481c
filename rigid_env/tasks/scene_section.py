"""Keys of the table [environment] of a scene file, or arguments of the same names; errors tell file and line."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import Any, TypeVar

import physics
from physics.io.scene_places import Places
from physics.keywords import nearest_first
from physics.scene.body_names import body_index
from physics.summary import shown

T = TypeVar("T")


class Section:
    """Table of a scene file or a dict of arguments, whose values are checked when they are read.

    Parameters
    ----------
    values : mapping
        Values by key.
    name : str
        In errors, such as ``environment.goal`` of a file or ``goal`` of arguments; "": nothing stands in front.
    places : Places, optional
        In the scene that has the table. None: arguments.
    """

    def __init__(self, values: Mapping[str, Any], name: str = "", places: Places | None = None):
        self.values, self.name, self._places = values, name, places

    def __contains__(self, key: str) -> bool:
        return key in self.values

    def error(self, key: str | None, message: str) -> ValueError:
        """Make an error about a key, or about the table if it is None; the message names file and line."""
        if self._places is not None:
            return self._places.error_in_table(self.name, key, message)
        return ValueError(f"{self.name}: {message}" if self.name else message)

    def require_known(self, allowed: Iterable[str]) -> None:
        """Raise an error if the table has a key that is not in `allowed`; it lists the nearest names first."""
        for key in self.values:
            if key not in allowed:
                raise self.error(key, f"{key} is not known; allowed are {', '.join(nearest_first(key, allowed))}")

    def read(self, key: str, check: Callable[[Any, str], T]) -> T:
        """Value of an existing key, as ``check(value, key)`` returns it; an error of `check` gets file and line."""
        try:
            return check(self.values[key], key)
        except ValueError as error:
            raise self.error(key, str(error)) from None

    def require(self, key: str, check: Callable[[Any, str], T], needed: str) -> T:
        """Value of a required key, checked as by `read`; the error for a missing key says what is `needed`."""
        if key not in self.values:
            raise self.error(None, f"{key} is missing; allowed is {needed}")
        return self.read(key, check)

    def part(self, key: str, allowed: Iterable[str]) -> Section:
        """Table under a key of this table. Raises if the value is no table, or has keys that are not in `allowed`."""
        name = f"{self.name}.{key}" if self.name else key
        values = self.values[key]
        if not isinstance(values, Mapping):
            what = f"a table [{name}]" if self._places is not None else "a dict"
            raise self.error(key, f"{key} is {shown(values)}; allowed is {what} with keys of {', '.join(allowed)}")
        part = Section(values, name, self._places)
        part.require_known(allowed)
        return part


def body_indices(value, field: str, scene: physics.Scene) -> tuple[int, ...]:
    """Indices of bodies, each once, from names and indices or a single one; `field` names the value in an error."""
    given = list(value) if isinstance(value, (list, tuple)) else [value]
    if not given:
        raise ValueError(f"{field} is {shown(value)}; allowed is at least one body")
    found = [body_index(body, field, scene, "holds") for body in given]
    for k, body in enumerate(found):
        if body in found[:k]:
            raise ValueError(f"{field} holds body {body} twice; allowed is each body once")
    return tuple(found)
