"""Compounds of a scene from bodies of a model that have several geoms."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from physics.io.mjcf.shapes import UNIFORM_HULL, is_near, make_part, start_of
from physics.mass.inertia import MassProperties
from physics.rotations import rotation_matrices
from physics.scene.compound import Compound

DENSITY = 1000.0  # MuJoCo's default [kg/m³]

# Share of the size to which the centre of mass of the geoms must be that of the body: rounding errors of sums.
CENTRED = 1e-10


class PlacedGeom(NamedTuple):
    """Geom of a body with several geoms, in the frame of the model's body.

    Attributes
    ----------
    kind : str
        Kind of the geom, as of `shapes.Placed`.
    shape : (3,) or (n, 3) float64
        Dimensions as of `shapes.Placed`; of a mesh its points relative to `pos`, along the axes of `quat` [m].
    pos : (3,) float64
        Place of the geom [m].
    quat : (4,) float64
        Unit quaternion of its axes; the axis of a capsule or cylinder is its y axis.
    mass : float
        Mass [kg]; of a fixed body it is not used.
    """

    kind: str
    shape: np.ndarray
    pos: np.ndarray
    quat: np.ndarray
    mass: float = 0.0


def make_compound(
    geoms: Sequence[PlacedGeom], mass: MassProperties, pose: np.ndarray, velocity: np.ndarray, name: str | None
) -> Compound:
    """Make a compound of a model's body with these geoms; the other arguments are those of `shapes.make_body`.

    Raises
    ------
    ValueError
        A scene cannot hold such a body; the message names the reason.
    """
    for geom in geoms:
        if not geom.mass > 0.0:
            raise ValueError(
                f"a {geom.kind} of it has the mass {geom.mass:g}; allowed in a body of several is more than 0"
            )
    parts = [make_part(geom.kind, geom.shape, geom.pos, geom.quat, {"mass": geom.mass}) for geom in geoms]
    compound = Compound(parts, mass.mass, **start_of(mass, pose, velocity, name))
    share = UNIFORM_HULL if any(geom.kind == "mesh" for geom in geoms) else CENTRED
    away, size = np.subtract(compound.centroid, mass.centre), _size(compound, mass)
    if np.abs(away).max() > share * size:
        raise ValueError(
            f"the centre of mass of its {len(parts)} geoms is {away.tolist()} m from that of the body; allowed is a "
            "body whose mass is that of its geoms"
        )
    if is_near(mass.inertia, compound.inertia, share):
        return compound
    return replace(compound, inertia_body=mass.inertia)


def make_fixed_compound(geoms: Sequence[PlacedGeom], pose: np.ndarray, name: str | None) -> Compound:
    """Make a fixed compound; `pose` and `name` are as of `shapes.make_fixed`."""
    parts = [make_part(geom.kind, geom.shape, geom.pos, geom.quat, {"fixed": True}) for geom in geoms]
    compound = Compound(parts, quat=pose[3:], name=name, fixed=True)
    return replace(compound, pos=pose[:3] + rotation_matrices(pose[3:]) @ compound.centroid)


def _size(compound: Compound, mass: MassProperties) -> float:
    return float(np.abs(mass.centre).max() + compound.dimensions.max())
