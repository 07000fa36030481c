"""Unknown keywords of public constructors: an error that lists the known ones, the nearest first."""

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
    """The names `allowed`, those that are like `name` first, the nearest of them ahead; the rest keep its order."""
    allowed = list(allowed)
    first = alike(name, allowed)
    return [*first, *(known for known in allowed if known not in first)]


def alike(name: object, allowed: Iterable[str]) -> list[str]:
    """Those of the names `allowed` that `name` may be a misspelling of, the nearest first."""
    text, allowed = str(name).lower(), list(allowed)
    likeness = {known: difflib.SequenceMatcher(None, text, known.lower()).ratio() for known in allowed}
    return sorted((known for known in allowed if likeness[known] >= ALIKE), key=lambda known: -likeness[known])


def no_attribute(module: str, name: str, allowed: Iterable[str]) -> AttributeError:
    """Error for a name that a module does not have: it lists those it has, the nearest first."""
    return AttributeError(
        f"module {module!r} has no attribute {name!r}; allowed are {', '.join(nearest_first(name, allowed))}"
    )


def known_keywords(target: Function) -> Function:
    """Let a function, or a class when it is made, refuse unknown keywords with the list of those it knows.

    This decorator stands above `dataclass` if both are used. The signature stays, for editors, `help` and
    `inspect.signature`. A call only looks up the given names; functions of a step do without the decorator.

    Parameters
    ----------
    target : function or method, or class with an ``__init__`` of its own
        Without ``**kwargs``: such a target knows every keyword.

    Returns
    -------
    The class itself, or a function in place of the one given.

    Raises
    ------
    TypeError
        When called: ``World got an unexpected keyword argument 'acuracy' (given: 'fast'); allowed are accuracy, ...``.
        Libraries look for Python's own words in it (TorchRL).
    """
    if isinstance(target, type):
        kind: Any = target
        kind.__init__ = _checked(kind.__init__, kind.__name__, first=1)
        return target
    is_method = next(iter(inspect.signature(target).parameters), None) == "self"
    return cast("Function", _checked(target, target.__qualname__, first=int(is_method)))


def _checked(function: Callable, name: str, first: int = 0) -> Callable:
    """`function` with its keywords looked at; its parameters from number `first` on are the user's."""
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
