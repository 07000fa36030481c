"""Make a batch of worlds from a task class, or from its name ``module:Class``."""

from __future__ import annotations

import inspect
import sys
from collections.abc import Mapping
from dataclasses import fields
from importlib import import_module
from typing import Any

from physics.keywords import nearest_first
from rigid_env.envs.arguments import CommonArguments
from rigid_env.tasks import Task
from rigid_env.tasks.arguments import constructor_arguments

OF_ENVIRONMENT = [each.name for each in fields(CommonArguments)]
"""Names of settings that belong to an environment, not to its task."""


def task_class(task: type[Task] | str) -> type[Task]:
    """Return a task class, which is given as a class or by its name ``module:Class``.

    Raises
    ------
    ValueError
        It is neither a task class nor the name of one.
    """
    if isinstance(task, str):
        module, _, name = task.partition(":")
        try:
            found = getattr(import_module(module), name)
        except (ImportError, AttributeError, ValueError) as error:
            allowed = ", ".join(nearest_first(task, _tasks_of(module))) or "'module:Class'"
            raise ValueError(f"task is {task!r}, which is not there ({error}); allowed is {allowed}") from error
    else:
        found = task
    if not (inspect.isclass(found) and issubclass(found, Task)):
        raise ValueError(f"task is {task!r}; allowed are a subclass of rigid_env.Task and 'module:Class' of one")
    return found


def _tasks_of(module: str) -> list[str]:
    """Names ``module:Class`` of the tasks in a module that has been imported."""
    found = vars(sys.modules[module]) if module in sys.modules else {}
    classes = [name for name, each in found.items() if inspect.isclass(each) and issubclass(each, Task)]
    return [f"{module}:{name}" for name in classes if found[name] is not Task]


def make_task(task: type[Task] | str, worlds: int, settings: Mapping[str, Any]) -> Task:
    """Make a task with these settings, its constructor's arguments.

    Raises
    ------
    TypeError
        An unknown setting, with the known ones, the nearest first.
    ValueError
        As of `task_class`, and a setting out of range.
    """
    kind = task_class(task)
    check_settings(kind, settings)
    return kind(worlds, **settings)


def check_settings(kind: type[Task], settings: Mapping[str, Any], of_environment: bool = False) -> None:
    """Raise a TypeError for a setting that neither the task nor its environment knows."""
    known = [*constructor_arguments(kind)]
    if of_environment:
        known += OF_ENVIRONMENT
    for name in settings:
        if name not in known:
            allowed = ", ".join(nearest_first(name, known))
            raise TypeError(f"{kind.__name__} got the argument {name!r}; allowed are {allowed}")
