"""A compound: several convex shapes that are one rigid body."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, fields
from functools import lru_cache
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from physics import validation
from physics.annotations import Vector
from physics.keywords import known_keywords
from physics.mass.inertia import MassProperties, compose
from physics.rotations import rotation_matrices
from physics.scene.bodies import FROM_DENSITY, Block, Body, Ellipsoid, Hull, Sphere, body_repr
from physics.scene.capsule import Capsule
from physics.scene.cylinder import Cylinder
from physics.scene.groups import GROUP, MASK
from physics.scene.motion import Motion
from physics.summary import shown

PARTS = (Block, Sphere, Ellipsoid, Capsule, Cylinder, Hull)
"""Classes of the parts of a compound."""

# Fields of a body that a part has; all others are those of the whole compound.
_OF_PARTS = ("pos", "quat", "mass", "density", "inertia_body", "fixed", "center")


class PlacedPart(NamedTuple):
    """Part of a compound, placed relative to the compound's centre of mass.

    Attributes
    ----------
    part : Body
        Shape of the part.
    place : (3,) float64
        Geometric centre of the part, frame of the compound [m].
    R : (3, 3) float64
        Rotation from the frame of the part to that of the compound.
    """

    part: Body
    place: NDArray[np.float64]
    R: NDArray[np.float64]

    @property
    def half_extents(self) -> NDArray[np.float64]:
        """Largest distance (3,) of the part from its geometric centre along each axis of the compound [m]."""
        d = self.part.dimensions
        if isinstance(self.part, Hull):
            return np.abs(self.part.polyhedron.vertices @ self.R.T).max(axis=0)
        if isinstance(self.part, Block):
            return np.abs(self.R) @ d
        if isinstance(self.part, Capsule):
            return np.abs(self.R[:, 1]) * (d[1] - d[0]) + d[0]
        if isinstance(self.part, Cylinder):
            return np.abs(self.R[:, 1]) * d[1] + np.hypot(self.R[:, 0], self.R[:, 2]) * d[0]
        return np.sqrt((self.R * d) ** 2 @ np.ones(3))

    @property
    def reach(self) -> float:
        """Radius about the centre of mass of the compound of a sphere that holds the part [m].

        It is the smallest one, except of an ellipsoid away from that centre.
        """
        d, centre = self.part.dimensions, self.place @ self.R
        if not centre.any() or isinstance(self.part, (Sphere, Ellipsoid)):
            return float(self.part.bounding_radius(d) + np.linalg.norm(centre))
        if isinstance(self.part, Capsule):
            ends = centre + np.array([[0.0, 1.0, 0.0], [0.0, -1.0, 0.0]]) * (d[1] - d[0])
            return float(np.linalg.norm(ends, axis=1).max() + d[0])
        if isinstance(self.part, Cylinder):
            return float(np.hypot(abs(centre[1]) + d[1], np.hypot(centre[0], centre[2]) + d[0]))
        corners = self.part.polyhedron.vertices if isinstance(self.part, Hull) else np.array(_CORNERS) * d
        return float(np.linalg.norm(centre + corners, axis=1).max())


_CORNERS = [(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]


@known_keywords
@dataclass(frozen=True)
class Compound(Body):
    """Several convex shapes as one rigid body: a table, a cross, a dumbbell.

    Each part has a mass or density of its own, and its pose in the frame of the compound: `pos` and `quat` of the part
    say where its centre of mass lies, and how it is turned. The origin of this frame does not matter: the compound is
    shifted so that its centre of mass lies at `pos`. `centroid` is the centre of mass in the coordinates of the parts.
    So ``pos=compound.centroid`` leaves parts where they are, if their coordinates are those of the world. Parts may
    touch and overlap; where they overlap, both masses count.

    Parameters
    ----------
    parts : sequence of Body
        At least one `Block`, `Sphere`, `Ellipsoid`, `Capsule`, `Cylinder` or `Hull`. Velocities, name, coefficients,
        groups and motion are those of the compound, and parts have none. Parts of a fixed compound may all be fixed,
        too; then the centre of mass is that of equal densities.
    mass : float
        Mass of the whole [kg]; the masses of all parts are then scaled to it. None: their sum.

    Raises
    ------
    ValueError
        No parts, a part that is no shape of these, or a part with a property that only the whole can have.
    """

    parts: tuple[Body, ...]
    mass: float = FROM_DENSITY
    kind = "compound"
    __repr__ = body_repr

    if TYPE_CHECKING:  # sequences and arrays are taken, tuples are kept

        def __init__(
            self,
            parts: Iterable[Body],
            mass: float | None = None,
            *,
            pos: ArrayLike = ...,
            quat: ArrayLike = ...,
            linvel: ArrayLike = ...,
            angvel: ArrayLike = ...,
            inertia_body: ArrayLike | None = None,
            density: None = None,
            name: str | None = None,
            friction: float | None = None,
            restitution: float | None = None,
            fixed: bool = False,
            group: int = GROUP,
            mask: int = MASK,
            motion: Motion | None = None,
        ) -> None: ...

    def __post_init__(self) -> None:
        self._set("parts", _checked(self.parts, bool(self.fixed)))
        super().__post_init__()

    def _set_mass(self) -> None:
        """Set `mass` to the sum of the parts' masses, unless it is given [kg]."""
        if self.density is not None:
            raise ValueError(f"density is {shown(self.density)} of a Compound; allowed is none: its parts have theirs")
        mass = self.mass if self.mass is not None else _mass_properties(self.parts).mass
        self._set("mass", float(validation.positive(mass, (), "mass")))

    @property
    def centroid(self) -> Vector:
        """Centre of mass in the coordinates of the parts [m]."""
        x, y, z = _mass_properties(self.parts).centre.tolist()
        return (x, y, z)

    @property
    def placed_parts(self) -> tuple[PlacedPart, ...]:
        """Parts, with their poses relative to the centre of mass."""
        return _placed(self.parts)

    @property
    def inertia(self) -> NDArray[np.float64]:
        """(3, 3) inertia tensor about the centre of mass in the body frame [kg m²]; infinite if fixed."""
        if self.fixed or self.inertia_body is not None:
            return super().inertia
        whole = _mass_properties(self.parts)
        return whole.inertia * (self.mass / whole.mass)

    @property
    def volume(self) -> float:
        """Sum of the parts' volumes [m³]."""
        return sum(part.volume for part in self.parts)

    @property
    def dimensions(self) -> NDArray[np.float64]:
        """Largest distance (3,) of the parts from the centre of mass along each body axis, in either direction [m]."""
        return np.max([np.abs(placed.place) + placed.half_extents for placed in self.placed_parts], axis=0)

    def bounding_radius(self, dimensions: NDArray[np.float64]) -> NDArray[np.float64]:
        """Radius [m] of a sphere about the centre of mass with all parts, once for each row of `dimensions` (..., 3).

        It is the smallest one, unless an ellipsoid reaches farthest.
        """
        return np.full(np.shape(dimensions)[:-1], max(placed.reach for placed in self.placed_parts))


def _checked(parts: Any, fixed: bool) -> tuple[Body, ...]:
    """Check the parts of a compound, and return them as a tuple."""
    known = ", ".join(kind.__name__ for kind in PARTS)
    if isinstance(parts, (Body, str, bytes, dict)) or not isinstance(parts, Iterable):
        raise ValueError(f"parts is {shown(parts)}; allowed is a list of {known}")
    found = tuple(parts)
    if not found:
        raise ValueError("parts is empty; allowed is at least one part")
    for k, part in enumerate(found):
        if not isinstance(part, PARTS):
            raise ValueError(f"parts[{k}] is {shown(part)}; allowed are instances of {known}")
        for item in fields(part):
            if item.kw_only and item.name not in _OF_PARTS and getattr(part, item.name) != item.default:
                raise ValueError(
                    f"parts[{k}].{item.name} is {shown(getattr(part, item.name))}; allowed is the default in a part: "
                    "give it to the Compound"
                )
        if part.fixed != found[0].fixed or (part.fixed and not fixed):
            allowed = "all parts alike, and fixed ones in a fixed Compound only"
            raise ValueError(f"parts[{k}].fixed is {part.fixed}; allowed are {allowed}")
    return found


@lru_cache(maxsize=1024)
def _mass_properties(parts: tuple[Body, ...]) -> MassProperties:
    """Mass, centre of mass and inertia of all parts in their frame; of fixed parts those of density 1 kg/m³."""
    R = [rotation_matrices(np.array(part.quat)) for part in parts]
    found = [
        MassProperties(
            part.volume if part.fixed else part.mass, np.zeros(3), np.eye(3) if part.fixed else part.inertia
        ).placed(part.pos, turn)
        for part, turn in zip(parts, R)
    ]
    return found[0] if len(found) == 1 else compose(found)


@lru_cache(maxsize=1024)
def _placed(parts: tuple[Body, ...]) -> tuple[PlacedPart, ...]:
    """Parts, with their poses relative to their centre of mass."""
    centre = _mass_properties(parts).centre
    placed = []
    for part in parts:
        R = rotation_matrices(np.array(part.quat))
        placed.append(PlacedPart(part, np.array(part.pos) - centre + R @ np.array(part.center), R))
    return tuple(placed)
