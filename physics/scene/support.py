"""Support functions of bodies: how far they reach along a direction."""

from __future__ import annotations

import numpy as np

from physics.scene.bodies import Body, Hull
from physics.scene.compound import Compound


def support(body: Body, direction: np.ndarray) -> np.ndarray:
    """Support function (...) [m] of a body about its geometric centre, for unit vectors (..., 3) in the body frame."""
    if isinstance(body, Compound):
        each = [direction @ placed.place + support(placed.part, direction @ placed.R) for placed in body.placed_parts]
        return np.max(each, axis=0)
    if isinstance(body, Hull):
        return (direction @ body.polyhedron.vertices.T).max(axis=-1)
    if body.kind == "capsule":
        radius, reach = body.dimensions[:2]
        return (reach - radius) * np.abs(direction[..., 1]) + radius
    if body.kind == "cylinder":
        radius, half = body.dimensions[:2]
        return half * np.abs(direction[..., 1]) + radius * np.hypot(direction[..., 0], direction[..., 2])
    scaled = direction * body.dimensions
    if body.kind == "block":
        return np.abs(scaled).sum(axis=-1)
    return np.linalg.norm(scaled, axis=-1)
