"""Short texts of values and objects, for messages and `repr`."""

from __future__ import annotations

import reprlib
from collections import Counter
from collections.abc import Iterable
from dataclasses import fields
from typing import Any, Protocol

import numpy as np

# Most characters of a value in a message: two lines of a narrow terminal. Most characters of a line of a `repr`.
LONGEST_VALUE = 160
LINE = 80

# Metadata of a dataclass field that `fields_repr` leaves out at its default: one that few objects need.
SHOWN_IF_GIVEN = {"shown if given": True}

# Characters that fit on a screen: ten lines.
SCREEN = 10 * LINE

# An array with at most so many numbers is shown with its numbers, a larger one by its shape.
MOST_NUMBERS = 12

# An integer with more bits than this is shown by its number of bits.
MOST_BITS = 128


class _Short(reprlib.Repr):
    """Shortened `repr`: a few items of each container, long texts cut, large arrays and integers by their size."""

    def __init__(self):
        super().__init__()
        self.maxlevel, self.maxdict, self.maxset, self.maxfrozenset, self.maxdeque = 4, 6, 6, 6, 6
        self.maxtuple = self.maxlist = self.maxarray = 8
        self.maxstring = self.maxother = LONGEST_VALUE

    def repr_int(self, x, level):
        """Digits of an integer, or its number of bits if there are more than `MOST_BITS`: printing takes long then."""
        return repr(x) if x.bit_length() <= MOST_BITS else f"an integer of {x.bit_length()} bits"

    def repr_float64(self, x, level):
        """Represent a NumPy float like a Python float."""
        return repr(float(x))

    def repr_ndarray(self, x, level):
        """Numbers of an array, or its shape if it has more than `MOST_NUMBERS`."""
        if x.size > MOST_NUMBERS:
            return f"an array of shape {x.shape}"
        return repr(x.item()) if x.ndim == 0 else np.array2string(x, precision=6, separator=", ")


_SHORT = _Short()


def shown(value: object, longest: int = LONGEST_VALUE) -> str:
    """Short `repr` of a value on one line; its middle is left out if it has more than `longest` characters."""
    text = " ".join(_SHORT.repr(value).split())
    if len(text) <= longest:
        return text
    tail = longest // 4
    return f"{text[: longest - tail - 5]} ... {text[-tail:]}"


def shown_fields(item: Any, omitted: tuple[str, ...] = ()) -> list[tuple[str, Any]]:
    """Names and values of the fields of a dataclass object that its `repr` shows, without the fields `omitted`.

    A field with the metadata `SHOWN_IF_GIVEN` is left out while it has its default.
    """
    return [
        (field.name, value)
        for field in fields(item)
        if field.repr
        and field.name not in omitted
        and ((value := getattr(item, field.name)) is not field.default or field.metadata != SHOWN_IF_GIVEN)
    ]


def fields_repr(item, omitted: tuple[str, ...] = ()) -> str:
    """Standard `repr` of a dataclass object; if longer than `SCREEN`, one line per field with a shortened value.

    The fields `omitted` are left out.
    """
    parts = shown_fields(item, omitted)
    name = type(item).__qualname__
    text = f"{name}({', '.join(f'{key}={value!r}' for key, value in parts)})"
    if len(text) <= SCREEN:
        return text
    lines = [f"    {key}={shown(value, LINE - len(key) - 6)}" for key, value in parts]
    return f"{name}(\n" + ",\n".join(lines) + ")"


class HasParts(Protocol):
    """Protocol of objects that list their parts, from which `parts_repr` and `html_table.parts_table` are made."""

    def _parts(self) -> tuple[str, ...]:
        """Parts to show: texts such as ``dt=0.01`` or ``events: none``, each a name with its value, or other words."""


def parts_repr(item: HasParts) -> str:
    """`repr` of an object: its class and its parts, broken into lines of at most `LINE` characters."""
    return lines_repr(type(item).__name__, *item._parts())


def lines_repr(name: str, *parts: str) -> str:
    """Text ``name(part, ...)``, broken between parts into lines of at most `LINE` characters; longer parts are cut."""
    lines, indent = [f"{name}("], " " * (len(name) + 1)
    for k, part in enumerate(parts):
        end = ")" if k == len(parts) - 1 else ","
        room = LINE - len(indent) - 1
        part = (part if len(part) <= room else f"{part[: room - 4]} ...") + end
        if k == 0:
            lines[-1] += part
        elif len(lines[-1]) + 1 + len(part) <= LINE:
            lines[-1] += f" {part}"
        else:
            lines.append(indent + part)
    return "\n".join(lines)


def counted(names: Iterable[str], most: int = 8) -> str:
    """Count equal names, in order of first occurrence, as in ``30 Block, 20 Sphere``; at most `most` different ones."""
    found = Counter(names)
    told = [name if times == 1 else f"{times} {name}" for name, times in list(found.items())[:most]]
    return ", ".join(told + ["..."] * (len(found) > most)) or "none"
