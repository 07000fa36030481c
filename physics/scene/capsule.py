"""A capsule: a cylinder with a hemisphere on each end."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from physics import validation
from physics.keywords import known_keywords
from physics.mass import inertia
from physics.scene.bodies import FROM_DENSITY, Body, body_repr
from physics.scene.groups import GROUP, MASK
from physics.scene.motion import Motion


@known_keywords
@dataclass(frozen=True)
class Capsule(Body):
    """A solid capsule along body y: all points within `radius` of a segment, its axis, of the given `length`.

    `length` is that of the cylinder between both hemispheres, so that the capsule is ``length + 2 * radius`` long.
    MuJoCo's half-length is half of `length`; PyBullet's height is `length`.

    Parameters
    ----------
    radius : float
        Radius of the cylinder and of both hemispheres [m].
    length : float
        Length of the cylinder, without the hemispheres [m]. A capsule without a cylinder is a `Sphere`.
    mass : float
        Mass [kg]; `density` may be given instead.
    """

    radius: float
    length: float
    mass: float = FROM_DENSITY
    kind = "capsule"
    __repr__ = body_repr

    if TYPE_CHECKING:  # sequences and arrays are taken, tuples are kept

        def __init__(
            self,
            radius: float,
            length: float,
            mass: float | None = None,
            *,
            pos: ArrayLike = ...,
            quat: ArrayLike = ...,
            linvel: ArrayLike = ...,
            angvel: ArrayLike = ...,
            inertia_body: ArrayLike | None = None,
            density: float | None = None,
            name: str | None = None,
            friction: float | None = None,
            restitution: float | None = None,
            fixed: bool = False,
            group: int = GROUP,
            mask: int = MASK,
            motion: Motion | None = None,
        ) -> None: ...

    def __post_init__(self) -> None:
        for name in ("radius", "length"):
            self._set(name, float(validation.positive(getattr(self, name), (), name)))
        super().__post_init__()

    @property
    def volume(self) -> float:
        """Volume [m³]: that of the cylinder and of a ball."""
        return math.pi * self.radius * self.radius * (self.length + 4 / 3 * self.radius)

    @property
    def dimensions(self) -> NDArray[np.float64]:
        """Half extents (3,) along body x, y, z [m]: radius, half the length with one radius, radius."""
        return np.array([self.radius, 0.5 * self.length + self.radius, self.radius])

    @staticmethod
    def uniform_moments(dimensions: NDArray[np.float64], mass: Any) -> NDArray[np.float64]:
        """Principal moments (..., 3) [kg m²] of solid capsules with half extents `dimensions` (..., 3) [m].

        The moments are about the body axes; `mass` (...) is in kg.
        """
        return inertia.capsule_moments(dimensions, mass)

    @staticmethod
    def bounding_radius(dimensions: NDArray[np.float64]) -> NDArray[np.float64]:
        """Distance (...) [m] of the tips from the centre, from half extents `dimensions` (..., 3) [m]."""
        return dimensions[..., 1]
