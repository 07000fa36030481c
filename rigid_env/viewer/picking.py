"""Rays against bodies: the point of a click, and the point at which an arrow leaves a body."""

from __future__ import annotations

import numpy as np

from rigid_env.rendering import BodyView
from rigid_env.rendering.geometry import rotation_matrix
from rigid_env.rendering.meshes import hull_mesh


def body_point(body: BodyView, point) -> np.ndarray:
    """Point (3,) [m] of the world in a body's frame, from `BodyView.pos`."""
    return (np.asarray(point, dtype=float) - body.pos) @ rotation_matrix(body.quat)


def world_point(body: BodyView, point_body) -> np.ndarray:
    """Point (3,) [m] of a body's frame, from `BodyView.pos`, in the world."""
    return body.pos + rotation_matrix(body.quat) @ np.asarray(point_body, dtype=float)


def hit(body: BodyView, origin, direction) -> np.ndarray | None:
    """Point (3,) [m] where a ray enters a body, or leaves it where it starts inside; None where it misses.

    Parameters
    ----------
    body : BodyView
    origin, direction : (3,) float
        World frame [m]; the direction has any length.
    """
    origin, direction = np.asarray(origin, dtype=float), np.asarray(direction, dtype=float)
    inside = _stay(body, body_point(body, origin), direction @ rotation_matrix(body.quat))
    if inside is None or inside[1] < 0.0:
        return None
    return origin + (inside[0] if inside[0] >= 0.0 else inside[1]) * direction


def leave(body: BodyView, direction) -> np.ndarray:
    """Point (3,) [m] where a ray from the middle of a body leaves it; the middle for a direction of no length."""
    found = hit(body, body.pos, direction) if np.any(direction) else None
    return body.pos if found is None else found


def _stay(body: BodyView, origin, direction):
    """First and last s for which origin + s direction is in a body, in its frame; None where there is none."""
    if body.kind in ("sphere", "ellipsoid"):
        return _stay_in_ball(origin / body.dimensions, direction / body.dimensions)
    normals, offsets = _planes(body)
    speed, room = normals @ direction, offsets - normals @ origin
    if np.any(room[speed == 0.0] < 0.0):
        return None
    bound = room[speed != 0.0] / speed[speed != 0.0]
    is_entry = speed[speed != 0.0] < 0.0
    first, last = bound[is_entry].max(initial=-np.inf), bound[~is_entry].min(initial=np.inf)
    return (first, last) if first <= last else None


def _stay_in_ball(origin, direction):
    """Roots s of |origin + s direction|² = 1."""
    a, b, c = direction @ direction, origin @ direction, origin @ origin - 1.0
    root = b * b - a * c
    if root < 0.0 or a == 0.0:
        return None
    return (-b - np.sqrt(root)) / a, (-b + np.sqrt(root)) / a


def _planes(body: BodyView):
    """Outward normals (m, 3) and offsets (m,) [m] of the faces of a block or a hull, body frame."""
    if body.kind == "block":
        return np.concatenate([np.eye(3), -np.eye(3)]), 0.5 * np.concatenate([body.dimensions, body.dimensions])
    mesh = hull_mesh(tuple(map(tuple, body.corners.tolist())), body.faces)
    return mesh.normals, np.sum(mesh.normals * mesh.vertices[mesh.faces[:, 0]], axis=1)
