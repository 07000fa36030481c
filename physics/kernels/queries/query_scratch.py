"""Scratch memory of one thread for queries of a world: poses and shapes of its bodies.

`QueryScratch` has the members of `multibody.data.arrays.BodiesWorkspace` that the narrow phase reads, under the same
names. So functions of the narrow phase take it as their argument `many`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from physics.compiler.decorators import inlined, kernel
from physics.kernels.math import quaternion as qt
from physics.kernels.math.vector import plus, row_vector
from physics.kernels.multibody.data.contact_set import put_vector
from physics.kernels.multibody.data.hull_tables import Hulls, make_hulls
from physics.kernels.multibody.data.parts import (
    Part,
    Parts,
    is_compound,
    make_parts,
    place_parts,
    write_part_records,
)
from physics.kernels.queries.box_tree import BoxTree, make_box_tree
from physics.kernels.state import layout as at


class PosedBodies(NamedTuple):
    """Bodies of a world in their present poses, a row for each body, and one for a shape that is compared with them.

    The parts of compounds have rows behind all bodies, before that of the shape.
    """

    body: np.ndarray  # (bodies,) records: shape code, half edges or semi-axes [m], bounding radius about `center` [m]
    center: np.ndarray  # (bodies, 3) geometric centre, world frame [m]
    rotation: np.ndarray  # (bodies, 9) rotation matrix from body frame to world frame, row by row
    capsules: bool | None  # None if neither a body nor the shape is a capsule
    cylinders: bool | None  # None if neither a body nor the shape is a cylinder
    parts: Parts | None  # None without compounds


class RoundKinds(NamedTuple):
    """Kinds of round bodies that have kernels of their own; None for kinds that are not there."""

    capsules: bool | None
    cylinders: bool | None


class PairScratch(NamedTuple):
    """Scratch of the narrow phase for one pair of bodies; `multibody.data.arrays.NarrowPhase` explains the members."""

    simplex: np.ndarray
    corners: np.ndarray  # (4, 3) corners of the simplex before it was reduced
    on_first: np.ndarray  # (4, 3) points of the first body that belong to the corners of the simplex
    points: np.ndarray  # (4, 3) the same before the simplex was reduced
    hulls: Hulls  # of blocks, too
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


def make_query_scratch(
    bodies: int, walls: np.ndarray, polyhedra: Sequence, kinds: RoundKinds, parts: Sequence[Part] = ()
) -> QueryScratch:
    """Allocate the scratch memory of one thread.

    Parameters
    ----------
    bodies : int
        Number of bodies of a world.
    walls : (walls, WALL_SIZE) float64
        Table of the walls.
    polyhedra : sequence
        Polyhedron of each body and part as `hull_tables.make_hulls` takes them, of blocks, too; None for a round body.
        The last one is that of a shape that is no body of the world.
    kinds : RoundKinds
        Which of these kinds are among these bodies and shapes.
    parts : sequence of Part
        Parts of the compounds, sorted by their bodies.
    """
    rows = len(polyhedra)
    records = np.zeros(rows, np.dtype([("shape", np.int64), ("dims", np.float64, (3,)), ("radius", np.float64)]))
    hulls = make_hulls(polyhedra)
    write_part_records(records, bodies, parts)
    return QueryScratch(
        PosedBodies(records, np.zeros((rows, 3)), np.zeros((rows, 9)), *kinds, make_parts(bodies, parts)),
        PairScratch(*(np.zeros((4, 3)) for _ in range(4)), hulls, _face_offsets(hulls)),
        make_box_tree(bodies + len(parts)),
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
def bounding_radius(shape, dims, hull_radius):
    """Radius of the sphere about the geometric centre of a body that holds it [m]; `hull_radius` is that of a hull."""
    if shape == at.BLOCK:
        return math.sqrt(dims[0] * dims[0] + dims[1] * dims[1] + dims[2] * dims[2])
    if shape == at.HULL:
        return hull_radius
    if shape == at.CYLINDER:
        return math.sqrt(dims[0] * dims[0] + dims[1] * dims[1])
    return max(dims[0], dims[1], dims[2])


@inlined
def pose_body(b, i, shape, bodies, scratch):
    """Write shape and pose of the body in row i of the batch into row b of the scratch."""
    q = (bodies.state[i, at.QUAT], bodies.state[i, at.QUAT + 1], bodies.state[i, at.QUAT + 2])
    R = qt.to_matrix((q[0], q[1], q[2], bodies.state[i, at.QUAT + 3]))
    body, posed = scratch.bodies.body[b], scratch.bodies
    body.shape = shape
    for c in range(3):
        body.dims[c] = bodies.params[i, at.DIMENSIONS + c]
    body.radius = bounding_radius(shape, body.dims, bodies.params[i, at.RADIUS])
    for c in range(9):
        posed.rotation[b, c] = R[c]
    arm = qt.matvec(R, row_vector(bodies.params, i, at.CENTER))
    put_vector(posed.center, b, 0, plus(row_vector(bodies.state, i, at.POS), arm))
    if is_compound(b, scratch):
        body.radius = bodies.params[i, at.RADIUS]
    place_parts(b, scratch)


@kernel
def pose_world(world, bodies, scratch):
    """Write the shapes and poses of all bodies of a world into `scratch.bodies`."""
    count = bodies.shapes.shape[0]
    for b in range(count):
        pose_body(b, world * count + b, bodies.shapes[b], bodies, scratch)
