"""Tables of the convex polyhedra of a world: corners, faces and edges, and scratch for a pair of them.

The tables are made once and then only read; bodies with equal hulls share an entry. In a world with hulls a block has
an entry, too: that of the cube with half edge 1, whose corners are scaled by the block's half edges.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product
from typing import NamedTuple

import numpy as np

# Columns of `Hulls.of`: positions in the tables at which corners, faces and edges of a body begin and end.
FIRST_CORNER, LAST_CORNER, FIRST_FACE, LAST_FACE, FIRST_EDGE, LAST_EDGE = range(6)

# Columns of `Hulls.edges`: both ends of an edge, and the faces on its left and right, seen from outside along it.
EDGE_START, EDGE_END, EDGE_LEFT_FACE, EDGE_RIGHT_FACE = range(4)


class Hulls(NamedTuple):
    """Tables of polyhedra, and scratch for a pair of them in the world.

    The members from `corner` on are scratch. Their first axis is the number of the body in the pair, 0 or 1; the first
    axis of `polygon` and `sides` is the number of the copy. They are in world axes relative to the geometric centre of
    the first body, so that no digits are lost far from the world's origin. Corners and faces are counted from 0 in each
    polyhedron.
    """

    of: np.ndarray  # (bodies, 6) int, columns `FIRST_CORNER` ...; all 0 for spheres and ellipsoids
    corners: np.ndarray  # (v, 3) corners from the geometric centre, body frame [m]; ±1 for the cube
    normals: np.ndarray  # (f, 3) unit normals out of the faces, body frame
    loops: np.ndarray  # (f, 2) int, positions in `ring` at which the corners of a face begin and end
    ring: np.ndarray  # int, corners of each face, counter-clockwise seen from outside
    edges: np.ndarray  # (e, 4) int, columns `EDGE_START` ...
    corner: np.ndarray  # (2, corners, 3) corners [m]
    normal: np.ndarray  # (2, faces, 3) unit normals out of the faces
    offset: np.ndarray  # (2, faces) offsets of the faces' planes, normal·x [m]
    centre: np.ndarray  # (2, 3) geometric centres [m]
    polygon: np.ndarray  # (2, corners, 3) vertices of a clipped face, two copies [m]
    sides: np.ndarray  # (2, corners, 2) int, edges into and out of each vertex of `polygon`


class Solid(NamedTuple):
    """Convex polyhedron for `make_hulls`, with the same members as `physics.mass.polyhedron.Polyhedron`."""

    vertices: np.ndarray
    normals: np.ndarray
    loops: Sequence[Sequence[int]]
    edges: np.ndarray


def _cube() -> Solid:
    """Cube with half edge 1; its corner k is that of `support_function.vertex_height`."""
    corners = np.array([[1.0 if k >> j & 1 else -1.0 for j in range(3)] for k in range(8)])
    normals, loops = [], []
    for axis, sign in product(range(3), (1.0, -1.0)):
        normals.append(sign * np.eye(3)[axis])
        i, j = (axis + 1) % 3, (axis + 2) % 3
        turns = ((-1, -1), (1, -1), (1, 1), (-1, 1))[:: int(sign)]
        loops.append([
            int(np.flatnonzero((corners[:, axis] == sign) & (corners[:, i] == s) & (corners[:, j] == t))[0])
            for s, t in turns
        ])  # fmt: skip
    left = {side: f for f, loop in enumerate(loops) for side in zip(loop, loop[1:] + loop[:1])}
    edges = np.array([(a, b, f, left[b, a]) for (a, b), f in left.items() if a < b])
    return Solid(corners, np.array(normals), loops, edges)


# Table entry of every block, in a world with hulls.
CUBE = _cube()


def make_hulls(bodies: Sequence[Solid | None]) -> Hulls:
    """Build the tables for the bodies of a world, one `Solid` per body, None for a sphere or ellipsoid.

    Bodies that are given the same object share an entry; blocks are given `CUBE`.
    """
    kinds = {id(body): body for body in bodies if body is not None}
    corners, normals, loops, ring, edges, place = [], [], [], [], [], {}
    for key, solid in kinds.items():
        place[key] = (len(corners), len(corners) + len(solid.vertices), len(normals),
                      len(normals) + len(solid.normals), len(edges), len(edges) + len(solid.edges))  # fmt: skip
        corners += list(solid.vertices)
        normals += list(solid.normals)
        edges += list(solid.edges)
        for loop in solid.loops:
            loops.append((len(ring), len(ring) + len(loop)))
            ring += loop
    most = [max([place[key][k + 1] - place[key][k] for key in kinds], default=0) for k in (0, 2)]
    room = clipped_face_capacity(bodies)
    f, i = np.float64, np.int64
    return Hulls(
        of=np.array([place.get(id(body), (0,) * 6) for body in bodies], i),
        corners=np.array(corners, f).reshape(-1, 3), normals=np.array(normals, f).reshape(-1, 3),
        loops=np.array(loops, i).reshape(-1, 2), ring=np.array(ring, i), edges=np.array(edges, i).reshape(-1, 4),
        corner=np.zeros((2, most[0], 3)), normal=np.zeros((2, most[1], 3)), offset=np.zeros((2, most[1])),
        centre=np.zeros((2, 3)), polygon=np.zeros((2, room, 3)), sides=np.zeros((2, room, 2), i),
    )  # fmt: skip


def clipped_face_capacity(bodies: Sequence[Solid | None]) -> int:
    """Largest number of corners of a body's face after clipping by the sides of another body's face.

    `bodies` is as in `make_hulls`. Each clipping side cuts off at least one corner and makes two.
    """
    return 2 * max([len(loop) for body in bodies if body is not None for loop in body.loops], default=0)
