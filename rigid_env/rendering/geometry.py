"""Geometry of vectors and convex shapes: rotations, clipping, convex hulls."""

from __future__ import annotations

import numpy as np


def quaternion_product(p, q):
    """Quaternion (4,), w first, of the rotation q followed by p."""
    a, b, c, d = p.tolist()
    return np.array(((a, -b, -c, -d), (b, a, -d, c), (c, d, a, -b), (d, -c, b, a))) @ q


def rotation_matrix(quat):
    """Rotation matrix of a quaternion.

    Parameters
    ----------
    quat : (4,) float
        w, x, y, z, body to world; normalised here, so that drift does not shear the picture.

    Returns
    -------
    (3, 3) float64
        Columns are the body's axes in the world frame.
    """
    w, x, y, z = np.asarray(quat, dtype=np.float64) / np.linalg.norm(quat)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def rotation_matrices(quats):
    """Rotation matrices of many quaternions at once.

    Parameters
    ----------
    quats : (n, 4) float
        w, x, y, z, body to world; normalised here. `rotation_matrix` shows the formula.

    Returns
    -------
    (n, 3, 3) float64
    """
    q = np.asarray(quats, dtype=np.float64)
    products = q[:, _FIRST] * q[:, _SECOND] / np.sum(q * q, axis=1)[:, None]
    return (products @ _ROTATION).reshape(-1, 3, 3)


_FIRST, _SECOND = np.triu_indices(4)
"""Index pairs of a quaternion's entries, each pair once: ww, wx, wy, wz, xx, xy, xz, yy, yz, zz."""

_ROTATION = np.array(
    [
        [1, 0, 0, 0, 1, 0, 0, 0, 1],  # ww
        [0, 0, 0, 0, 0, -2, 0, 2, 0],  # wx
        [0, 0, 2, 0, 0, 0, -2, 0, 0],  # wy
        [0, -2, 0, 2, 0, 0, 0, 0, 0],  # wz
        [1, 0, 0, 0, -1, 0, 0, 0, -1],  # xx
        [0, 2, 0, 2, 0, 0, 0, 0, 0],  # xy
        [0, 0, 2, 0, 0, 0, 2, 0, 0],  # xz
        [-1, 0, 0, 0, 1, 0, 0, 0, -1],  # yy
        [0, 0, 0, 0, 0, 2, 0, 2, 0],  # yz
        [-1, 0, 0, 0, -1, 0, 0, 0, 1],  # zz
    ],
    dtype=np.float64,
)
"""Coefficients (10, 9) of the rotation matrix: entry j, row by row, is the sum over products i of coefficient (i, j).

The products are those of the index pairs above, in their order."""


def unit_vectors(vectors):
    """Vectors (..., 3) divided by their lengths."""
    return vectors / np.sqrt(np.sum(vectors * vectors, axis=-1, keepdims=True))


def cross(a, b):
    """Cross products (n, 3) of vectors (n, 3); for few vectors three times as fast as `numpy.cross`."""
    return a[:, _NEXT] * b[:, _PREVIOUS] - a[:, _PREVIOUS] * b[:, _NEXT]


def perpendiculars(axes):
    """Two unit vectors u, v, (n, 3) each, perpendicular to each of the axes (n, 3), with u × v along the axis."""
    axes = unit_vectors(axes)
    u = unit_vectors(cross(np.eye(3)[np.argmin(np.abs(axes), axis=1)], axes))
    return u, cross(axes, u)


_NEXT, _PREVIOUS = [1, 2, 0], [2, 0, 1]


def plane_axes(normal):
    """Two unit vectors u, v that span the plane of a unit normal, with u × v = normal.

    Parameters
    ----------
    normal : (3,) float

    Returns
    -------
    u, v : (3,) float64
    """
    normal = np.asarray(normal, dtype=np.float64)
    least = np.zeros(3)
    least[np.argmin(np.abs(normal))] = 1.0
    u = np.cross(least, normal)
    u /= np.linalg.norm(u)
    return u, np.cross(normal, u)


def clip_polygon(polygon, normal, offset):
    """Clip a convex polygon to the half-space normal·x ≥ offset (Sutherland and Hodgman 1974).

    Parameters
    ----------
    polygon : (n, d) float
        Vertices in order; two of them make a segment.
    normal : (d,) float
    offset : float

    Returns
    -------
    (k, d) float64
        Vertices of the part in the half-space, in the same order; k = 0 if nothing is left.
    """
    polygon = np.asarray(polygon, dtype=np.float64)
    heights = polygon @ np.asarray(normal, dtype=np.float64) - offset
    if np.all(heights >= 0.0):
        return polygon
    kept = []
    count = len(polygon)
    for i in range(count):
        j = (i + 1) % count
        if heights[i] >= 0.0:
            kept.append(polygon[i])
        is_last_of_segment = count == 2 and i == 1
        if (heights[i] >= 0.0) != (heights[j] >= 0.0) and not is_last_of_segment:
            s = heights[i] / (heights[i] - heights[j])
            kept.append(polygon[i] + s * (polygon[j] - polygon[i]))
    return np.array(kept).reshape(-1, polygon.shape[1])


def point_lists(polygons):
    """Yield polygons as lists of points, one at a time.

    Lists of all polygons at once would have so many objects that Python's garbage collector would run for longer than
    it takes to draw a picture.

    Parameters
    ----------
    polygons : (n, k, 2) int or float

    Yields
    ------
    list of k (x, y)
    """
    count = polygons.shape[1]
    x, y = polygons[..., 0].ravel().tolist(), polygons[..., 1].ravel().tolist()
    for first in range(0, len(x), count):
        last = first + count
        yield list(zip(x[first:last], y[first:last]))


def convex_hull(points):
    """Convex hull of points in the plane (Andrew's monotone chain, 1979).

    Parameters
    ----------
    points : (n, 2) float

    Returns
    -------
    (k, 2) float64
        Corners counter-clockwise, without collinear points.
    """
    ordered = sorted(map(tuple, np.asarray(points, dtype=np.float64).tolist()))
    return np.array(_chain(ordered)[:-1] + _chain(ordered[::-1])[:-1])


def _chain(ordered):
    chain = []
    for p in ordered:
        while len(chain) > 1 and _turn(chain[-2], chain[-1], p) <= 0.0:
            chain.pop()
        chain.append(p)
    return chain


def _turn(a, b, c):
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
