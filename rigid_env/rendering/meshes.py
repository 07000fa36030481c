"""Convex meshes in the body frame: block, sphere, ellipsoid, hull."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from itertools import pairwise
from operator import itemgetter

import numpy as np

SPHERE_SUBDIVISIONS = 12
"""Subdivisions of an octahedron's face, which becomes their square in triangles (8 · 144 in all): round to the eye."""

BLOCK_FACES = np.array(
    [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]],
)
"""Corners of the faces -x, +x, -y, +y, -z, +z; corner 4i + 2j + k has the signs 2(i, j, k) - 1."""


@dataclass(frozen=True, eq=False)
class Mesh:
    """A closed convex polyhedron.

    Parameters
    ----------
    vertices : (n, 3) float64
        [m], body frame.
    faces : (m, k) int
        Vertex indices, counter-clockwise as seen from outside.
    normals : (m, 3) float64
        Outward unit normals, body frame.
    edges : (e, 4) int
        Columns: the two vertices, the two faces.
    is_smooth : bool
        Stands for a round body: only its silhouette is outlined.
    """

    vertices: np.ndarray
    faces: np.ndarray
    normals: np.ndarray
    edges: np.ndarray
    is_smooth: bool

    @cached_property
    def centres(self):
        """(m, 3) float64 [m]. Means of the faces' vertices, body frame."""
        return self.vertices[self.faces].mean(axis=1)

    @cached_property
    def corner_getters(self):
        """Functions that take the corners of each face out of a list of the vertices."""
        return [itemgetter(*face) for face in self.faces.tolist()]

    @cached_property
    def is_odd_octant(self):
        """Faces (m,) bool in every second octant of the body frame."""
        return np.prod(self.centres, axis=1) < 0.0


def body_mesh(body):
    """Mesh of a `BodyView`, made once for each shape.

    Returns
    -------
    Mesh
    """
    if body.kind == "hull":
        return hull_mesh(tuple(map(tuple, body.corners.tolist())), body.faces)
    return _body_mesh(body.kind, tuple(body.dimensions.tolist()))


@lru_cache(maxsize=64)
def _body_mesh(kind, dimensions):
    return block_mesh(dimensions) if kind == "block" else ellipsoid_mesh(dimensions)


@lru_cache(maxsize=16)
def unit_mesh(kind, subdivisions=SPHERE_SUBDIVISIONS):
    """Block with edges 1, or (`kind` is another) `patched_sphere`: a `Mesh` to be stretched by a body's dimensions.

    Returns
    -------
    Mesh
        The same object each time.
    """
    return block_mesh((1.0, 1.0, 1.0)) if kind == "block" else patched_sphere(subdivisions)


def block_mesh(size):
    """Block with edges `size` (3,) [m] along the body axes; faces in the order -x, +x, -y, +y, -z, +z."""
    signs = np.array([[i, j, k] for i in (-1, 1) for j in (-1, 1) for k in (-1, 1)], dtype=np.float64)
    return _mesh(0.5 * signs * np.asarray(size, dtype=np.float64), BLOCK_FACES, is_smooth=False)


@lru_cache(maxsize=256)
def hull_mesh(corners, polygons):
    """Convex polyhedron of `corners` (n tuples of 3) [m] with `polygons`, tuples of corners; see `BodyView`.

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
    """Ellipsoid with `semi_axes` (3,) [m] along the body axes: a subdivided octahedron blown up to a sphere.

    Every triangle lies in one octant, so that octants can be told apart by colour.
    """
    vertices, faces = _subdivided_octahedron(subdivisions, _triangles)
    vertices = vertices / np.linalg.norm(vertices, axis=1, keepdims=True)
    return _mesh(vertices * np.asarray(semi_axes, dtype=np.float64), faces, is_smooth=True)


def patched_sphere(subdivisions):
    """Sphere of radius 1 with the triangles of `ellipsoid_mesh` in pairs as quadrangles: half as many faces to draw.

    Their corners are nearly in a plane; the normal is that of the two diagonals. A triangle that is left alone has its
    last corner twice.

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
    """Integer vertices with |x| + |y| + |z| = n, and the faces between them: `_triangles` or `_squares`."""
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
    """Triangles of the grid i + j ≤ n, i, j ≥ 0, counter-clockwise in the (i, j) plane."""
    for i in range(n):
        for j in range(n - i):
            yield (i, j), (i + 1, j), (i, j + 1)
            if i + j + 2 <= n:
                yield (i + 1, j), (i + 1, j + 1), (i, j + 1)


def _squares(n):
    """Squares of the same grid; along i + j = n are triangles, with the last corner twice."""
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
