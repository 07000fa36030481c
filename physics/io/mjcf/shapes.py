"""Conversion of a model's geoms and masses, in the frames of the model's bodies, to bodies of a scene."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from physics.mass.inertia import MassProperties, block_moments, capsule_moments, cylinder_moments, ellipsoid_moments
from physics.mass.polyhedron import convex_hull
from physics.rotations import rotation_matrices
from physics.scene.bodies import Block, Body, Ellipsoid, Hull, Sphere
from physics.scene.capsule import Capsule
from physics.scene.cylinder import Cylinder

# Share to which an inertia counts as that of uniform density, and a geom as at the centre of mass: the rounding errors
# of a text, and of rotations there and back.
UNIFORM = 1e-12
# The same for meshes, whose corners MuJoCo keeps in single precision.
UNIFORM_HULL = 1e-6


class Placed(NamedTuple):
    """Geom of a free body, and the body's mass properties, in the frame of the model's body.

    Attributes
    ----------
    kind : str
        Kind of the geom: "box", "sphere", "ellipsoid", "capsule", "cylinder" or "mesh".
    shape : (3,) or (n, 3) float64
        Half edges, semi-axes, half extents, or three times the radius [m]. Of a mesh its points relative to `pos` [m].
    pos : (3,) float64
        Centre of the geom [m]. Its axes are those of the body; the axis of a capsule or cylinder is body y.
    mass : MassProperties
        Mass, centre of mass and inertia of the body.
    """

    kind: str
    shape: np.ndarray
    pos: np.ndarray
    mass: MassProperties


def make_body(placed: Placed, pose: np.ndarray, velocity: np.ndarray, name: str | None) -> Body:
    """Make a body of a scene; its frame has the axes of the model's body, and its origin at the centre of mass.

    Parameters
    ----------
    placed : Placed
        Geom and mass properties of the model's body.
    pose : (7,) float64
        Origin [m] and unit quaternion of the model's body in the world.
    velocity : (6,) float64
        Velocity of that origin in the world frame [m/s], and angular velocity in the body's frame [rad/s].
    name : str, optional
        Name of the body.

    Raises
    ------
    ValueError
        A scene cannot hold such a body; the message names the reason.
    """
    start = start_of(placed.mass, pose, velocity, name)
    if placed.kind == "mesh":
        return _hull(placed, start)
    return _convex(placed, start)


def start_of(mass: MassProperties, pose: np.ndarray, velocity: np.ndarray, name: str | None) -> dict[str, Any]:
    """Start of a body of a scene, and its name; `mass` has the centre of mass. Arguments are those of `make_body`."""
    R = rotation_matrices(pose[3:])
    return {
        "pos": pose[:3] + R @ mass.centre,
        "quat": pose[3:],
        "linvel": velocity[:3] + R @ np.cross(velocity[3:], mass.centre),
        "angvel": R @ velocity[3:],
        "name": name,
    }


def make_fixed(kind: str, shape: np.ndarray, pose: np.ndarray, name: str | None) -> Body:
    """Make a fixed body from a geom of the world; arguments as of `make_body`, with `shape` as in `Placed`.

    The points of a mesh are relative to the origin of `pose`.
    """
    return make_part(kind, shape, pose[:3], pose[3:], {"name": name, "fixed": True})


def make_part(kind: str, shape: np.ndarray, pos: np.ndarray, quat: np.ndarray, given: dict[str, Any]) -> Body:
    """Make a body of a geom of uniform density at `pos` [m], of attitude `quat`, with other arguments `given`.

    `shape` is as in `Placed`; the points of a mesh are relative to `pos`, along the axes of `quat`.
    """
    start: dict[str, Any] = {"quat": quat, **given}
    if kind == "mesh":
        fault = _hull_fault(points := tuple(map(tuple, shape.tolist())))
        if fault:
            raise ValueError(fault)
        hull = Hull(points, **start)
        return replace(hull, pos=pos + rotation_matrices(quat) @ hull.centroid)
    start["pos"] = pos
    if kind == "box":
        return Block(tuple(2 * shape), **start)
    if kind == "capsule":
        return Capsule(float(shape[0]), 2 * float(shape[1] - shape[0]), **start)
    if kind == "cylinder":
        return Cylinder(float(shape[0]), 2 * float(shape[1]), **start)
    return Sphere(float(shape[0]), **start) if kind == "sphere" else Ellipsoid(tuple(shape), **start)


def uniform_moments(kind: str, shape: np.ndarray, mass: float) -> np.ndarray:
    """Principal moments (3,) [kg m²] of a geom other than a mesh, of uniform density."""
    if kind == "box":
        return block_moments(2 * shape, mass)
    if kind == "cylinder":
        return cylinder_moments(shape, mass)
    return capsule_moments(shape, mass) if kind == "capsule" else ellipsoid_moments(shape, mass)


def _convex(placed: Placed, start: dict[str, Any]) -> Body:
    """Make a body that is no hull; `inertia_body` is given if the inertia is not that of uniform density."""
    half, mass, arm = placed.shape, placed.mass.mass, placed.pos - placed.mass.centre
    is_uniform = is_near(placed.mass.inertia, np.diag(uniform_moments(placed.kind, half, mass)), UNIFORM)
    if (is_uniform or placed.kind != "box") and _is_rounding(arm, placed):
        arm = np.zeros(3)
    if arm.any() or not is_uniform:
        start = {**start, "inertia_body": placed.mass.inertia}
    if placed.kind == "box":
        return Block(tuple(2 * half), mass, center=arm, **start)
    if arm.any():
        raise ValueError(f"its {placed.kind} is {arm.tolist()} m from the centre of mass; allowed is that of a box")
    if placed.kind == "sphere":
        return Sphere(float(half[0]), mass, **start)
    if placed.kind == "capsule":
        return Capsule(float(half[0]), 2 * float(half[1] - half[0]), mass, **start)
    if placed.kind == "cylinder":
        return Cylinder(float(half[0]), 2 * float(half[1]), mass, **start)
    return Ellipsoid(tuple(half), mass, **start)


def _is_rounding(arm: np.ndarray, placed: Placed) -> bool:
    """True if `arm`, from the centre of mass to a geom, is zero up to rounding of the geom's place and size."""
    return bool(np.abs(arm).max() <= UNIFORM * max(np.abs(placed.pos).max(), placed.shape.max()))


def _hull(placed: Placed, start: dict[str, Any]) -> Body:
    """Make a hull. ValueError if the body's centre of mass is not the centroid of the hull."""
    mass, points = placed.mass.mass, tuple(map(tuple, (placed.pos + placed.shape).tolist()))
    fault = _hull_fault(points)
    if fault:
        raise ValueError(fault)
    hull = Hull(points, mass, **start)
    away = np.array(hull.centroid) - placed.mass.centre
    if np.abs(away).max() > UNIFORM_HULL * np.abs(placed.pos + placed.shape).max():
        raise ValueError(
            f"the centre of mass of its mesh's convex hull is {away.tolist()} m from that of the body; allowed is a "
            "convex mesh of uniform density"
        )
    if is_near(placed.mass.inertia, hull.inertia, UNIFORM_HULL):
        return hull
    return Hull(points, mass, **start, inertia_body=placed.mass.inertia)


@lru_cache(maxsize=64)
def _hull_fault(points: tuple) -> str:
    """Message of `convex_hull` about points that it refuses, else ""; cached, since several bodies may share a mesh."""
    try:
        convex_hull(points)
    except ValueError as error:
        return str(error)
    return ""


def is_near(tensor: np.ndarray, uniform: np.ndarray, share: float) -> bool:
    """True if two inertia tensors differ by at most `share` of the largest moment of `uniform`."""
    return bool(np.abs(tensor - uniform).max() <= share * np.diag(uniform).max())
