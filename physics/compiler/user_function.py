"""Results and errors of the examination of a user's function before a step, in one form for all compilers."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

# Form of a value: one of these texts, a tuple of the forms of its members, or another text that describes it.
NUMBER, NONE, ARRAY = "a number", "None", "an array"


class Examined(NamedTuple):
    """Result of the examination of a user's function.

    Attributes
    ----------
    returned : str or tuple
        Form of the value that the function returns.
    line : tuple of (str, int) or None
        File and line of its ``return`` statement; None if there are several, or if it is unknown.
    may_raise : bool
        Whether a call may raise an exception.
    """

    returned: str | tuple
    line: tuple[str, int] | None
    may_raise: bool


class FaultyFunctionError(Exception):
    """Error about a user's function that reads or changes memory that it must not use.

    Parameters
    ----------
    what : str
        Message, which follows the name of the function.
    function : Callable
        The function, a kernel.
    line : tuple of (str, int) or None
        File and line of the statement; None: unknown.
    """

    def __init__(self, what: str, function: Callable, line: tuple[str, int] | None):
        super().__init__(what)
        self.what, self.function, self.line = what, function, line


def entries(size: int) -> str:
    """Entries of an array p of length `size`, in words for messages: "p[0] to p[2]"."""
    return f"p[0] to p[{size - 1}]" if size > 1 else "p[0]" if size else "none"


def in_words(form: str | tuple) -> str:
    """Describe the form of a value in words for messages."""
    if isinstance(form, str):
        return form
    if form and all(each == NUMBER for each in form):
        return f"a tuple of {len(form)} numbers"
    return f"({', '.join(map(in_words, form))})"


def form_of(value) -> str | tuple:
    """Form of a value that a user's function has returned."""
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
    """Call a user's function once; return the form of its result, or None if it raised an exception of its own.

    Parameters
    ----------
    function : Callable
        The function, a kernel, for errors.
    called : Callable
        Compiled form of the function, which is called.
    arguments : tuple
        Arguments of the call: state of a body, read-only numbers p of the field, and time.
    numbers : str
        Description of the numbers in p, for messages.

    Raises
    ------
    FaultyFunctionError
        The function reads beyond the end of p, or writes to p.
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
