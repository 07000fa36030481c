"""Check cameras and switches that are given as arguments, before anything is drawn."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import fields, replace
from math import isfinite
from numbers import Real
from typing import Any

import numpy as np

from rigid_env.rendering.camera import Camera

CameraArgument = Camera | Mapping[str, Any] | None
"""Type of an argument: a camera, a mapping of its parameters such as ``{"eye": (0, 8, 20)}``, or None."""

ALONG = 1e-6
"""Smallest sine of the angle between `up` and the line of sight; below it they count as parallel."""


def as_camera(value: CameraArgument, field: str = "camera") -> Camera | None:
    """Make a `Camera` of an argument, and check its parameters; None stays None.

    Parameters
    ----------
    value : Camera, mapping or None
    field : str
        Name of the argument in messages.

    Returns
    -------
    Camera or None
        Its vectors are tuples of float.

    Raises
    ------
    ValueError
        Another type; an unknown or missing parameter; vectors that are not three finite numbers; `eye` at `target`;
        `up` along the line of sight; a field of view that is not between 0 and 180 degrees.
    """
    if value is None:
        return None
    if isinstance(value, Mapping):
        value = _from_mapping(value, field)
    if not isinstance(value, Camera):
        raise ValueError(f"{field} is {value!r}; allowed are a Camera, a dict of its parameters, and None")
    vectors = {name: _vector(getattr(value, name), f"{field}.{name}") for name in ("eye", "target", "up")}
    fov_y = value.fov_y
    if isinstance(fov_y, bool) or not isinstance(fov_y, Real) or not 0.0 < fov_y < 180.0:
        raise ValueError(f"{field}.fov_y is {fov_y!r}; allowed are degrees between 0 and 180, these excluded")
    _check_line_of_sight(field, **vectors)
    return replace(value, **vectors, fov_y=float(fov_y))


def upwards(eye: Sequence[float], target: Sequence[float]) -> tuple[float, float, float]:
    """Upward direction of a picture, for a camera at `eye` that looks at `target`: y, or -z for a view along y."""
    x, _, z = np.subtract(target, eye)
    return (0.0, 0.0, -1.0) if np.hypot(x, z) <= ALONG * np.linalg.norm(np.subtract(target, eye)) else (0.0, 1.0, 0.0)


def as_switch(value: bool, field: str) -> bool:
    """Check that an argument is True or False, and return it as bool; `field` is its name in the error.

    Raises
    ------
    ValueError
        Anything else.
    """
    if not isinstance(value, (bool, np.bool_)):
        raise ValueError(f"{field} is {value!r}; allowed are True and False")
    return bool(value)


def _from_mapping(given: Mapping[str, Any], field: str) -> Camera:
    known = [each.name for each in fields(Camera)]
    for name in given:
        if name not in known:
            raise ValueError(f"{field} is {dict(given)!r}, with {name!r}; allowed are {', '.join(known)}")
    if "eye" not in given:
        raise ValueError(f"{field} is {dict(given)!r}; allowed is a dict with eye, the place of the camera")
    return Camera(**given)


def _vector(value: Any, field: str) -> tuple[float, float, float]:
    try:
        array = np.asarray(value)
    except ValueError:  # parts of different lengths
        array = np.zeros(0)
    if array.shape != (3,) or array.dtype.kind not in "iuf" or not all(map(isfinite, array.tolist())):
        raise ValueError(f"{field} is {value!r}; allowed are three finite numbers")
    x, y, z = map(float, array.tolist())
    return x, y, z


def _check_line_of_sight(field: str, eye: tuple, target: tuple, up: tuple) -> None:
    sight = np.subtract(target, eye)
    length = np.linalg.norm(sight)
    if not length > 0.0 or not isfinite(length):
        raise ValueError(f"{field}.target is {target} and eye is {eye}; allowed are two places")
    height = np.linalg.norm(up)
    across = np.linalg.norm(np.cross(sight / length, np.divide(up, height or 1.0)))
    if not isfinite(height) or not across > ALONG:
        raise ValueError(
            f"{field}.up is {up}, zero or along the line of sight; allowed is another direction, such as (0, 0, -1) "
            "from above"
        )
