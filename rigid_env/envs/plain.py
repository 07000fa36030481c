"""Settings of environments as plain data, so that Gymnasium's `EnvSpec` survives JSON.

`EnvSpec.to_json` makes a dict of every dataclass, in which an effect has lost its class. An environment therefore keeps
its spec with plain data in it, which its constructor reads.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Mapping
from dataclasses import asdict, replace
from enum import Enum
from typing import TYPE_CHECKING, Any

import physics
from physics.io.plain import EFFECTS, plain_scene, plain_table
from physics.scene.force_field import Field
from rigid_env.tasks import Task

if TYPE_CHECKING:
    from gymnasium.envs.registration import EnvSpec


class PlainSpec:
    """Part of an environment that keeps its spec as plain data, even if it was made with objects."""

    _spec: EnvSpec | None = None

    @property
    def spec(self) -> EnvSpec | None:
        """Spec with which `gymnasium.make` made the environment; None if it was made without `gymnasium.make`."""
        return self._spec

    @spec.setter
    def spec(self, spec: EnvSpec | None) -> None:
        self._spec = None if spec is None else replace(spec, kwargs=plain_settings(spec.kwargs))


def plain_settings(settings: Mapping[str, Any]) -> dict[str, Any]:
    """Turn arguments of an environment into plain data, which JSON can hold.

    Three kinds of objects are left as they are: force fields and distributions of a user's own classes, and tasks whose
    class no module exports.
    """
    return {name: _plain(value) for name, value in settings.items()}


def _plain(value: Any) -> Any:
    if isinstance(value, physics.Accuracy):
        return asdict(value)
    if isinstance(value, physics.Scene):
        return value if any(_is_of_user(effect) for effect in value.effects) else plain_scene(value)
    if isinstance(value, EFFECTS):
        return value if _is_of_user(value) else plain_table(value)
    if isinstance(value, (list, tuple)) and any(isinstance(part, (*EFFECTS, Field)) for part in value):
        return [_plain(part) for part in value]
    if isinstance(value, type) and issubclass(value, Task):
        return import_path(value) or value
    if isinstance(value, Enum):
        return value.value
    return os.fspath(value) if isinstance(value, os.PathLike) else value


def _is_of_user(effect: Any) -> bool:
    """True if scene files do not know an effect's class, so that its name is not enough to find it."""
    return type(effect) not in EFFECTS


def import_path(task: type[Task]) -> str | None:
    """Import path of a class, ``module:Class``; None if another process could not import it."""
    module = sys.modules.get(task.__module__)
    is_there = task.__module__ != "__main__" and getattr(module, task.__qualname__, None) is task
    return f"{task.__module__}:{task.__qualname__}" if is_there else None
