"""Support functions of block, sphere and ellipsoid, which give their gap to a wall and their contact points.

For a convex body with support function s(n) = max over its points r of n·r
(relative to its geometric centre x) the gap to the wall {x : n·x >= offset} is
n·x - offset - s(-n); all three shapes are symmetric, so s(-n) = s(n). With
e_k = dimension_k (R^T n)_k, s(n) is Σ|e_k| for a block and √Σe_k² for an ellipsoid.
The dimensions are half edges, semi-axes, or three times the radius of a sphere.
"""

from __future__ import annotations

import math

import numpy as np

from physics.compiler.decorators import inlined
from physics.compiler.simd import Lanes
from physics.kernels.math import quaternion as qt
from physics.kernels.state.layout import BLOCK, SPHERE, VERTEX_COUNT

# Signs of the coordinates of a block's vertices. Bit j of a vertex's number is set if it is on the + side of axis j.
VERTEX_SIGNS = np.array([[1.0 if vertex >> j & 1 else -1.0 for j in range(3)] for vertex in range(VERTEX_COUNT)])


@inlined
def scaled_normal(shape, dims, R, n):
    """Normal n in the body frame, times the dimensions: e_k = dimension_k (Rᵀ n)_k [m]; a sphere needs no rotation."""
    if shape == SPHERE:
        return (dims[0] * n[0], dims[0] * n[1], dims[0] * n[2])
    nb = qt.transposed_matvec(R, n)
    return (dims[0] * nb[0], dims[1] * nb[1], dims[2] * nb[2])


@inlined
def support(shape, dims, e):
    """Support function s(n) of a block, sphere or ellipsoid [m], from e = `scaled_normal` of n."""
    if shape == BLOCK:
        return abs(e[0]) + abs(e[1]) + abs(e[2])
    if shape == SPHERE:
        return dims[0]
    return math.sqrt(e[0] * e[0] + e[1] * e[1] + e[2] * e[2])


@inlined
def vertex_height(e, k):
    """Height n·r of vertex k of a block, r from its centre [m], from e = `scaled_normal` of n."""
    h = e[0] if k & 1 else -e[0]
    h += e[1] if k & 2 else -e[1]
    h += e[2] if k & 4 else -e[2]
    return h


@inlined
def vertex_heights(e):
    """Heights n·r of all eight vertices of a block [m], as two groups of four lanes: vertices 0 to 3, then 4 to 7."""
    h = Lanes(-1.0, 1.0, -1.0, 1.0) * e[0] + Lanes(-1.0, -1.0, 1.0, 1.0) * e[1]
    return h - e[2], h + e[2]


@inlined
def vertex_arm(dims, R, k):
    """Vertex k of a block relative to its centre, world frame [m]; `dims` are its half edges."""
    return qt.matvec(
        R,
        (
            VERTEX_SIGNS[k, 0] * dims[0],
            VERTEX_SIGNS[k, 1] * dims[1],
            VERTEX_SIGNS[k, 2] * dims[2],
        ),
    )


@inlined
def support_arm(shape, dims, R, n, e):
    """Point of a sphere or ellipsoid nearest to a wall of normal n, relative to its centre, world frame [m].

    e is `scaled_normal` of n. On an ellipsoid the point is -R D² Rᵀ n / s(n), with D = diag(semi-axes).
    """
    if shape == SPHERE:
        return (-dims[0] * n[0], -dims[0] * n[1], -dims[0] * n[2])
    s = -1.0 / support(shape, dims, e)
    return qt.matvec(R, (s * dims[0] * e[0], s * dims[1] * e[1], s * dims[2] * e[2]))
