"""Convex hull of points as a polyhedron: corners, polygonal faces, edges, and mass properties.

Qhull (scipy.spatial) computes the hull as triangles. They are joined to polygons here: a face of two triangles has a
diagonal that is no edge, and triangles of one plane differ by rounding.

References
----------
.. [1] C. B. Barber, D. P. Dobkin, H. Huhdanpaa, *The Quickhull algorithm for convex hulls*, ACM Trans. Math. Softw. 22,
   1996.
.. [2] B. Mirtich, *Fast and accurate computation of polyhedral mass properties*, J. Graphics Tools 1, 1996 (the
   divergence theorem on faces; summed over tetrahedra here).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from physics.html_table import fields_table
from physics.summary import fields_repr

if TYPE_CHECKING:
    from scipy.spatial import ConvexHull

# Largest number of corners: names of contacts count a polygon's edges in 6 bits, and the narrow phase compares e² pairs
# of edges of two hulls with e edges each.
MOST_CORNERS = 64

# Triangles belong to one face if they lie within this share of the radius of one plane. This is a thousandth of the
# default `Accuracy.slop`, too little for any contact, and a million times the rounding of turned coordinates.
COPLANAR = 1e-9

# Rounding error of the sums for mass properties, relative to the largest: about two hundred terms of a few rounded
# products each. Smaller numbers are set to 0, so that a symmetric hull has its centre of mass and its axes exactly.
ROUNDING = 256 * np.finfo(float).eps


@dataclass(frozen=True, eq=False)
class Polyhedron:
    """Convex polyhedron of uniform density, in coordinates relative to its centre of mass.

    Attributes
    ----------
    centroid : (3,) float64
        Centre of mass in the coordinates of the points that the hull was made of [m].
    vertices : (v, 3) float64
        Corners relative to `centroid`, in the order of the points [m].
    normals : (f, 3) float64
        Outward unit normals of the faces.
    loops : tuple of f tuples of int
        Corners of each face, counter-clockwise as seen from outside.
    edges : (e, 4) int64
        First and last corner, the face on the left, whose loop goes along the edge in this direction, and the face on
        the right.
    volume : float
        Volume [m³].
    second_moment : (3, 3) float64
        Mean of r rᵀ over the volume, r relative to `centroid` [m²].
    """

    centroid: np.ndarray
    vertices: np.ndarray
    normals: np.ndarray
    loops: tuple[tuple[int, ...], ...]
    edges: np.ndarray
    volume: float
    second_moment: np.ndarray

    __repr__ = fields_repr
    _repr_html_ = fields_table

    @property
    def radius(self) -> float:
        """Radius of the bounding sphere about the centre of mass [m]."""
        return float(np.linalg.norm(self.vertices, axis=1).max())

    def inertia(self, mass: float) -> np.ndarray:
        """Inertia tensor (3, 3) about the centre of mass for this `mass` [kg], in kg m²."""
        S = self.second_moment
        return mass * (np.trace(S) * np.eye(3) - S)


@lru_cache(maxsize=4096)
def convex_hull(points: tuple[tuple[float, float, float], ...]) -> Polyhedron:
    """Make the convex hull of finite points [m] as a polyhedron; equal points give the same object.

    Raises
    ------
    ValueError
        There are fewer than four points, or all lie within `COPLANAR` of a plane, or so near a line that the moment of
        inertia about it is rounding; or the hull has more than `MOST_CORNERS` corners. The message names the reason.
    """
    if len(points) < 4:
        raise ValueError(f"points has {len(points)} of them; allowed are at least 4, not all in one plane")
    given = np.array(points)
    middle = 0.5 * (given.min(axis=0) + given.max(axis=0))
    size = float(np.abs(given - middle).max())
    scale = (
        2.0 ** math.ceil(math.log2(size)) if size > 0 else 1.0
    )  # exact: the hull of scaled points is the scaled hull
    local = (given - middle) / scale
    corners, loops = _polygons(local)
    about = local[corners]
    volume, first, _ = _moments(about, loops)
    centroid = _without_noise(first / volume, np.abs(about).max())
    about = about - centroid
    volume, _, second = _moments(about, loops)
    second = _second_moment(second / volume)
    return Polyhedron(
        _without_noise(middle + scale * centroid, size), scale * about, _normals(about, loops), loops,
        _edges(loops), scale**3 * volume, scale**2 * second,
    )  # fmt: skip


def _second_moment(found: np.ndarray) -> np.ndarray:
    """Clean a second moment (3, 3), the mean of r rᵀ: entries off the diagonal that are rounding errors become 0.

    ValueError if the moment of inertia about some axis is rounding: the points are nearly on a line.
    """
    size = np.abs(found).max()
    found = np.where(np.eye(3, dtype=bool), found, _without_noise(found, size))
    if not np.linalg.eigvalsh(np.trace(found) * np.eye(3) - found)[0] > ROUNDING * size:
        raise ValueError("points lie on one line, or nearly; allowed are points that span a volume")
    return found


def _without_noise(values: np.ndarray, size: float) -> np.ndarray:
    return np.where(np.abs(values) <= ROUNDING * size, 0.0, values)


def _polygons(points: np.ndarray) -> tuple[np.ndarray, tuple[tuple[int, ...], ...]]:
    """Convex hull of points (n, 3): the indices (v,) of the points that are corners, and the faces.

    A face is a loop of numbers of corners, counter-clockwise as seen from outside.
    """
    from scipy.spatial import ConvexHull, QhullError  # a quarter of a second, for those who have a hull

    flat = ValueError("points lie in one plane, or nearly; allowed are points that span a volume")
    try:
        hull = ConvexHull(points)
    except QhullError:
        raise flat from None
    faces = _faces(points, hull)
    loops = [_around(points, sorted({int(k) for t in face for k in hull.simplices[t]}), hull, face) for face in faces]
    # Rounding may leave a point on an edge in the loop of one face but not of the other: a corner is in three or more.
    met = np.bincount([k for loop in loops for k in loop], minlength=len(points))
    loops = [[k for k in loop if met[k] >= 3] for loop in loops]
    corners = np.flatnonzero(met >= 3)
    if len(corners) > MOST_CORNERS:
        raise ValueError(f"points has a hull of {len(corners)} corners; allowed are at most {MOST_CORNERS}")
    sides = [side for loop in loops for side in zip(loop, loop[1:] + loop[:1])]
    is_closed = len(set(sides)) == len(sides) and {(b, a) for a, b in sides} == set(sides)
    if len(faces) < 4 or min(map(len, loops)) < 3 or not is_closed or len(corners) + len(loops) != len(sides) // 2 + 2:
        raise flat
    place = np.zeros(len(points), dtype=int)
    place[corners] = np.arange(len(corners))
    return corners, tuple(tuple(int(place[k]) for k in loop) for loop in loops)


def _faces(points: np.ndarray, hull: ConvexHull) -> list[list[int]]:
    """Join the triangles of a Qhull result to faces: lists of indices of triangles.

    A face holds connected triangles within `COPLANAR` of the plane of the largest of them.
    """
    areas = np.linalg.norm(_area_vectors(points[hull.simplices]), axis=1)
    reach = COPLANAR * np.linalg.norm(points, axis=1).max()
    is_free, faces = np.ones(len(areas), dtype=bool), []
    for seed in np.argsort(-areas, kind="stable"):
        if not is_free[seed]:
            continue
        heights = np.abs(points @ hull.equations[seed, :3] + hull.equations[seed, 3])
        face, is_free[seed] = [int(seed)], False
        for t in face:
            for n in hull.neighbors[t]:
                if is_free[n] and heights[hull.simplices[n]].max() <= reach:
                    is_free[n] = False
                    face.append(int(n))
        faces.append(face)
    return faces


def _area_vectors(corners: np.ndarray) -> np.ndarray:
    """Normals (t, 3) of triangles with `corners` (t, 3, 3), with twice their areas as lengths."""
    return np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])


def _around(points: np.ndarray, members: list[int], hull: ConvexHull, face: list[int]) -> list[int]:
    """Corners of a face, as indices into `points`: counter-clockwise as seen from outside, the least index first.

    `members` are the indices of all points of the face, some of which may lie on its edges. `hull` is Qhull's result,
    and `face` lists the numbers of its triangles that form the face.
    """
    from scipy.spatial import ConvexHull

    normal = hull.equations[face[0], :3]
    x = np.eye(3)[np.argmin(np.abs(normal))]
    x = np.cross(normal, x)
    plane = points[members] @ np.column_stack([x, np.cross(normal, x)])
    loop = [members[k] for k in ConvexHull(plane).vertices]  # in two dimensions Qhull gives them in this order
    start = loop.index(min(loop))
    return loop[start:] + loop[:start]


def _normals(vertices: np.ndarray, loops) -> np.ndarray:
    """Outward unit normals (f, 3) of polygons, from their area vectors (Newell's method), which use all corners."""
    normals = np.empty((len(loops), 3))
    for f, loop in enumerate(loops):
        r = vertices[list(loop)] - vertices[loop[0]]
        area = np.cross(r[1:-1], r[2:]).sum(axis=0)
        normals[f] = area / np.linalg.norm(area)
    return normals


def _edges(loops) -> np.ndarray:
    left = {side: f for f, loop in enumerate(loops) for side in zip(loop, loop[1:] + loop[:1])}
    return np.array([(a, b, f, left[b, a]) for (a, b), f in left.items() if a < b])


def _moments(vertices: np.ndarray, loops) -> tuple[float, np.ndarray, np.ndarray]:
    """Volume of a polyhedron, and the integrals of r and r rᵀ over it.

    They are sums over signed tetrahedra from the origin to triangles of the faces. A tetrahedron (0, a, b, c) has the
    volume D/6 with D = a·(b x c). The mean of r over it is s/4 with s = a + b + c, and the mean of r rᵀ is
    (s sᵀ + a aᵀ + b bᵀ + c cᵀ)/20.
    """
    corners = np.array([vertices[[loop[0], *pair]] for loop in loops for pair in pairwise(loop[1:])])
    volumes = np.einsum("ti,ti->t", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) / 6
    total = corners.sum(axis=1)
    first = volumes @ total / 4
    second = np.einsum("t,ti,tj->ij", volumes, total, total) + np.einsum("t,tki,tkj->ij", volumes, corners, corners)
    return float(volumes.sum()), first, second / 20
