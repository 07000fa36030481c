"""Convex meshes of bodies in the body frame: block, sphere, ellipsoid, capsule, cylinder, hull."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from itertools import pairwise
from operator import itemgetter

import numpy as np

CYLINDER_SIDES = 48
"""Sides of the prism that stands for a cylinder: a multiple of 4, so that octants end at sides."""

SPHERE_SUBDIVISIONS = 12
"""Subdivisions n of each edge of an octahedron's face, which becomes n² triangles; with 12 a sphere looks round."""

BLOCK_FACES = np.array(
    [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]],
)
"""Corners of the faces -x, +x, -y, +y, -z, +z; corner 4i + 2j + k has the signs 2(i, j, k) - 1."""


@dataclass(frozen=True, eq=False)
class Mesh:
    """Closed convex polyhedron.

    Parameters
    ----------
    vertices : (n, 3) float64
        [m], body frame.
    faces : (m, k) int
        Vertex indices of each face, counter-clockwise as seen from outside.
    normals : (m, 3) float64
        Outward unit normals, body frame.
    edges : (e, 4) int
        For each edge the indices of its two vertices, and of its two faces.
    is_smooth : bool
        True if it approximates a round body, of which only the silhouette is outlined.
    """

    vertices: np.ndarray
    faces: np.ndarray
    normals: np.ndarray
    edges: np.ndarray
    is_smooth: bool

    @cached_property
    def centres(self):
        """Means (m, 3) float64 of the faces' vertices, body frame [m]."""
        return self.vertices[self.faces].mean(axis=1)

    @cached_property
    def corner_getters(self):
        """Functions, one for each face, that pick the corners of the face from a list of all vertices."""
        return [itemgetter(*face) for face in self.faces.tolist()]

    @cached_property
    def is_odd_octant(self):
        """Flags (m,) bool of the faces in every second octant of the body frame."""
        return np.prod(self.centres, axis=1) < 0.0


def body_mesh(body):
    """Mesh of a `BodyView`, which is kept for other bodies of the same shape.

    Returns
    -------
    Mesh
    """
    if body.kind == "hull":
        return hull_mesh(tuple(map(tuple, body.corners.tolist())), body.faces)
    return _body_mesh(body.kind, tuple(body.dimensions.tolist()))


@lru_cache(maxsize=64)
def _body_mesh(kind, dimensions):
    if kind == "capsule":
        return capsule_mesh(dimensions)
    if kind == "cylinder":
        return cylinder_mesh(dimensions)
    return block_mesh(dimensions) if kind == "block" else ellipsoid_mesh(dimensions)


@lru_cache(maxsize=16)
def unit_mesh(kind, subdivisions=SPHERE_SUBDIVISIONS):
    """Mesh of unit size, to be stretched by a body's dimensions: a block with edges 1 ("block"), else `patched_sphere`.

    Returns
    -------
    Mesh
        The same object each time.
    """
    return block_mesh((1.0, 1.0, 1.0)) if kind == "block" else patched_sphere(subdivisions)


def block_mesh(size):
    """Mesh of a block with edges `size` (3,) [m] along the body axes; faces in the order -x, +x, -y, +y, -z, +z."""
    signs = np.array([[i, j, k] for i in (-1, 1) for j in (-1, 1) for k in (-1, 1)], dtype=np.float64)
    return _mesh(0.5 * signs * np.asarray(size, dtype=np.float64), BLOCK_FACES, is_smooth=False)


@lru_cache(maxsize=256)
def hull_mesh(corners, polygons):
    """Mesh of a convex polyhedron with `corners`, n tuples (x, y, z) [m], and `polygons`, tuples of corner indices.

    Each polygon is cut into a fan of triangles; sides between two triangles of a polygon are no edges.
    """
    faces, of_side = [], {}
    for polygon in polygons:
        for triangle in ((polygon[0], *pair) for pair in pairwise(polygon[1:])):
            of_side.update(dict.fromkeys(zip(triangle, (*triangle[1:], triangle[0])), len(faces)))
            faces.append(triangle)
    sides = [side for polygon in polygons for side in zip(polygon, (*polygon[1:], polygon[0])) if side[0] < side[1]]
    edges = np.array([(a, b, of_side[a, b], of_side[b, a]) for a, b in sides])
    mesh = _mesh(np.array(corners), np.array(faces), is_smooth=False)
    return replace(mesh, edges=edges)


def ellipsoid_mesh(semi_axes, subdivisions=SPHERE_SUBDIVISIONS):
    """Mesh of an ellipsoid with `semi_axes` (3,) [m] along the body axes: a subdivided octahedron, projected onto it.

    Every triangle lies in one octant, so that octants can be told apart by colour.
    """
    vertices, faces = _subdivided_octahedron(subdivisions, _triangles)
    vertices = vertices / np.linalg.norm(vertices, axis=1, keepdims=True)
    return _mesh(vertices * np.asarray(semi_axes, dtype=np.float64), faces, is_smooth=True)


def capsule_mesh(dimensions, subdivisions=SPHERE_SUBDIVISIONS):
    """Mesh of a capsule along body y with half extents `dimensions` (3,) [m]: `ellipsoid_mesh`, parted at y = 0.

    The halves of the sphere move to the ends. Between them are rings of triangles from each end to the middle, so that
    every triangle lies in one octant.
    """
    radius, half = dimensions[0], dimensions[1] - dimensions[0]
    ball = ellipsoid_mesh((radius, radius, radius), subdivisions)
    vertices, count = ball.vertices, len(ball.vertices)
    lift, is_upper_face = np.array([0.0, half, 0.0]), ball.centres[:, 1] > 0.0
    faces = np.where(is_upper_face[:, None], ball.faces, ball.faces + count)
    middle, sides = 2 * count, []
    for face in ball.faces[is_upper_face].tolist():
        for a, b in zip(face, face[1:] + face[:1]):
            if vertices[a, 1] == 0.0 == vertices[b, 1]:
                for high, low in ((0, middle), (middle, count)):
                    sides += [(b + high, a + high, a + low), (b + high, a + low, b + low)]
    return _used(np.concatenate([vertices + lift, vertices - lift, vertices]), np.concatenate([faces, sides]))


def cylinder_mesh(dimensions):
    """Mesh of a cylinder along body y with half extents `dimensions` (3,) [m]: a prism of `CYLINDER_SIDES` sides.

    The sides are parted at y = 0, and the ends are fans about their middles, so that every triangle lies in one octant.
    """
    radius, half, n = dimensions[0], dimensions[1], CYLINDER_SIDES
    angles = 2.0 * np.pi * np.arange(n) / n
    ring = radius * np.stack([np.cos(angles), np.zeros(n), np.sin(angles)], axis=1)
    rings = [ring + np.array([0.0, y, 0.0]) for y in (half, 0.0, -half)]
    top, bottom, faces = 3 * n, 3 * n + 1, []
    for k in range(n):
        j = (k + 1) % n
        faces += [(top, j, k), (bottom, 2 * n + k, 2 * n + j)]
        for high, low in ((0, n), (n, 2 * n)):
            faces += [(high + k, high + j, low + j), (high + k, low + j, low + k)]
    middles = np.array([[0.0, half, 0.0], [0.0, -half, 0.0]])
    return _mesh(np.concatenate([*rings, middles]), np.array(faces), is_smooth=True)


def _used(vertices, faces):
    """Smooth mesh of these faces with those of the vertices that they have."""
    used, faces = np.unique(faces, return_inverse=True)
    return _mesh(vertices[used], faces.reshape(-1, 3), is_smooth=True)


def patched_sphere(subdivisions):
    """Mesh of a sphere of radius 1, with the triangles of `ellipsoid_mesh` joined in pairs to quadrangles.

    It has half as many faces to draw. The corners of a quadrangle are nearly in a plane; its normal is perpendicular to
    both diagonals. A triangle without a partner has its last corner twice.

    Returns
    -------
    Mesh
    """
    vertices, faces = _subdivided_octahedron(subdivisions, _squares)
    vertices = vertices / np.linalg.norm(vertices, axis=1, keepdims=True)
    diagonals = vertices[faces[:, 2:]] - vertices[faces[:, :2]]
    normals = np.cross(diagonals[:, 0], diagonals[:, 1])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return Mesh(vertices, faces, normals, _edges(faces), is_smooth=True)


def _subdivided_octahedron(n, cells):
    """Vertices and faces of an octahedron whose faces are subdivided n times.

    Returns integer vertices with |x| + |y| + |z| = n, and faces as vertex indices. `cells` makes the cells of one
    octant: `_triangles` or `_squares`.
    """
    index, faces = {}, []

    def vertex(p):
        return index.setdefault(p, len(index))

    for sx in (-1, 1):
        for sy in (-1, 1):
            for sz in (-1, 1):
                is_mirrored = sx * sy * sz < 0
                for cell in cells(n):
                    corners = [vertex((sx * i, sy * j, sz * (n - i - j))) for i, j in cell]
                    faces.append(corners[::-1] if is_mirrored else corners)
    return np.array(list(index), dtype=np.float64), np.array(faces)


def _triangles(n):
    """Yield the triangles of the grid i + j ≤ n, i, j ≥ 0, counter-clockwise in the (i, j) plane."""
    for i in range(n):
        for j in range(n - i):
            yield (i, j), (i + 1, j), (i, j + 1)
            if i + j + 2 <= n:
                yield (i + 1, j), (i + 1, j + 1), (i, j + 1)


def _squares(n):
    """Yield the squares of the grid i + j ≤ n, i, j ≥ 0; along i + j = n, triangles with the last corner twice."""
    for i in range(n):
        for j in range(n - i):
            far = (i + 1, j + 1) if i + j + 2 <= n else (i, j + 1)
            yield (i, j), (i + 1, j), far, (i, j + 1)


def _mesh(vertices, faces, is_smooth):
    corners = vertices[faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return Mesh(vertices, faces, normals, _edges(faces), is_smooth)


def _edges(faces):
    sides = {}
    for face, corners in enumerate(faces.tolist()):
        for a, b in zip(corners, corners[1:] + corners[:1]):
            if a == b:
                continue
            sides.setdefault((min(a, b), max(a, b)), []).append(face)
    return np.array([[a, b, *pair] for (a, b), pair in sides.items()])
