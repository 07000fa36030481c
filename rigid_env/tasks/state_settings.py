"""Settings outside a task's state that decide its future; they must agree where a state is restored."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from physics.world.scene_settings import other_setting

Setting = str | int | float


def state_settings(task) -> dict[str, Setting]:
    """Settings of a task, by name, as values that can be compared, shown and kept in a file.

    The accuracy is left out on purpose: a state may continue with another one. Drawn values are in the state.

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
    """Refuse a state with other settings than a task.

    Parameters
    ----------
    task : str
        Its name.
    ours, theirs : mapping
        Settings of the task, and of the state.

    Raises
    ------
    ValueError
        Naming the setting, its value in the state, and the task's.
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
