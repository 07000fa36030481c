"""Shapes of bodies for the viewer: triangles with rims or octants in two shades, and intersections with rays."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from rigid_env.rendering import BodyView
from rigid_env.rendering.bodies import EDGE_LIGHTENING
from rigid_env.rendering.geometry import rotation_matrix
from rigid_env.rendering.meshes import (
    BLOCK_FACES,
    Mesh,
    block_mesh,
    capsule_mesh,
    cylinder_mesh,
    ellipsoid_mesh,
    hull_mesh,
)
from rigid_env.rendering.solids import OCTANT_LIGHTENING

SUBDIVISIONS = 10
"""Subdivisions of each octant of a round body's mesh."""

RIM_SHARE = 0.035
"""Width of a rim, as a share of the distance from a face's corner to its middle."""

RIM_LIFT = 1.002
"""Size of a rim relative to its body: slightly larger, so that it is drawn on top."""


@dataclass(frozen=True, eq=False)
class Part:
    """Part of a body's surface: triangles of one colour.

    Parameters
    ----------
    vertices : (v, 3) float32
        Corners, body frame: of a hull, capsule or cylinder in [m], of other shapes to be multiplied by the body's
        dimensions.
    faces : (f, 3) uint32
        Indices of each triangle's corners, counter-clockwise as seen from outside.
    lightening : float
        Share of white that is mixed with the body's colour.
    is_flat : bool
        Whether faces are shaded flat; False: they approximate a round surface.
    is_rim : bool
        Whether it lies on another part and casts no shadow.
    """

    vertices: np.ndarray
    faces: np.ndarray
    lightening: float = 0.0
    is_flat: bool = True
    is_rim: bool = False


def shape_key(body: BodyView):
    """Hashable key of a body's shape; bodies with equal keys have the same parts."""
    if body.kind == "hull":
        return body.corners.tobytes(), body.faces
    if body.kind in ("capsule", "cylinder"):
        return body.kind, tuple(body.dimensions.tolist())
    return "block" if body.kind == "block" else "round"


@lru_cache(maxsize=256)
def parts(key) -> tuple[Part, ...]:
    """Parts of all bodies with a key from `shape_key`."""
    if key == "block":
        mesh = block_mesh((1.0, 1.0, 1.0))
        return solid(mesh), rim(mesh.vertices, BLOCK_FACES.tolist())
    if key == "round":
        return octants()
    if key[0] == "capsule":
        return octants(capsule_mesh(key[1], SUBDIVISIONS))
    if key[0] == "cylinder":
        return octants(cylinder_mesh(key[1]), is_flat=True)
    corners, polygons = np.frombuffer(key[0]).reshape(-1, 3), key[1]
    return solid(hull_mesh(tuple(map(tuple, corners.tolist())), polygons)), rim(corners, polygons)


def solid(mesh: Mesh) -> Part:
    """Whole surface of a polyhedron as one part."""
    return Part(mesh.vertices.astype(np.float32), _triangles(mesh.faces))


def octants(mesh: Mesh | None = None, is_flat: bool = False) -> tuple[Part, Part]:
    """Octants of a round body in two parts: every second octant is lighter, which makes rotation visible.

    Without a mesh the body is a sphere of radius 1. `is_flat` is that of the parts.
    """
    if mesh is None:
        mesh = ellipsoid_mesh((1.0, 1.0, 1.0), SUBDIVISIONS)
    sides = []
    for is_odd in (False, True):
        used, faces = np.unique(mesh.faces[mesh.is_odd_octant == is_odd], return_inverse=True)
        vertices = mesh.vertices[used].astype(np.float32)
        lightening = OCTANT_LIGHTENING if is_odd else 0.0
        sides.append(Part(vertices, faces.reshape(-1, 3).astype(np.uint32), lightening, is_flat))
    return tuple(sides)


def rim(corners, polygons: Sequence[Sequence[int]], share: float = RIM_SHARE, lift: float = RIM_LIFT) -> Part:
    """Part with a ring along the edges of each face of a convex polyhedron that contains the origin.

    Parameters
    ----------
    corners : (n, 3) float
        Corners of the polyhedron.
    polygons : sequence of sequences of int
        Indices of the corners of each face, counter-clockwise.
    share : float
        Width of the ring, as a share of the distance from each corner to the mean of the face's corners.
    lift : float
        Factor by which all corners are moved away from the origin.
    """
    vertices, faces = [], []
    for polygon in polygons:
        outer = lift * np.asarray(corners)[list(polygon)]
        inner = outer + share * (outer.mean(axis=0) - outer)
        first, count = sum(map(len, vertices)), len(polygon)
        vertices += [outer, inner]
        for i in range(count):
            j = (i + 1) % count
            a, b, c, d = first + i, first + j, first + count + j, first + count + i
            faces += [(a, b, c), (a, c, d)]
    return Part(
        np.concatenate(vertices).astype(np.float32), np.array(faces, dtype=np.uint32), EDGE_LIGHTENING, is_rim=True
    )


def _triangles(faces: np.ndarray) -> np.ndarray:
    """Triangles (m (k - 2), 3) uint32 of m faces with k corners each."""
    return np.concatenate([faces[:, [0, k, k + 1]] for k in range(1, faces.shape[1] - 1)]).astype(np.uint32)


# --- rays ----------------------------------------------------------------------------------------------------------


def body_point(body: BodyView, point) -> np.ndarray:
    """Convert a point (3,) of the world [m] to a body's frame with the origin `BodyView.pos`."""
    return (np.asarray(point, dtype=float) - body.pos) @ rotation_matrix(body.quat)


def world_point(body: BodyView, point_body) -> np.ndarray:
    """Convert a point (3,) of a body's frame with the origin `BodyView.pos` [m] to the world."""
    return body.pos + rotation_matrix(body.quat) @ np.asarray(point_body, dtype=float)


def hit(body: BodyView, origin, direction) -> np.ndarray | None:
    """Point (3,) where a ray enters a body, or leaves it if it starts inside; world frame [m]. None if it misses.

    Parameters
    ----------
    body : BodyView
    origin, direction : (3,) float
        Start of the ray [m], and its direction of any length, world frame.
    """
    origin, direction = np.asarray(origin, dtype=float), np.asarray(direction, dtype=float)
    spans = _spans(body, origin, direction)
    if not spans:
        return None
    return origin + min(first if first >= 0.0 else last for first, last in spans) * direction


def leave(body: BodyView, direction) -> np.ndarray:
    """Point (3,) [m] where a ray from the centre of a body leaves it for good; the centre if the ray has no length."""
    spans = _spans(body, body.pos, np.asarray(direction, dtype=float)) if np.any(direction) else []
    return body.pos + max(last for _, last in spans) * direction if spans else body.pos


def _spans(body: BodyView, origin, direction) -> list[tuple[float, float]]:
    """First and last s >= 0 for which origin + s direction is in each convex part of a body that the ray meets."""
    each = [_stay(s, body_point(s, origin), direction @ rotation_matrix(s.quat)) for s in body.solids]
    return [span for span in each if span is not None and span[1] >= 0.0]


def _stay(body: BodyView, origin, direction):
    """First and last s for which origin + s direction, in the body's frame, is in the body; None if there is no s."""
    if body.kind in ("sphere", "ellipsoid"):
        return _stay_in_ball(origin / body.dimensions, direction / body.dimensions)
    if body.kind == "capsule":
        return _stay_in_capsule(*body.dimensions[:2], origin, direction)
    if body.kind == "cylinder":
        return _stay_in_tube(*body.dimensions[:2], origin, direction)
    normals, offsets = _planes(body)
    speed, room = normals @ direction, offsets - normals @ origin
    if np.any(room[speed == 0.0] < 0.0):
        return None
    bound = room[speed != 0.0] / speed[speed != 0.0]
    is_entry = speed[speed != 0.0] < 0.0
    first, last = bound[is_entry].max(initial=-np.inf), bound[~is_entry].min(initial=np.inf)
    return (first, last) if first <= last else None


def _stay_in_ball(origin, direction):
    """Both roots s of |origin + s direction|² = 1; None if there are none."""
    a, b, c = direction @ direction, origin @ direction, origin @ origin - 1.0
    root = b * b - a * c
    if root < 0.0 or a == 0.0:
        return None
    return (-b - np.sqrt(root)) / a, (-b + np.sqrt(root)) / a


def _stay_in_capsule(radius: float, reach: float, origin, direction):
    """First and last s in a capsule along y: in one of the balls about its ends, or in the cylinder between them."""
    half = np.array([0.0, reach - radius, 0.0])
    found = [_stay_in_ball((origin + end) / radius, direction / radius) for end in (half, -half)]
    found.append(_stay_in_tube(radius, half[1], origin, direction))
    spans = [span for span in found if span is not None]
    return (min(first for first, _ in spans), max(last for _, last in spans)) if spans else None


def _stay_in_tube(radius: float, half: float, origin, direction):
    """First and last s in a cylinder along y, from -half to half: across the axis a ball, along it a slab."""
    across = np.array([1.0, 0.0, 1.0]) / radius
    span = _stay_in_ball(origin * across, direction * across)
    if span is None and not (direction * across).any() and (origin * across) @ (origin * across) <= 1.0:
        span = -np.inf, np.inf
    if span is not None and direction[1] != 0.0:
        sides = sorted((-origin[1] + end) / direction[1] for end in (half, -half))
        span = max(span[0], sides[0]), min(span[1], sides[1])
    elif abs(origin[1]) > half:
        return None
    return None if span is None or span[0] > span[1] else span


def _planes(body: BodyView):
    """Outward normals (m, 3) and offsets (m,) [m] of the face planes of a block or a hull, body frame."""
    if body.kind == "block":
        return np.concatenate([np.eye(3), -np.eye(3)]), 0.5 * np.concatenate([body.dimensions, body.dimensions])
    mesh = hull_mesh(tuple(map(tuple, body.corners.tolist())), body.faces)
    return mesh.normals, np.sum(mesh.normals * mesh.vertices[mesh.faces[:, 0]], axis=1)
