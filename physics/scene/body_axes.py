"""Axes of friction with two coefficients in the frames of bodies: the grain of a ski, a skate or a planed board."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from physics import validation
from physics.annotations import BodyAxis
from physics.scene.pairs import end_index
from physics.summary import shown

if TYPE_CHECKING:
    from physics.scene.scene import Scene

FIELD = "Friction.body_axes"
ALLOWED = "allowed is a dict of bodies to directions, as {'ski': (1, 0, 0)}"


def checked_axes(given: Any) -> tuple[BodyAxis, ...]:
    """Check `Friction.body_axes`, a mapping or an iterable of (body, direction); return a tuple of both.

    Raises
    ------
    ValueError
        It is neither, an end is no name and no index, a direction is zero, or a body is given twice.
    """
    if isinstance(given, Mapping):
        given = tuple(given.items())
    if isinstance(given, (str, bytes)) or not isinstance(given, Iterable):
        raise ValueError(f"{FIELD} is {shown(given)}; {ALLOWED}")
    found: dict[Any, BodyAxis] = {}
    for item in given:
        if isinstance(item, (str, bytes)) or not isinstance(item, Iterable) or len(parts := tuple(item)) != 2:
            raise ValueError(f"{FIELD} holds {shown(item)}; {ALLOWED}")
        end, axis = parts
        if not isinstance(end, (str, int, np.integer)) or isinstance(end, bool):
            raise ValueError(f"{FIELD} holds the body {shown(end)}; allowed are names and indices")
        value = validation.finite(axis, (3,), f"{FIELD}[{shown(end)}]")
        if not value.any():
            raise ValueError(f"{FIELD}[{shown(end)}] is {shown(axis)}; allowed is any vector but zero")
        end = end if isinstance(end, str) else int(end)
        if end in found:
            raise ValueError(f"{FIELD} holds the body {shown(end)} twice; allowed is one direction")
        found[end] = (end, tuple(value.tolist()))
    return tuple(found.values())


def axis_table(scene: Scene, axes: Iterable[BodyAxis]) -> np.ndarray:
    """Unit vectors (bodies, 3) along the axes of a scene's bodies, body frames; 0 for bodies without an axis.

    Raises
    ------
    ValueError
        The scene has no such body, or a body has two axes under different names.
    """
    table = np.zeros((len(scene.bodies), 3))
    for end, axis in axes:
        b = end_index(scene, end, FIELD)
        if b < 0:
            raise ValueError(f"{FIELD} holds {shown(end)}, a wall; allowed are bodies: Friction.axis is that of walls")
        if table[b].any():
            raise ValueError(f"{FIELD} holds the body {shown(end)} twice; allowed is one direction")
        table[b] = np.array(axis) / np.linalg.norm(axis)
    return table
