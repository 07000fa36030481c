"""Files of arrays with a descriptive head: ``.npz`` files that run no code when they are read."""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, BinaryIO, TypeVar
from zipfile import is_zipfile

import numpy as np

from physics.summary import shown

T = TypeVar("T")


def head_value(head: Any, name: str, is_right: Callable[[Any], object], allowed: str) -> Any:
    """Value of a name in a head.

    Parameters
    ----------
    head : dict
    name : str
    is_right : callable
        Whether a value may be there; an exception means that it may not.
    allowed : str
        What may be there, for the error.

    Raises
    ------
    ValueError
        Naming the field, its value and what is allowed.
    """
    if not isinstance(head, dict) or name not in head:
        raise ValueError(f"its head has no {name}; allowed is {allowed}")
    value = head[name]
    try:
        if is_right(value):
            return value
    except Exception:  # of a value of another type
        pass
    raise ValueError(f"{name} of its head is {shown(value)}; allowed is {allowed}")


def is_text(value: Any) -> bool:
    """True for a text."""
    return isinstance(value, str)


def is_count(value: Any) -> bool:
    """True for an integer of at least 0."""
    return isinstance(value, int) and not isinstance(value, bool) and value >= 0


@dataclass(frozen=True)
class FileKind:
    """A kind of headed file.

    Parameters
    ----------
    kind : str
        Its name in the head.
    name : str
        Its name in errors, such as ``snapshot``.
    writer : str
        Name of the method that writes it, for errors.
    format : int
        Number of the format that is written; a newer one is refused.
    oldest : int
        Oldest format that is read.
    missing : str
        What an older one lacks, for errors.
    """

    kind: str
    name: str
    writer: str
    format: int = 1
    oldest: int = 1
    missing: str = ""

    def write(self, file: BinaryIO, head: Mapping[str, Any], parts: Mapping[str, np.ndarray]) -> None:
        """Write a JSON-able head and named arrays into an open file."""
        head = {"kind": self.kind, "format": self.format, **head}
        np.savez_compressed(file, head=json.dumps(head), **parts)

    def read(
        self, content: BinaryIO, path: str | os.PathLike, make: Callable[[dict[str, Any], dict[str, np.ndarray]], T]
    ) -> T:
        """Read the content of a file.

        Parameters
        ----------
        content : open binary file
        path : str or Path
            Its name in an error.
        make : callable
            Makes the thing of head and arrays; any exception means that the file is no such thing.

        Raises
        ------
        ValueError
            It is of another kind, damaged, or of a format that is not read.
        """
        if not is_zipfile(content):
            raise ValueError(f"{path} is no {self.name}; {self._allowed}")
        try:
            with np.load(content, allow_pickle=False) as file:
                parts = dict(file)
            head = json.loads(str(parts.pop("head")))
            kind = head_value(head, "kind", is_text, f"{self.kind!r}")
            if kind != self.kind:
                raise ValueError(f"it is a {kind}")
            number = head_value(head, "format", lambda value: is_count(value) and value, "an integer of at least 1")
            found = make(head, parts) if self.oldest <= number <= self.format else None
        except Exception as error:  # whatever is wrong with it, it is none
            told = f"there is no {error}" if isinstance(error, KeyError) else error
            raise ValueError(f"{path} is no {self.name} ({told}); {self._allowed}") from None
        if found is None:
            raise ValueError(f"{path} has format {number}{self._formats(number)}")
        return found

    @property
    def _allowed(self) -> str:
        return f"allowed is what {self.writer} writes (.npz)"

    def _formats(self, number: int) -> str:
        lacks = f", which does not hold {self.missing}" if number < self.oldest else ""
        if self.oldest == self.format > 1:
            return f"{lacks}; allowed is format {self.format}"
        since = "up to" if self.oldest == 1 else f"{self.oldest} to"
        return f"{lacks}; allowed are formats {since} {self.format}"
