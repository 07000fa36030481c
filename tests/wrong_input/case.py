"""A row of the table, and how the table is put together.

A module of this package with `CASES` is a part of the table; the test finds it. One about things that run (worlds,
environments) also has `SUBJECTS`, from a name to the function that makes the thing and lets it run a little, and
`state_of`, from the thing to everything in it that decides how it goes on.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple


class Case(NamedTuple):
    """One wrong input.

    Attributes
    ----------
    id : str
        Name of the row, unique in its module.
    do : callable
        Gives the input: without arguments, or to the thing of `on`.
    words : tuple of str
        What the message must contain: the field, the value given, what is allowed.
    on : str or None
        Key of its module's `SUBJECTS`; None: it makes something new.
    raises : tuple of exception classes
        Allowed errors, themselves and not their subclasses.
    """

    id: str
    do: Callable[..., object]
    words: tuple[str, ...]
    on: str | None = None
    raises: tuple[type[Exception], ...] = (ValueError, TypeError)
