"""Settings of a task that decide its future but are not part of a state; they must agree where a state is restored."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from physics.world.scene_settings import other_setting

Setting = str | int | float


def state_settings(task) -> dict[str, Setting]:
    """Settings of a task by name, as values that can be compared, shown and kept in a file.

    The accuracy is not among them, since a state may continue with another one; drawn values are in the state itself.

    Parameters
    ----------
    task : Task
    """
    world = task.world
    return {
        "frame_skip": task.frame_skip,
        "dt": float(world.dt),
        "actions": task.action_text,
        **world.scene_settings,
        **{name: _plain(value) for name, value in task.own_settings().items()},
    }


def check_settings(task: str, ours: Mapping[str, Setting], theirs: Mapping[str, Setting]) -> None:
    """Refuse a state whose settings differ from those of the task.

    Parameters
    ----------
    task : str
        Name of the task, for the error.
    ours, theirs : mapping of str to value
        Settings of the task, and of the state.

    Raises
    ------
    ValueError
        Naming the first setting that differs, its value in the state, and its value in the task.
    """
    other = other_setting(ours, theirs)
    if other is not None:
        name, here, there = other
        raise ValueError(
            f"{name} of state is {'not told' if there is None else there}; allowed is that of this {task}, "
            f"{'none' if here is None else here}"
        )


def _plain(value: Any) -> Setting:
    return value if isinstance(value, (str, int, float)) else repr(value)
