"""Settings that decide how a task goes on, and that its state does not hold: they must be the same where it goes on."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any
from zlib import crc32

import physics

Setting = str | int | float

NUMBERS_IN_PLAN = (physics.Actuator, physics.Sleeping)
"""Effects whose numbers are no parameters of a world: a snapshot has those of all others."""


def state_settings(task) -> dict[str, Setting]:
    """Settings of a task, by name, as values that can be compared, shown and kept in a file.

    The accuracy is none of them: a state may go on with another one, by design. What is drawn is in the state.

    Parameters
    ----------
    task : Task
    """
    world = task.world
    scene = world.scene
    return {
        "frame_skip": task.frame_skip,
        "dt": float(world.dt),
        "actions": task.action_text,
        "bodies": ", ".join(map(_body, scene.bodies)),
        "walls": ", ".join(map(repr, scene.walls)),
        "effects": ", ".join((*sorted(map(_effect, scene.effects)), *world.plan.laws)),
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
    for name in (*ours, *theirs):
        if ours.get(name) != theirs.get(name):
            raise ValueError(
                f"{name} of state is {theirs.get(name, 'not told')}; allowed is that of this {task}, "
                f"{ours.get(name, 'none')}"
            )


def _body(body) -> str:
    """Kind of a body, and a checksum of the corners of a hull; its size and mass are parameters."""
    return f"hull {crc32(body.polyhedron.vertices.tobytes()):08x}" if body.kind == "hull" else body.kind


def _effect(effect) -> str:
    return repr(effect) if isinstance(effect, NUMBERS_IN_PLAN) else type(effect).__name__


def _plain(value: Any) -> Setting:
    return value if isinstance(value, (str, int, float)) else repr(value)
