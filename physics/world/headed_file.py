"""Files of named arrays with a head, a JSON object that describes them: ``.npz`` files, which never run code."""

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
    """Look up and check a value in the head of a file.

    Parameters
    ----------
    head : dict
        Head as read from the file; other objects are refused.
    name : str
        Key of the value.
    is_right : callable
        Takes the value and returns whether it is valid; an exception counts as no.
    allowed : str
        Description of the valid values, for the error.

    Raises
    ------
    ValueError
        The head lacks the key, or its value is invalid. The message names key, value and `allowed`.
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
    """True if the value of a head is a text."""
    return isinstance(value, str)


def is_count(value: Any) -> bool:
    """True if the value of a head is an integer of at least 0."""
    return isinstance(value, int) and not isinstance(value, bool) and value >= 0


@dataclass(frozen=True)
class FileKind:
    """Kind of file with a head, such as a snapshot or a recording: it writes and reads files of this kind.

    Parameters
    ----------
    kind : str
        Name of the kind in the head.
    name : str
        Name of the kind in errors, such as ``snapshot``.
    writer : str
        Name of the method that writes such files, for errors.
    format : int
        Number of the format that is written. Files of a newer format are refused.
    oldest : int
        Number of the oldest format that is read.
    missing : str
        Contents that files of older formats lack, in words for errors.
    """

    kind: str
    name: str
    writer: str
    format: int = 1
    oldest: int = 1
    missing: str = ""

    def write(self, file: BinaryIO, head: Mapping[str, Any], parts: Mapping[str, np.ndarray]) -> None:
        """Write a head of JSON values, and the named arrays `parts`, into an open binary file."""
        head = {"kind": self.kind, "format": self.format, **head}
        np.savez_compressed(file, head=json.dumps(head), **parts)

    def read(
        self, content: BinaryIO, path: str | os.PathLike, make: Callable[[dict[str, Any], dict[str, np.ndarray]], T]
    ) -> T:
        """Read a file of this kind; return the object that `make` makes of its head and arrays.

        Parameters
        ----------
        content : open binary file
            File to read.
        path : str or Path
            Name of the file in an error.
        make : callable
            Takes the head and the dictionary of arrays and returns the object. Any exception of it means that the file
            is damaged.

        Raises
        ------
        ValueError
            The file is of another kind, damaged, or of a format that is not read.
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
        except Exception as error:  # any fault means that the file is not of this kind
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
