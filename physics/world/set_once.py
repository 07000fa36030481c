"""Attributes of a world that no one may set: an assignment raises an error that names the method for it."""

from __future__ import annotations

from typing import Any, TypeVar

Kind = TypeVar("Kind", bound=type)

_STATE = "read-only; use set_state({}=...)"
_PARAMETER = "read-only; use set_parameters({}=...)"
_NEW = "fixed when a world is made; make a new World"

# Advice for each attribute that a world sets once, when it is made.
ADVICE = {
    **{name: _STATE.format(name) for name in ("pos", "quat", "linvel", "angvel")},
    "state": "read-only; use set_state(pos=..., quat=..., linvel=..., angvel=...), or restore(snapshot)",
    "gravity": _PARAMETER.format("gravity"),
    "params": "read-only; use set_parameters(mass=...), or another of its arguments",
    "walls": "read-only; use set_parameters(wall_friction=..., wall_restitution=...); their places are the Scene's",
    "memory": "read-only; use snapshot and restore, which take it along",
    "sleep": "read-only; use set_state(linvel=...) to wake bodies, or restore(snapshot)",
    "dt": "fixed when a world is made; use step(dt=...) for another step",
    **{name: f"{_NEW}({name}=...)" for name in ("scene", "worlds", "accuracy", "threads")},
    **dict.fromkeys(("plan", "body_count", "names", "scene_settings", "shapes"), f"{_NEW}(scene)"),
}

# Advice for names of parameters that a world takes, and does not have as attributes.
ABSENT = {name: _PARAMETER.format(name) for name in ("mass", "size", "inertia_body", "friction", "restitution")}


class SetOnce:
    """Descriptor of an attribute that is set once, when its object is made.

    It has no `__get__`, so Python reads the attribute from the object's dictionary, as if there were no descriptor.
    """

    def __init__(self, name: str, advice: str):
        self.name, self.advice = name, advice

    def __set__(self, world: Any, value: Any) -> None:
        if self.name in vars(world):
            raise AttributeError(f"{type(world).__name__}.{self.name} is {self.advice}")
        vars(world)[self.name] = value


class Absent:
    """Descriptor of a name that an object has not: it can be neither read nor set."""

    def __init__(self, name: str, advice: str):
        self.name, self.advice = name, advice

    def __get__(self, world: Any, kind: type | None = None) -> Any:
        if world is None:
            return self
        raise AttributeError(f"{type(world).__name__!r} object has no attribute {self.name!r}")

    def __set__(self, world: Any, value: Any) -> None:
        raise AttributeError(f"{type(world).__name__}.{self.name} is {self.advice}")


def with_attributes_set_once(kind: Kind) -> Kind:
    """Decorate the class `World`: its attributes in `ADVICE` are set once, and names in `ABSENT` are never set."""
    for names, descriptor in ((ADVICE, SetOnce), (ABSENT, Absent)):
        for name, advice in names.items():
            setattr(kind, name, descriptor(name, advice))
    return kind
