"""Short HTML tables of objects, which notebooks show instead of a `repr`.

`table` makes the HTML, and nothing else does. A class takes part by one line, ``_repr_html_ = parts_table`` or
``_repr_html_ = fields_table``.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import fields
from html import escape
from typing import Any

import numpy as np

from physics.summary import LONGEST_VALUE, SCREEN, HasParts, shown

LARGEST = 4096
"""Largest size of a table [bytes of UTF-8]."""

LONGEST_CELL = SCREEN // 2
"""Largest length of a text [characters]; longer ones are cut."""

_LEFT = 'style="text-align: left"'  # notebooks set cells to the right; colours are the notebook's own
_END = "</tbody></table>"
_MORE = f'<tr><td colspan="2" {_LEFT}>...</td></tr>'

# "dt=0.01", "t = 0 to 1 s", "events: none": a name, and what it is
_NAMED = re.compile(r"(\w[\w ]*?)(?: = |=|: )(.+)", re.DOTALL)


def table(title: str, rows: Iterable[tuple[str, str]]) -> str:
    """HTML of a table with a title and two columns: names and values.

    Parameters
    ----------
    title : str
    rows : iterable of (str, str)
        Name and value, as text: both are escaped. A row without a name is one wide cell. Long values are cut, and rows
        that no longer fit into `LARGEST` left out, with three dots in their place.

    Returns
    -------
    str
        One element, on one line. It has no colours, classes or scripts, and loads nothing.
    """
    lines = [f'<table><thead><tr><th colspan="2" {_LEFT}>{_cell(title)}</th></tr></thead><tbody>']
    room = LARGEST - len(lines[0].encode()) - len(_MORE) - len(_END)
    for name, value in rows:
        line = _row(_cell(name), _cell(value))
        room -= len(line.encode())
        if room < 0:
            lines.append(_MORE)
            break
        lines.append(line)
    return "".join((*lines, _END))


def parts_table(item: HasParts, *more: tuple[str, str]) -> str:
    """Table of an object whose `repr` is made of parts: a row for each part, and further rows below."""
    return table(type(item).__name__, (*map(_split, item._parts()), *more))


def fields_table(item: Any) -> str:
    """Table of a dataclass with a row for each field."""
    values = ((field.name, getattr(item, field.name)) for field in fields(item) if field.repr)
    return table(type(item).__name__, ((name, _value(value)) for name, value in values))


def _value(value: object) -> str:
    """Value as in a `repr`, shortened if it is long."""
    text = shown(value) if isinstance(value, np.ndarray) else repr(value)
    return text if len(text) <= LONGEST_VALUE else shown(value)


def _split(part: str) -> tuple[str, str]:
    """Name and value of a part; no name if it has none."""
    found = _NAMED.fullmatch(part)
    return ("", part) if found is None else (found[1], found[2])


def _cell(text: str) -> str:
    """Text of a cell: cut, escaped, and without characters that browsers refuse (surrogates, control characters)."""
    text = text if len(text) <= LONGEST_CELL else f"{text[: LONGEST_CELL - 4]} ..."
    text = "".join(char if char.isprintable() or char in "\n\t" else "\N{REPLACEMENT CHARACTER}" for char in text)
    return escape(text)


def _row(name: str, value: str) -> str:
    if not name:
        return f'<tr><td colspan="2" {_LEFT}>{value}</td></tr>'
    return f'<tr><th scope="row" {_LEFT}>{name}</th><td {_LEFT}>{value}</td></tr>'
