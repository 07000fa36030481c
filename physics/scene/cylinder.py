"""A cylinder, of which a coin is a flat one."""

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
class Cylinder(Body):
    """A solid cylinder with its axis along body y; a flat one is a coin.

    MuJoCo's half-height is half of `height`; PyBullet's height is `height`.

    Parameters
    ----------
    radius : float
        Radius [m].
    height : float
        Length along the axis [m].
    mass : float
        Mass [kg]; `density` may be given instead.
    """

    radius: float
    height: float
    mass: float = FROM_DENSITY
    kind = "cylinder"
    __repr__ = body_repr

    if TYPE_CHECKING:  # sequences and arrays are taken, tuples are kept

        def __init__(
            self,
            radius: float,
            height: float,
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
        for name in ("radius", "height"):
            self._set(name, float(validation.positive(getattr(self, name), (), name)))
        super().__post_init__()

    @property
    def volume(self) -> float:
        """Volume [m³]."""
        return math.pi * self.radius * self.radius * self.height

    @property
    def dimensions(self) -> NDArray[np.float64]:
        """Half extents (3,) along body x, y, z [m]: radius, half the height, radius."""
        return np.array([self.radius, 0.5 * self.height, self.radius])

    @staticmethod
    def uniform_moments(dimensions: NDArray[np.float64], mass: Any) -> NDArray[np.float64]:
        """Principal moments (..., 3) [kg m²] of solid cylinders with half extents `dimensions` (..., 3) [m].

        The moments are about the body axes; `mass` (...) is in kg.
        """
        return inertia.cylinder_moments(dimensions, mass)

    @staticmethod
    def bounding_radius(dimensions: NDArray[np.float64]) -> NDArray[np.float64]:
        """Distance (...) [m] of the rims from the centre, from half extents `dimensions` (..., 3) [m]."""
        return np.hypot(dimensions[..., 0], dimensions[..., 1])
