"""Options of `reset`: every one is looked at before anything changes."""

from __future__ import annotations

import reprlib
from collections.abc import Callable, Iterable, Mapping
from functools import partial
from typing import Any

import numpy as np

from physics.keywords import nearest_first
from rigid_env.tasks.area import Area
from rigid_env.tasks.parameters import CHECKS, LENGTHS

FACE_COUNT = 6


def require_known(options: Mapping[str, Any] | None, allowed: Iterable[str]) -> Mapping[str, Any]:
    """The options themselves, an empty dict for None.

    Raises
    ------
    TypeError
        They are no dict.
    ValueError
        Naming a key that is not `allowed`, and the allowed ones, the nearest first.
    """
    if options is None:
        return {}
    if not isinstance(options, Mapping):
        raise TypeError(
            f"options is {reprlib.repr(options)}; allowed are None and a dict with keys of {', '.join(allowed)}"
        )
    for key in options:
        if key not in allowed:
            raise ValueError(f"options has the key {key!r}; allowed are {', '.join(nearest_first(key, allowed))}")
    return options


def read_options(options, kinds: Mapping[str, str], worlds: int, area: Area) -> dict[str, np.ndarray]:
    """Values for `worlds` worlds from what a user gives, one for all of them or one for each.

    Parameters
    ----------
    options : dict or None
    kinds : dict of str to str
        Allowed keys, and the keys of `READERS` that read them.
    worlds : int
    area : Area
        In which places must lie.

    Returns
    -------
    dict of str to (worlds,) or (worlds, k) float64
        The keys given.

    Raises
    ------
    TypeError, ValueError
        Naming the key, the value and what is allowed.
    """
    options = require_known(options, kinds)
    return {key: READERS[kinds[key]](f"options {key}", value, worlds, area) for key, value in options.items()}


def _numbers(field: str, value, worlds: int, length: int) -> np.ndarray:
    """(worlds,) for a length of 1, else (worlds, length): finite, from one for all or one for each."""
    shape = (worlds,) if length == 1 else (worlds, length)
    try:
        array = np.asarray(value)
    except ValueError:  # rows of different lengths
        array = np.asarray(None)
    if array.dtype.kind not in "fiu" or array.shape not in (shape, shape[1:]):
        one = "a number" if length == 1 else f"{length} numbers"
        each = f", or as much for each of {worlds} worlds" if worlds > 1 else ""
        raise ValueError(f"{field} is {reprlib.repr(value)}; allowed is {one}{each}")
    array = array.astype(np.float64)
    if not np.isfinite(array).all():
        raise ValueError(f"{field} is {reprlib.repr(value)}; allowed are finite numbers")
    return np.broadcast_to(array, shape)


def _angle(field: str, value, worlds: int, area: Area) -> np.ndarray:
    return _numbers(field, value, worlds, 1)


def _face(field: str, value, worlds: int, area: Area) -> np.ndarray:
    faces = _numbers(field, value, worlds, 1)
    if not np.isin(faces, np.arange(FACE_COUNT)).all():
        allowed = f"integers from 0 to {FACE_COUNT - 1}, for -x, +x, -y, +y, -z, +z"
        raise ValueError(f"{field} is {reprlib.repr(value)}; allowed are {allowed}")
    return faces


def _place(field: str, value, worlds: int, area: Area) -> np.ndarray:
    places = _numbers(field, value, worlds, 2)
    low, high = area.centre - area.half_width, area.centre + area.half_width
    if not ((places >= low) & (places <= high)).all():
        allowed = f"places inside the box, x and z from {low:g} to {high:g} m"
        raise ValueError(f"{field} is {reprlib.repr(value)}; allowed are {allowed}")
    return places


def read_parameter(parameter: str, field: str, value, worlds: int, area: Area) -> np.ndarray:
    """A physical parameter of the block, (worlds,), the size (worlds, 3); `field` is its name in an error."""
    values = _numbers(field, value, worlds, LENGTHS[parameter])
    CHECKS[parameter](values, values.shape, field)
    if parameter == "size":
        area.check_room(values[np.argmax(np.linalg.norm(values, axis=1))], field)
    return values


READERS: dict[str, Callable[[str, Any, int, Area], np.ndarray]] = {
    "place": _place,
    "angle": _angle,
    "face": _face,
    **{parameter: partial(read_parameter, parameter) for parameter in LENGTHS},
}
"""What reads an option, by its kind."""

START_OPTIONS = {"place": "place", "yaw": "angle", "face": "face", **{parameter: parameter for parameter in LENGTHS}}
"""Kinds of the options that every task has: the pose of the start and the parameters of the block."""
