"""Scratch memory of one thread for queries of a world: poses and shapes of its bodies.

`QueryScratch` has the members of `multibody.data.arrays.BodiesWorkspace` that the narrow phase reads, under the same
names. So functions of the narrow phase take it as their argument `many`.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from physics.compiler.decorators import inlined, kernel
from physics.kernels.math import quaternion as qt
from physics.kernels.math.vector import plus, row_vector
from physics.kernels.multibody.data.contact_set import put_vector
from physics.kernels.multibody.data.hull_tables import Hulls, make_hulls
from physics.kernels.queries.box_tree import BoxTree, make_box_tree
from physics.kernels.state import layout as at


class PosedBodies(NamedTuple):
    """Bodies of a world in their present poses, a row for each body."""

    body: np.ndarray  # (bodies,) records of shape code, half edges or semi-axes [m], and a slop of 0
    center: np.ndarray  # (bodies, 3) geometric centre, world frame [m]
    rotation: np.ndarray  # (bodies, 9) rotation matrix from body frame to world frame, row by row


class PairScratch(NamedTuple):
    """Scratch of the narrow phase for one pair of bodies; `multibody.data.arrays.NarrowPhase` explains the members."""

    simplex: np.ndarray
    relative_axes: np.ndarray
    hulls: Hulls | None  # None in a world without hulls
    face_offsets: np.ndarray  # (faces,) offsets of the hulls' faces from their centres, body frame [m]


class QueryScratch(NamedTuple):
    """Scratch memory of one thread for queries of one world after another."""

    bodies: PosedBodies
    narrowphase: PairScratch
    tree: BoxTree
    walls: np.ndarray  # (walls, WALL_SIZE) columns of `state.layout`


class QueriedBodies(NamedTuple):
    """Bodies of all worlds; rows are those of world 0, then of world 1, and so on."""

    state: np.ndarray  # (rows, STATE_SIZE) columns of `physics.kernels.state.layout`
    params: np.ndarray  # (rows, ...)
    shapes: np.ndarray  # (bodies,) codes of shapes


def make_query_scratch(bodies: int, walls: np.ndarray, polyhedra: Sequence) -> QueryScratch:
    """Allocate the scratch memory of one thread.

    Parameters
    ----------
    bodies : int
        Number of bodies of a world.
    walls : (walls, WALL_SIZE) float64
        Table of the walls.
    polyhedra : sequence
        The bodies as `hull_tables.make_hulls` takes them; empty if the world has no hulls.
    """
    records = np.zeros(bodies, np.dtype([("shape", np.int64), ("dims", np.float64, (3,)), ("slop", np.float64)]))
    hulls = make_hulls(polyhedra) if len(polyhedra) else None
    offsets = np.zeros(0) if hulls is None else _face_offsets(hulls)
    return QueryScratch(
        PosedBodies(records, np.zeros((bodies, 3)), np.zeros((bodies, 9))),
        PairScratch(np.zeros((4, 3)), np.zeros((4, 3, 3)), hulls, offsets),
        make_box_tree(bodies),
        walls.copy(),
    )


def _face_offsets(hulls: Hulls) -> np.ndarray:
    """Offsets n·x (faces,) of the planes of all faces in the tables, from the centre of their polyhedron [m]."""
    offsets = np.zeros(len(hulls.normals))
    for first_corner, _, first, last, *_ in hulls.of:
        for face in range(first, last):
            corner = hulls.corners[first_corner + hulls.ring[hulls.loops[face, 0]]]
            offsets[face] = hulls.normals[face] @ corner
    return offsets


@inlined
def pose_body(b, i, shape, bodies, scratch):
    """Write shape and pose of the body in row i of the batch into row b of the scratch."""
    q = (bodies.state[i, at.QUAT], bodies.state[i, at.QUAT + 1], bodies.state[i, at.QUAT + 2])
    R = qt.to_matrix((q[0], q[1], q[2], bodies.state[i, at.QUAT + 3]))
    body, posed = scratch.bodies.body[b], scratch.bodies
    body.shape = shape
    for c in range(3):
        body.dims[c] = bodies.params[i, at.DIMENSIONS + c]
    for c in range(9):
        posed.rotation[b, c] = R[c]
    arm = qt.matvec(R, row_vector(bodies.params, i, at.CENTER))
    put_vector(posed.center, b, 0, plus(row_vector(bodies.state, i, at.POS), arm))


@kernel
def pose_world(world, bodies, scratch):
    """Write the shapes and poses of all bodies of a world into `scratch.bodies`."""
    count = bodies.shapes.shape[0]
    for b in range(count):
        pose_body(b, world * count + b, bodies.shapes[b], bodies, scratch)
