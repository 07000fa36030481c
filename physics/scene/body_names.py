"""Names of a scene's bodies: their indices, and their labels in messages."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

import numpy as np

from physics.keywords import nearest_first
from physics.summary import shown

if TYPE_CHECKING:
    from physics.scene.scene import Scene


def body_index(value, field: str, scene: Scene, verb: str = "is") -> int:
    """Index of a body in `scene.bodies`, from `value`: the body's name or its index.

    Raises
    ------
    ValueError
        The scene has no such body. The message begins with the words `field` and `verb`, the value follows, then the
        names and indices of the scene's bodies, the nearest name first.
    """
    names = {body.name: b for b, body in enumerate(scene.bodies) if body.name is not None}
    if isinstance(value, str) and value in names:
        return names[value]
    count = len(scene.bodies)
    if isinstance(value, (int, np.integer)) and not isinstance(value, bool) and 0 <= value < count:
        return int(value)
    raise ValueError(f"{field} {verb} {shown(value)}; allowed are {_bodies(names, count, value)}")


def told_bodies(scene: Scene) -> str:
    """Text of an error message that lists the names and indices of a scene's bodies."""
    return _bodies(filter(None, body_names(scene)), len(scene.bodies), "")


def body_names(scene: Scene) -> tuple[str, ...]:
    """Names of a scene's bodies in their order; "" for a body without a name."""
    return tuple(body.name or "" for body in scene.bodies)


def body_label(body: int, names: tuple[str, ...]) -> str:
    """Label of the body with index `body`: the index, and its name in brackets if it has one.

    `names` is the tuple from `body_names`, or empty.
    """
    name = names[body] if 0 <= body < len(names) else ""
    return f"{body} ({name})" if name else str(body)


def _bodies(names: Iterable[str], count: int, near: object) -> str:
    indices = f"indices from 0 to {count - 1}" if count > 1 else "the index 0"
    ordered = nearest_first(near, names) if isinstance(near, str) else list(names)
    return f"{', '.join(ordered)}, or {indices}" if ordered else indices
