"""Names of bodies: conversion to indices, and labels for messages."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from physics.keywords import nearest_first
from physics.scene.scene import Scene
from physics.summary import shown


def body_index(value, field: str, scene: Scene, verb: str = "is") -> int:
    """Index of a body of a scene, given by its name or index.

    Raises
    ------
    ValueError
        No such body: names the field, the value and the bodies there are, the nearest name first.
    """
    names = {body.name: b for b, body in enumerate(scene.bodies) if body.name is not None}
    if isinstance(value, str) and value in names:
        return names[value]
    count = len(scene.bodies)
    if isinstance(value, (int, np.integer)) and not isinstance(value, bool) and 0 <= value < count:
        return int(value)
    raise ValueError(f"{field} {verb} {shown(value)}; allowed are {_bodies(names, count, value)}")


def told_bodies(scene: Scene) -> str:
    """Names and indices of a scene's bodies, for errors."""
    return _bodies(filter(None, body_names(scene)), len(scene.bodies), "")


def body_names(scene: Scene) -> tuple[str, ...]:
    """Names of the bodies; "" for one without a name."""
    return tuple(body.name or "" for body in scene.bodies)


def body_label(body: int, names: tuple[str, ...]) -> str:
    """Index of a body, and its name in brackets if it has one; `names` as of `body_names`, or empty."""
    name = names[body] if 0 <= body < len(names) else ""
    return f"{body} ({name})" if name else str(body)


def _bodies(names: Iterable[str], count: int, near: object) -> str:
    indices = f"indices from 0 to {count - 1}" if count > 1 else "the index 0"
    ordered = nearest_first(near, names) if isinstance(near, str) else list(names)
    return f"{', '.join(ordered)}, or {indices}" if ordered else indices
