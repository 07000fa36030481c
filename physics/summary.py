"""Short texts of values and objects, for messages and `repr`."""

from __future__ import annotations

import reprlib
from collections import Counter
from collections.abc import Iterable
from dataclasses import fields
from typing import Protocol

import numpy as np

# Characters of a value in a message, and of a line of a `repr`: two lines and one line of a narrow terminal.
LONGEST_VALUE = 160
LINE = 80

# Characters that fit on a screen: ten lines.
SCREEN = 10 * LINE

# Numbers of an array that are shown.
MOST_NUMBERS = 12

# Integers of more bits than this are told by their length.
MOST_BITS = 128


class _Short(reprlib.Repr):
    """`repr` cut to a few items of each kind."""

    def __init__(self):
        super().__init__()
        self.maxlevel, self.maxdict, self.maxset, self.maxfrozenset, self.maxdeque = 4, 6, 6, 6, 6
        self.maxtuple = self.maxlist = self.maxarray = 8
        self.maxstring = self.maxother = LONGEST_VALUE

    def repr_int(self, x, level):
        """Digits, or the number of bits if Python would take long to print the digits."""
        return repr(x) if x.bit_length() <= MOST_BITS else f"an integer of {x.bit_length()} bits"

    def repr_float64(self, x, level):
        """Represent a NumPy float as Python's own."""
        return repr(float(x))

    def repr_ndarray(self, x, level):
        """Numbers of an array, or its shape if it has many."""
        if x.size > MOST_NUMBERS:
            return f"an array of shape {x.shape}"
        return repr(x.item()) if x.ndim == 0 else np.array2string(x, precision=6, separator=", ")


_SHORT = _Short()


def shown(value: object, longest: int = LONGEST_VALUE) -> str:
    """Value on one line of at most `longest` characters."""
    text = " ".join(_SHORT.repr(value).split())
    if len(text) <= longest:
        return text
    tail = longest // 4
    return f"{text[: longest - tail - 5]} ... {text[-tail:]}"


def fields_repr(item) -> str:
    """Standard `repr` of a dataclass, or one shortened field per line if that fills a screen."""
    parts = [(field.name, getattr(item, field.name)) for field in fields(item) if field.repr]
    name = type(item).__qualname__
    text = f"{name}({', '.join(f'{key}={value!r}' for key, value in parts)})"
    if len(text) <= SCREEN:
        return text
    lines = [f"    {key}={shown(value, LINE - len(key) - 6)}" for key, value in parts]
    return f"{name}(\n" + ",\n".join(lines) + ")"


class HasParts(Protocol):
    """Class whose `repr` is made of parts."""

    def _parts(self) -> tuple[str, ...]:
        """Parts of the `repr`: a name and its value, such as ``dt=0.01`` or ``events: none``, or any other words."""


def parts_repr(item: HasParts) -> str:
    """`repr` of an object from its parts, broken at full lines."""
    return lines_repr(type(item).__name__, *item._parts())


def lines_repr(name: str, *parts: str) -> str:
    """``name(part, ...)`` broken between parts, with parts cut to the width of the screen."""
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
    """Names with their counts, in order of first occurrence: ``30 Block, 20 Sphere``."""
    found = Counter(names)
    told = [name if times == 1 else f"{times} {name}" for name, times in list(found.items())[:most]]
    return ", ".join(told + ["..."] * (len(found) > most)) or "none"
