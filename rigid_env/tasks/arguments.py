"""Groups of constructor arguments as dataclasses, so that constructors share names, types and defaults."""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any, Concatenate, ParamSpec, TypeVar, get_type_hints

from physics.accuracy import AccuracyArgument
from physics.annotations import Effect

P = ParamSpec("P")
Made = TypeVar("Made")
Group = TypeVar("Group")


def takes(group: Callable[P, Group]) -> Callable[[Callable[[Made, Group], None]], Callable[Concatenate[Made, P], None]]:
    """Let a constructor that is written for a dataclass of arguments take each field as a parameter of its own.

    The dataclass often joins several others by inheritance; fields of the last base come first. Editors, type checkers,
    `help` and `inspect.signature` see the fields as parameters of the constructor.

    Parameters
    ----------
    group : dataclass
        Class of the arguments. Use one class for one constructor: errors of a wrong call name that constructor.

    Returns
    -------
    callable
        Decorator of ``__init__(self, given)``, where `given` is an instance of `group`.
    """

    def spread(init: Callable[[Made, Group], None]) -> Callable[Concatenate[Made, P], None]:
        def __init__(self: Made, *args: P.args, **kwargs: P.kwargs) -> None:
            init(self, group(*args, **kwargs))

        found: Any = functools.update_wrapper(__init__, init)
        made = next(iter(inspect.signature(init).parameters.values()))
        found.__signature__ = inspect.Signature([made, *inspect.signature(group).parameters.values()])
        found.__annotations__ = get_type_hints(group)
        group.__init__.__qualname__ = init.__qualname__  # type: ignore[misc]
        return found

    return spread


def part(given: Any, *groups: type) -> dict[str, Any]:
    """Collect the fields of some `groups`, by name, from a dataclass instance that inherits from them."""
    return {each.name: getattr(given, each.name) for group in groups for each in fields(group)}


def constructor_arguments(kind: type) -> dict[str, inspect.Parameter]:
    """Arguments of a task's constructor, and of constructors that it passes others on to, without `worlds`."""
    found: dict[str, inspect.Parameter] = {}
    for each in kind.__mro__:
        if "__init__" not in vars(each):
            continue
        parameters = inspect.signature(vars(each)["__init__"]).parameters
        own = {name: about for name, about in parameters.items() if about.kind is not inspect.Parameter.VAR_KEYWORD}
        found = {**found, **{name: about for name, about in own.items() if name not in found}}
        if len(own) == len(parameters):
            break
    return {name: about for name, about in found.items() if name not in ("self", "worlds")}


@dataclass(frozen=True)
class BatchArguments:
    """Argument for the number of worlds in a batch; see `rigid_env.Task`."""

    worlds: int = 1


@dataclass(frozen=True, kw_only=True)
class EngineArguments:
    """Arguments that the world of every task takes; see `rigid_env.Task`."""

    accuracy: AccuracyArgument = "balanced"
    effects: Iterable[Effect | Mapping[str, Any]] = ()
    dump_faults: str | Path | None = None
    threads: int = 1


@dataclass(frozen=True, kw_only=True)
class ControlArguments(EngineArguments):
    """Arguments of tasks with a default length of the control step; see `rigid_env.Task`."""

    frame_skip: int = 5
    dt: float = 0.005
