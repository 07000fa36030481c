"""Sensor: a region that tells which bodies are in it, and does not push."""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from physics import validation
from physics.html_table import fields_table
from physics.keywords import known_keywords, nearest_first
from physics.rotations import product, rotation_matrices
from physics.scene.bodies import Body, check_name
from physics.scene.compound import Compound
from physics.summary import SHOWN_IF_GIVEN, fields_repr, shown

# Fields of a body that say which shape it has and where; a sensor has no others.
_OF_SHAPES = ("pos", "quat", "mass", "density", "inertia_body", "fixed", "center")


@known_keywords
@dataclass(frozen=True)
class Sensor:
    """A region of a scene that tells which bodies touch or overlap it (`World.read_sensors`).

    It is no body: nothing touches it, and the motion of a scene has the same bits with and without it.

    Parameters
    ----------
    shape : Body
        Any shape, such as ``physics.Sphere(0.5, fixed=True, pos=(0, 1, 0))``. Its `pos` and `quat` say where the
        region is. Its mass does not matter. All else that a body may have must be left out.
    body : int or str, optional
        Index or name of a body of the scene that carries the sensor: the shape's `pos` and `quat` are then in the frame
        of this body, from its centre of mass. The sensor does not tell about this body. None: the region stays where it
        is in the world.
    name : str, optional
        Name of the sensor; no body, wall or other sensor of a scene may have it.

    Raises
    ------
    ValueError
        `shape` is no body, or has a property of bodies that a region has not, or a name without printable characters.
    """

    shape: Body
    body: int | str | None = field(default=None, metadata=SHOWN_IF_GIVEN)
    name: str | None = field(default=None, kw_only=True, metadata=SHOWN_IF_GIVEN)

    if TYPE_CHECKING:

        def __init__(self, shape: Body, body: int | str | None = None, *, name: str | None = None) -> None: ...

    __repr__ = fields_repr
    _repr_html_ = fields_table

    def __post_init__(self) -> None:
        validation.instance(self.shape, Body, "Sensor.shape", "a body such as physics.Sphere(0.5, fixed=True)")
        for item in fields(self.shape):
            value: Any = getattr(self.shape, item.name)
            if item.kw_only and item.name not in _OF_SHAPES and value != item.default:
                raise ValueError(
                    f"Sensor.shape has {item.name} {shown(value)}; allowed is its default: of the body only shape and "
                    "place count"
                )
        if self.body is not None and not isinstance(self.body, str):
            object.__setattr__(self, "body", validation.count(self.body, "Sensor.body", 0))
        if self.name is not None:
            check_name(self.name, "Sensor.name")

    def regions(self) -> list[tuple[Body, NDArray[np.float64], NDArray[np.float64]]]:
        """Convex shapes of the region, with place (3,) [m] and attitude (4,) of each, in the frame of the sensor."""
        place, turn = np.array(self.shape.pos), np.array(self.shape.quat)
        if not isinstance(self.shape, Compound):
            return [(self.shape, place, turn)]
        R, middle = rotation_matrices(turn), np.array(self.shape.centroid)
        return [
            (part, place + R @ (np.array(part.pos) - middle), product(turn, np.array(part.quat)))
            for part in self.shape.parts
        ]


def carrier_index(sensor: Sensor, bodies: tuple[Body, ...], place: str) -> int | None:
    """Index of the body that carries a sensor of a scene with these bodies; None if it stays where it is.

    Raises
    ------
    ValueError
        The scene has no such body; the message calls the sensor `place`.
    """
    names = {body.name: b for b, body in enumerate(bodies) if body.name is not None}
    if sensor.body is None or sensor.body in names:
        return None if sensor.body is None else names[str(sensor.body)]
    if isinstance(sensor.body, int) and sensor.body < len(bodies):
        return sensor.body
    known = nearest_first(sensor.body, names) if isinstance(sensor.body, str) else list(names)
    allowed = ", ".join([*known, f"indices from 0 to {len(bodies) - 1}"])
    raise ValueError(f"{place}.body is {shown(sensor.body)}; allowed are {allowed}")
