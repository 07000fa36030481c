"""Make bodies of a scene from masses and geoms of a model, in other frames."""

from __future__ import annotations

from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from physics.mass.inertia import MassProperties, block_moments, ellipsoid_moments
from physics.mass.polyhedron import convex_hull
from physics.rotations import rotation_matrices
from physics.scene.bodies import Block, Body, Ellipsoid, Hull, Sphere

# Inertia of the uniform body, and a geom at the centre of mass, to rounding of a text and of rotations there and back.
UNIFORM = 1e-12
# Likewise of meshes, whose corners MuJoCo keeps in single precision.
UNIFORM_HULL = 1e-6


class Placed(NamedTuple):
    """A geom of a free body, and the body's mass, both in the frame of the model's body.

    Attributes
    ----------
    kind : str
        "box", "sphere", "ellipsoid" or "mesh".
    shape : (3,) or (n, 3) float64
        Half edges, semi-axes or the radius three times; or points of a mesh from `pos` on [m].
    pos : (3,) float64
        Centre of the geom [m]. Its axes are the body's.
    mass : MassProperties
    """

    kind: str
    shape: np.ndarray
    pos: np.ndarray
    mass: MassProperties


def make_body(placed: Placed, pose: np.ndarray, velocity: np.ndarray, name: str | None) -> Body:
    """Body of a scene: its frame has the axes of the model's body, and its origin at the centre of mass.

    Parameters
    ----------
    placed : Placed
    pose : (7,) float64
        Origin [m] and unit quaternion of the model's body in the world.
    velocity : (6,) float64
        Velocity of that origin in the world [m/s], and angular velocity in the body's frame [rad/s].
    name : str, optional

    Raises
    ------
    ValueError
        The scene has no such body.
    """
    R, centre = rotation_matrices(pose[3:]), placed.mass.centre
    start = {
        "pos": pose[:3] + R @ centre,
        "quat": pose[3:],
        "linvel": velocity[:3] + R @ np.cross(velocity[3:], centre),
        "angvel": R @ velocity[3:],
        "name": name,
    }
    if placed.kind == "mesh":
        return _hull(placed, start)
    return _convex(placed, start)


def _convex(placed: Placed, start: dict[str, Any]) -> Body:
    """Make a box, sphere or ellipsoid; its inertia is stated if it is not that of uniform density."""
    half, mass, arm = placed.shape, placed.mass.mass, placed.pos - placed.mass.centre
    moments = block_moments(2 * half, mass) if placed.kind == "box" else ellipsoid_moments(half, mass)
    is_uniform = _is_near(placed.mass.inertia, np.diag(moments), UNIFORM)
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
    return Ellipsoid(tuple(half), mass, **start)


def _is_rounding(arm: np.ndarray, placed: Placed) -> bool:
    """True if a geom is at the centre of mass, to rounding of its place and size."""
    return bool(np.abs(arm).max() <= UNIFORM * max(np.abs(placed.pos).max(), placed.shape.max()))


def _hull(placed: Placed, start: dict[str, Any]) -> Body:
    """Make the convex hull of points; its own centre of mass must be the body's."""
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
    if _is_near(placed.mass.inertia, hull.inertia, UNIFORM_HULL):
        return hull
    return Hull(points, mass, **start, inertia_body=placed.mass.inertia)


@lru_cache(maxsize=64)
def _hull_fault(points: tuple) -> str:
    """Reason why points have no hull here, else empty; the result is cached, since bodies share their mesh."""
    try:
        convex_hull(points)
    except ValueError as error:
        return str(error)
    return ""


def _is_near(tensor: np.ndarray, uniform: np.ndarray, share: float) -> bool:
    return bool(np.abs(tensor - uniform).max() <= share * np.diag(uniform).max())
