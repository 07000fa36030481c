"""Check a task's class for attributes that nothing would read, or that would overwrite attributes of `Task`."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from difflib import get_close_matches
from typing import Any

from physics import validation

NEAR = 0.68  # similarity, from 0 to 1, from which on a name is taken for a misspelling of another
FUNCTIONS = ("place", "note_episodes", "begin", "update", "success", "failure", "rewards", "measure")
OVERRIDABLE = {"lines", "place_options", "error_name", "area", "goal_draw", "name", "settings", "goal"}
OVERRIDABLE |= {"own_arrays", "own_settings"}
OF_INSTANCES = {
    "action", "clock", "disturbed", "effects", "episodes", "frame_skip", "generators", "info_names",
    "kept_arrays", "limits", "memory_arrays", "obs", "observed", "outcome", "previous_action", "record", "status",
    "weights", "world",
}  # fmt: skip
OF_INFO = ("is_success", "physics_status", "reset_mask", "elapsed_steps")


def check_class(task: type, base: type, declaration: type) -> None:
    """Check the attributes that a subclass of `Task` defines.

    Parameters
    ----------
    task : type
        The subclass.
    base, declaration : type
        `Task` and `Declaration`.

    Raises
    ------
    TypeError
        Naming the attribute and what is allowed. Refused are an attribute that `Task` uses itself, a name that is
        nearly that of a declared attribute (a misspelling), and a function of the task that is not callable.
    """
    declared = {name for name in vars(declaration) if not name.startswith("_")} | {"scene"}
    of_base = {name for each in base.__mro__ for name in vars(each) if not name.startswith("_")}
    own = (of_base | OF_INSTANCES) - declared - OVERRIDABLE
    defined = [name for name in vars(task) if not name.startswith("_")]
    for name in defined:
        if name in own:
            raise TypeError(f"{task.__name__} defines {name!r}, which is the task's own; allowed is another name")
        if name in declared or name in OVERRIDABLE:
            continue
        near = get_close_matches(name, declared, 1, NEAR)
        if near and near[0] not in vars(task):
            what = f"{task.__name__} defines {name!r}, which nothing reads"
            raise TypeError(f"{what}; allowed is {near[0]!r}, or a name that is less like it")
    for name in FUNCTIONS:
        if name in defined and not callable(vars(task)[name]):
            raise TypeError(f"{name} of {task.__name__} is {vars(task)[name]!r}; allowed is a function")


def refuse_same_keys(task: str, names: Iterable[str], drawn: Mapping) -> None:
    """Raise a ValueError if `info` would have a key twice: the environment's own keys, `names`, keys of `drawn`.

    `task` is the name of the task in the error.
    """
    keys = [*OF_INFO, *names, *drawn]
    twice = sorted({key for key in keys if keys.count(key) > 1})
    if twice:
        raise ValueError(f"info of {task} has {twice[0]!r} twice; allowed are measures, terms and draws of other names")


def check_views(task: str, views: Iterable[str], agents: Iterable[str]) -> None:
    """Raise a ValueError unless `views` of an observation are none, or those of all agents of the actions."""
    seen, acting = list(views), list(agents)
    if seen and set(seen) != set(acting):
        told = f"observation of {task} is of {', '.join(map(repr, seen))}"
        raise ValueError(f"{told}; allowed are the agents of its actions: {', '.join(map(repr, acting))}")


def checked_limit(value: Any, field: str) -> int | None:
    """Most control steps of an episode: an integer of at least 1, or None for no limit; `field` names it in errors."""
    try:
        return None if value is None else validation.count(value, field)
    except ValueError as error:
        raise ValueError(f"{error}, and None for no limit") from None
