"""Errors of the functions of a user's force field: messages name the class, the function, the line, and what to do."""

from __future__ import annotations

import linecache
import re
import traceback
from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path
from typing import NamedTuple

from physics.compiler.decorators import plain_function
from physics.kernels.forces.force_field_state import FieldState
from physics.scene.field_digest import called

NUMBA = str(Path(find_spec("numba").origin).parent)

ALLOWED = (
    "allowed are numbers, tuples of them, their functions of `math`, and functions under @physics.field_function; "
    "arrays, lists and other objects cannot be made"
)

# Numba's messages name the place of each statement concerned as "at FILE (LINE)", the innermost first.
_PLACE = re.compile(r"\b(?:at|from) (\S.*?) \((\d+)\)")

# Patterns of Numba's messages, and the words in which a user reads each. `%s` and `%r` take the groups of the match.
_KNOWN = (
    (r"Unknown attribute '(\w+)' of type FieldState", "state has no %r; allowed are " + ", ".join(FieldState._fields)),
    (r"'FieldState' object has no attribute '(\w+)'", "state has no %r; allowed are " + ", ".join(FieldState._fields)),
    (
        r"Untyped \D*? name '(\w+)': Cannot determine Numba type of <class 'function'>",
        "%s is not compiled; allowed are functions under @physics.field_function",
    ),
    (r"Untyped \D*? name '(\w+)': Cannot determine Numba type of <class '([\w.]+)'>", f"%s is a %s; {ALLOWED}"),
    (r"type, assigned to variable '(\w+)' in globals, is not supported", f"%s is of another kind; {ALLOWED}"),
    (
        r"No implementation of function (?:Memoised)?Function\(<.*?>\) found for signature:\s*>>> (.*)",
        f"there is no %s; {ALLOWED}",
    ),
    (
        r"use of yield in a closure()",
        "comprehensions and generators%s are not compiled; write each number out",
    ),
    (r"NRT required but not enabled()", f"it makes an object in memory%s; {ALLOWED}"),
    (r"Cannot unify (.*?) and (.*?) for", "a value is %s on one way, %s on another; allowed is one type"),
    (r"Can't unify return type from the following types: (.*)", "it returns values of the types %s; allowed is one"),
)


class Place(NamedTuple):
    """Line of a user's file, and the name of the function that it is in; its `str` is like a line of a traceback."""

    file: str
    line: int
    function: str

    def __str__(self):
        source = linecache.getline(self.file, self.line).strip()
        shown = f"\n    {source}" if source else ""
        return f'  File "{self.file}", line {self.line}, in {self.function}{shown}'


def at(function: Callable, line: tuple[str, int] | None = None) -> Place:
    """Place of a statement of a function, given by file and line; by default the first line of the function."""
    plain = plain_function(function)
    return Place(*(line or (plain.__code__.co_filename, plain.__code__.co_firstlineno)), plain.__name__)


def placed(what: str, place: Place) -> str:
    """Append a place in a user's file to the message `what`, on lines of its own."""
    return f"{what}\n{place}"


def not_compiled(name: str, function: Callable, error: Exception) -> ValueError:
    """Make the error for a user's function that Numba cannot compile; its message names the statement.

    Parameters
    ----------
    name : str
        Name of the function for the message, ``Class.function``.
    function : kernel
        The function itself.
    error : Exception
        Exception that Numba raised.
    """
    return ValueError(placed(f"{name} cannot be compiled: {_reason(str(error))}", _place(function, error)))


def _reason(text: str) -> str:
    for pattern, words in _KNOWN:
        found = re.search(pattern, text)
        if found:
            return words % found.groups()
    lines = [line.strip() for line in text.splitlines() if line.strip()]
    lines = [line for line in lines if not line.startswith(("Failed in ", "During: ", "File "))]
    return lines[0].split(". Raised from ")[0] if lines else text


def _place(function: Callable, error: Exception) -> Place:
    loc = getattr(error, "loc", None)
    outermost = [] if loc is None else [(loc.filename, loc.line)]
    for file, line in (*_PLACE.findall(str(error)), *outermost):
        if not file.startswith(NUMBA):
            return Place(file, int(line), _name_at(function, file, int(line)))
    return at(function)


def _name_at(function: Callable, file: str, line: int) -> str:
    around = [plain_function(each).__name__ for each in called(function) if _holds(each, file, line)]
    return around[0] if around else plain_function(function).__name__


def _holds(function: Callable, file: str, line: int) -> bool:
    code = plain_function(function).__code__
    lines = [each for _, _, each in code.co_lines() if each is not None]
    return code.co_filename == file and code.co_firstlineno <= line <= max(lines, default=-1)


def raised(error: Exception, slots: tuple) -> Exception:
    """Reword an IndexError that a user's compiled function raised in a step; return other exceptions unchanged.

    Parameters
    ----------
    error : Exception
        Exception whose traceback ends in the user's function.
    slots : tuple of physics.scene.force_field.FieldSlot
        The fields of the scene, among which the function is searched.

    Returns
    -------
    Exception
        IndexError that names the class of the field and the line, with `error` as its cause.
    """
    if not isinstance(error, IndexError):
        return error
    last = traceback.extract_tb(error.__traceback__)[-1]
    ours = [(slot, [slot.term.function, slot.term.energy]) for slot in slots if slot.is_users]
    names = [slot.kind.__name__ for slot, _ in ours]
    exact = [
        slot.kind.__name__
        for slot, functions in ours
        if any(_holds(each, last.filename, last.lineno) for one in functions if one for each in called(one))
    ]
    message = f"{error} in a function of {' or '.join(exact or names)}; nothing has changed"
    told = IndexError(placed(message, Place(last.filename, last.lineno, last.name)))
    told.__cause__ = error
    return told
