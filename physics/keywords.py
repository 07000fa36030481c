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

# Names that other engines and textbooks give to arguments and classes of this package, in lower case.
ALIASES = {
    **dict.fromkeys(("position", "location", "translation", "xyz"), "pos"),
    **dict.fromkeys(("orientation", "rotation", "attitude", "quaternion", "rot"), "quat"),
    **dict.fromkeys(("velocity", "vel", "speed", "linear_velocity"), "linvel"),
    **dict.fromkeys(("angular_velocity", "spin", "omega"), "angvel"),
    **dict.fromkeys(("inertia", "tensor"), "inertia_body"),
    **dict.fromkeys(("extents", "dimensions", "half_extents", "edges", "shape"), "size"),
    **dict.fromkeys(("static", "kinematic", "is_fixed", "immovable"), "fixed"),
    **dict.fromkeys(("mu", "friction_coefficient"), "friction"),
    **dict.fromkeys(("bounce", "bounciness", "elasticity"), "restitution"),
    **dict.fromkeys(("timestep", "time_step", "step_size"), "dt"),
    **dict.fromkeys(("box", "cuboid", "cube", "brick"), "Block"),
    **dict.fromkeys(("ball", "point_mass", "pointmass"), "Sphere"),
    **dict.fromkeys(("plane", "wall", "ground", "floor", "halfspace"), "HalfSpace"),
    **dict.fromkeys(("mesh", "convex", "polyhedron"), "Hull"),
    **dict.fromkeys(("thrust", "thruster"), "Push"),
    **dict.fromkeys(("simulation", "simulator", "engine"), "World"),
}  # fmt: skip


def nearest_first(name: object, allowed: Iterable[str]) -> list[str]:
    """Sort the names `allowed`: first the one for which `name` is an alias, then those spelt like it, then the rest.

    The most similar spelling comes first; the rest keeps its order.
    """
    allowed = list(allowed)
    known = [each for each in allowed if each == ALIASES.get(str(name).lower())]
    first = list(dict.fromkeys((*known, *alike(name, allowed))))
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
        ...``. It contains Python's own words "got an unexpected keyword argument", for which TorchRL looks. An argument
        that is given twice, by its place and by its name, is told with both values.
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
    placed = [p.name for p in parameters if p.kind in (p.POSITIONAL_ONLY, p.POSITIONAL_OR_KEYWORD)]
    keywords = [p.name for p in parameters if p.kind in (p.POSITIONAL_OR_KEYWORD, p.KEYWORD_ONLY)]
    if any(p.kind == p.VAR_KEYWORD for p in parameters):
        raise TypeError(f"{name} takes **kwargs; allowed under known_keywords are explicit parameters")
    known = frozenset(keywords)

    @functools.wraps(function)
    def checked(*args, **kwargs):
        if not known.issuperset(kwargs):
            raise _unknown(next(key for key in kwargs if key not in known), kwargs)
        if kwargs:
            for key, value in zip(placed, args[first:]):
                if key in kwargs:
                    raise _twice(key, value, kwargs[key])
        return function(*args, **kwargs)

    def _unknown(key: str, kwargs: dict) -> TypeError:
        allowed = ", ".join(nearest_first(key, keywords)) or "none"
        told = f"{name} got an unexpected keyword argument {key!r} (given: {reprlib.repr(kwargs[key])})"
        return TypeError(f"{told}; allowed are {allowed}")

    def _twice(key: str, by_place: object, by_name: object) -> TypeError:
        told = f"{name} got multiple values for argument {key!r}: {reprlib.repr(by_place)} without a name"
        order = f"without names they are, in order, {', '.join(placed)}"
        return TypeError(f"{told}, and {key}={reprlib.repr(by_name)}; allowed is one: {order}")

    return checked
