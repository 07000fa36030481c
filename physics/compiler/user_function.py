"""Examine a user's function before a step: results and errors of all compilers in one form."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

# Forms of a result: one of these words, a tuple of forms, or another word for anything else.
NUMBER, NONE, ARRAY = "a number", "None", "an array"


class Examined(NamedTuple):
    """Result of an examination.

    Attributes
    ----------
    returned : str or tuple
        Form of the result.
    line : tuple of (str, int) or None
        File and line of the only statement that returns.
    may_raise : bool
        Whether a call may raise an exception.
    """

    returned: str | tuple
    line: tuple[str, int] | None
    may_raise: bool


class FaultyFunctionError(Exception):
    """Error about a function that reads or changes something forbidden.

    Parameters
    ----------
    what : str
        After the name of the function.
    function : Callable
        A kernel.
    line : tuple of (str, int) or None
        File and line.
    """

    def __init__(self, what: str, function: Callable, line: tuple[str, int] | None):
        super().__init__(what)
        self.what, self.function, self.line = what, function, line


def entries(size: int) -> str:
    """Number of p's entries, in words."""
    return f"p[0] to p[{size - 1}]" if size > 1 else "p[0]" if size else "none"


def in_words(form: str | tuple) -> str:
    """Form of a value, in words."""
    if isinstance(form, str):
        return form
    if form and all(each == NUMBER for each in form):
        return f"a tuple of {len(form)} numbers"
    return f"({', '.join(map(in_words, form))})"


def form_of(value) -> str | tuple:
    """Form of a value returned by a function."""
    if isinstance(value, tuple):
        return tuple(map(form_of, value))
    if value is None:
        return NONE
    if hasattr(value, "shape") and value.shape != ():
        return ARRAY
    try:
        float(value)
    except (TypeError, ValueError):
        return f"a {type(value).__name__}"
    return NUMBER


def probe(function: Callable, called: Callable, arguments: tuple, numbers: str) -> str | tuple | None:
    """Call a function once and return the form of its result, or None if it raised an exception of its own.

    Parameters
    ----------
    function : Callable
        A kernel.
    called : Callable
        The same, to be called.
    arguments : tuple
        State, read-only numbers p, and time.
    numbers : str
        The numbers in p, in words.

    Raises
    ------
    FaultyFunctionError
        It reads beyond the end of p, or writes to p.
    """
    try:
        return form_of(called(*arguments))
    except IndexError:
        raise FaultyFunctionError(
            f"reads beyond the end of p; allowed is {entries(len(arguments[1]))}: {numbers}", function, None
        ) from None
    except (ArithmeticError, AssertionError, RuntimeError):
        return None
    except ValueError as error:
        if "read-only" in str(error):
            raise FaultyFunctionError("writes to p; allowed is to read it", function, None) from None
        return None
