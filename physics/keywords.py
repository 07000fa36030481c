"""Errors for unknown names, such as keywords of public constructors: they list the known names, the nearest first."""

from __future__ import annotations

import difflib
import functools
import inspect
import reprlib
from collections.abc import Callable, Iterable
from typing import Any, cast

from physics.annotations import Function

# Names with at least this share of their letters in common, in the same order, may be misspellings of each other.
ALIKE = 0.6


def nearest_first(name: object, allowed: Iterable[str]) -> list[str]:
    """Sort the names `allowed`: first those spelt like `name`, the most similar ahead, then the rest in its order."""
    allowed = list(allowed)
    first = alike(name, allowed)
    return [*first, *(known for known in allowed if known not in first)]


def alike(name: object, allowed: Iterable[str]) -> list[str]:
    """Select the names in `allowed` of which `name` may be a misspelling, the most similar first."""
    text, allowed = str(name).lower(), list(allowed)
    likeness = {known: difflib.SequenceMatcher(None, text, known.lower()).ratio() for known in allowed}
    return sorted((known for known in allowed if likeness[known] >= ALIKE), key=lambda known: -likeness[known])


def no_attribute(module: str, name: str, allowed: Iterable[str]) -> AttributeError:
    """Make the error for an unknown attribute `name` of a module; it lists the names `allowed`, the nearest first."""
    return AttributeError(
        f"module {module!r} has no attribute {name!r}; allowed are {', '.join(nearest_first(name, allowed))}"
    )


def known_keywords(target: Function) -> Function:
    """Decorate a function or class: an unknown keyword raises an error that lists the known ones.

    This decorator stands above `dataclass` if both are used. `help`, editors and `inspect.signature` still see the
    original signature. The check of each call costs a look-up per keyword, so functions of a step are not decorated.

    Parameters
    ----------
    target : function or method, or class with an ``__init__`` of its own
        Its signature must not have ``**kwargs``, with which no keyword would be unknown.

    Returns
    -------
    The same class with a checked ``__init__``, or a function that checks its keywords and then calls `target`.

    Raises
    ------
    TypeError
        Raised by a call: ``World got an unexpected keyword argument 'acuracy' (given: 'fast'); allowed are accuracy,
        ...``. It contains Python's own words "got an unexpected keyword argument", for which TorchRL looks.
    """
    if isinstance(target, type):
        kind: Any = target
        kind.__init__ = _checked(kind.__init__, kind.__name__, first=1)
        return target
    is_method = next(iter(inspect.signature(target).parameters), None) == "self"
    return cast("Function", _checked(target, target.__qualname__, first=int(is_method)))


def _checked(function: Callable, name: str, first: int = 0) -> Callable:
    """Wrap `function` with a check of its keywords; `name` names the function in errors.

    The first `first` parameters, such as `self`, are not listed as keywords.
    """
    parameters = list(inspect.signature(function).parameters.values())[first:]
    keywords = [p.name for p in parameters if p.kind in (p.POSITIONAL_OR_KEYWORD, p.KEYWORD_ONLY)]
    if any(p.kind == p.VAR_KEYWORD for p in parameters):
        raise TypeError(f"{name} takes **kwargs; allowed under known_keywords are explicit parameters")
    known = frozenset(keywords)

    @functools.wraps(function)
    def checked(*args, **kwargs):
        if not known.issuperset(kwargs):
            raise _unknown(next(key for key in kwargs if key not in known), kwargs)
        return function(*args, **kwargs)

    def _unknown(key: str, kwargs: dict) -> TypeError:
        allowed = ", ".join(nearest_first(key, keywords)) or "none"
        told = f"{name} got an unexpected keyword argument {key!r} (given: {reprlib.repr(kwargs[key])})"
        return TypeError(f"{told}; allowed are {allowed}")

    return checked
