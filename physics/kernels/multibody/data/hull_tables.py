"""Tables of the convex polyhedra of a world: corners, faces and edges, and scratch for a pair in place.

The tables are made once and only read; bodies of equal hulls share an entry. A block has one too where there are hulls:
the unit cube's, whose corners are scaled by the half edges it has in this world.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product
from typing import NamedTuple

import numpy as np

# Columns of `Hulls.of`: where the corners, faces and edges of a body begin and end in the tables.
FIRST_CORNER, LAST_CORNER, FIRST_FACE, LAST_FACE, FIRST_EDGE, LAST_EDGE = range(6)

# Columns of `Hulls.edges`: its ends, and the faces on its left, seen from outside along it, and on its right.
EDGE_START, EDGE_END, EDGE_LEFT_FACE, EDGE_RIGHT_FACE = range(4)


class Hulls(NamedTuple):
    """Tables, and scratch for a pair of polyhedra, whose first axis is the body (0 or 1) of the pair.

    The pair is stored in the axes of the world, relative to the place of the first body, so that nothing is lost far
    from the world's origin. Corners and faces are counted from 0 in each polyhedron.
    """

    of: np.ndarray  # (bodies, 6): see above; all 0 of what is round
    corners: np.ndarray  # (v, 3) from the centre of mass, body frame [m]; ±1 of the cube
    normals: np.ndarray  # (f, 3) out of the faces, body frame
    loops: np.ndarray  # (f, 2) where the corners of a face begin and end in `ring`
    ring: np.ndarray  # corners of the faces, counter-clockwise as seen from outside
    edges: np.ndarray  # (e, 4)
    corner: np.ndarray  # (2, corners, 3) [m]
    normal: np.ndarray  # (2, faces, 3)
    offset: np.ndarray  # (2, faces) of the faces' planes [m]
    centre: np.ndarray  # (2, 3) places [m]
    polygon: np.ndarray  # (2, corners, 3) clipped face, two copies [m]
    sides: np.ndarray  # (2, corners, 2) edges into and out of each vertex of it


class Solid(NamedTuple):
    """Convex polyhedron for `make_hulls`: members of `physics.mass.polyhedron.Polyhedron`."""

    vertices: np.ndarray
    normals: np.ndarray
    loops: Sequence[Sequence[int]]
    edges: np.ndarray


def _cube() -> Solid:
    """Cube with the half edge 1; corner k as in `support_function.vertex_height`."""
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


# What a block is scaled from where there are hulls.
CUBE = _cube()


def make_hulls(bodies: Sequence[Solid | None]) -> Hulls:
    """Tables for bodies, None for round ones; equal hulls share an object, and blocks share `CUBE`."""
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
    """Largest number of corners of a face clipped by another; each side cuts off one corner and makes two."""
    return 2 * max([len(loop) for body in bodies if body is not None for loop in body.loops], default=0)
