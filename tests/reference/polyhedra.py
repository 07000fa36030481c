"""Convex polyhedra, slowly: mass properties by an independent integral, separation by linear and quadratic programs."""

from __future__ import annotations

import itertools

import numpy as np
from scipy.optimize import linprog, nnls
from scipy.spatial import ConvexHull, Delaunay


def mass_properties(points: np.ndarray) -> tuple[float, np.ndarray, np.ndarray]:
    """Volume, centroid and the mean of r rᵀ about it of the convex hull of `points` (n, 3), uniform density.

    From the tetrahedra of a Delaunay triangulation, each with its own centroid c and vertices v_i: the mean of r rᵀ
    over one about its centroid is Σ (v_i - c)(v_i - c)ᵀ/20, moved to the common one by the parallel-axis theorem.
    """
    corners = points[Delaunay(points).simplices]
    volumes = np.abs(np.linalg.det(corners[:, 1:] - corners[:, :1])) / 6
    centres = corners.mean(axis=1)
    centroid = volumes @ centres / volumes.sum()
    about, off = corners - centres[:, None], centres - centroid
    second = np.einsum("t,tki,tkj->ij", volumes, about, about) / 20 + np.einsum("t,ti,tj->ij", volumes, off, off)
    return volumes.sum(), centroid, second / volumes.sum()


def distance(a: np.ndarray, b: np.ndarray) -> float:
    """Distance of the convex hulls of a (n, 3) and b (m, 3) [m]: 0 where they overlap.

    The shortest vector of their difference {Σ c_ij (a_i - b_j)}, by non-negative least squares: minimise
    |Σ c_k d_k|² + w² (Σ c_k - 1)², whose solution is a multiple of the shortest one for every w (Lawson and Hanson,
    *Solving Least Squares Problems*, 1974, chapter 23, "least distance programming").
    """
    d = (a[:, None] - b[None]).reshape(-1, 3)
    size = np.abs(d).max()
    shares, _ = nnls(np.vstack([d.T / size, np.ones(len(d))]), np.array([0.0, 0.0, 0.0, 1.0]))
    return float(np.linalg.norm(shares / shares.sum() @ d))


def largest_separation(a: np.ndarray, b: np.ndarray) -> float:
    """max over unit vectors n of min n·b - max n·a [m]: the distance, or minus the least depth where they overlap.

    Where they overlap: the difference b - a of the two hulls is a polytope around the origin, whose nearest face plane
    is the answer.
    """
    apart = distance(a, b)
    if apart > 1e-9 * np.abs(np.concatenate([a, b])).max():
        return apart
    d = (b[:, None] - a[None]).reshape(-1, 3)
    return float(ConvexHull(d).equations[:, 3].max())


def separation_along(n: np.ndarray, a: np.ndarray, b: np.ndarray) -> float:
    """min n·b - max n·a [m] for a unit vector n from a to b."""
    return float((b @ n).min() - (a @ n).max())


def nearest_point(points: np.ndarray, x: np.ndarray) -> tuple[np.ndarray, float]:
    """(nearest point of the surface of the convex hull, signed distance) of a point x (3,): negative inside."""
    equations = ConvexHull(points).equations
    heights = equations[:, :3] @ x + equations[:, 3]
    if heights.max() <= 0:
        k = heights.argmax()
        return x - heights[k] * equations[k, :3], float(heights[k])
    d = points - x
    size = np.abs(d).max()
    shares, _ = nnls(np.vstack([d.T / size, np.ones(len(d))]), np.array([0.0, 0.0, 0.0, 1.0]))
    y = shares / shares.sum() @ points
    return y, float(np.linalg.norm(y - x))


def is_inside(points: np.ndarray, x: np.ndarray, reach: float) -> bool:
    """Test whether x (3,) is in the convex hull of the points, or within `reach` of each of its planes [m]."""
    equations = ConvexHull(points).equations
    return bool((equations[:, :3] @ x + equations[:, 3]).max() <= reach)


def are_disjoint(a: np.ndarray, b: np.ndarray) -> bool:
    """Test whether a plane strictly separates two hulls: linear program for n, c with n·a <= c - 1, n·b >= c + 1."""
    rows = np.vstack([np.c_[a, -np.ones(len(a))], np.c_[-b, np.ones(len(b))]])
    found = linprog(np.zeros(4), A_ub=rows, b_ub=-np.ones(len(rows)), bounds=[(None, None)] * 4)
    return found.status == 0


def prism(corners: np.ndarray, width: float) -> np.ndarray:
    """(2 n, 3) corners of a prism over the polygon `corners` (n, 2), `width` [m] thick along z, z = 0 in its middle."""
    return np.array([(x, y, z) for z, (x, y) in itertools.product((-width / 2, width / 2), corners)])
