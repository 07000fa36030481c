"""Short HTML tables of objects, which notebooks show instead of a `repr`.

All HTML is made by `table`. A class gets its table by one line, ``_repr_html_ = parts_table`` or
``_repr_html_ = fields_table``.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from html import escape
from typing import Any

import numpy as np

from physics.summary import LONGEST_VALUE, SCREEN, HasParts, shown, shown_fields

LARGEST = 4096
"""Largest size of the HTML of a table [bytes of UTF-8]; further rows are left out."""

LONGEST_CELL = SCREEN // 2
"""Largest length of the text of a cell [characters]; longer texts are cut."""

_LEFT = 'style="text-align: left"'  # notebooks set cells to the right; colours are the notebook's own
_END = "</tbody></table>"
_MORE = f'<tr><td colspan="2" {_LEFT}>...</td></tr>'

# A part with a name and a value, as "dt=0.01", "t = 0 to 1 s" or "events: none".
_NAMED = re.compile(r"(\w[\w ]*?)(?: = |=|: )(.+)", re.DOTALL)


def table(title: str, rows: Iterable[tuple[str, str]]) -> str:
    """Make the HTML of a table with a title and two columns: names and values.

    Parameters
    ----------
    title : str
        Heading of the table.
    rows : iterable of (str, str)
        Name and value, as plain text: both are escaped here. A row without a name is one wide cell. Texts longer than
        `LONGEST_CELL` are cut. Rows beyond the size `LARGEST` are left out, with three dots in their place.

    Returns
    -------
    str
        A ``<table>`` element on one line, without colours, classes, scripts or links.
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
    """HTML table of an object with `_parts`: a row for each part, then the rows `more`, each a name and a value."""
    return table(type(item).__name__, (*map(_split, item._parts()), *more))


def fields_table(item: Any, omitted: tuple[str, ...] = ()) -> str:
    """HTML table of a dataclass object: a row for each field that its `repr` shows, without the fields `omitted`."""
    return table(type(item).__name__, ((name, _value(value)) for name, value in shown_fields(item, omitted)))


def _value(value: object) -> str:
    """`repr` of a field's value, shortened if it has more than `LONGEST_VALUE` characters or is an array."""
    text = shown(value) if isinstance(value, np.ndarray) else repr(value)
    return text if len(text) <= LONGEST_VALUE else shown(value)


def _split(part: str) -> tuple[str, str]:
    """Split a part such as ``dt=0.01`` or ``events: none`` into name and value; the name is "" where it has none."""
    found = _NAMED.fullmatch(part)
    return ("", part) if found is None else (found[1], found[2])


def _cell(text: str) -> str:
    """Text of a cell: cut to `LONGEST_CELL`, escaped, and without surrogates and control characters."""
    text = text if len(text) <= LONGEST_CELL else f"{text[: LONGEST_CELL - 4]} ..."
    text = "".join(char if char.isprintable() or char in "\n\t" else "\N{REPLACEMENT CHARACTER}" for char in text)
    return escape(text)


def _row(name: str, value: str) -> str:
    if not name:
        return f'<tr><td colspan="2" {_LEFT}>{value}</td></tr>'
    return f'<tr><th scope="row" {_LEFT}>{name}</th><td {_LEFT}>{value}</td></tr>'
