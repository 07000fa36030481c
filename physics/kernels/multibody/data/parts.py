"""Parts of compound bodies: convex shapes that move as one body.

Contacts are found between parts, and act on bodies. Part b is body b, for each body of the world. A body that is no
compound has no other part. The parts of compounds follow behind all bodies. They have rows of their own in
`many.bodies.body` (shape, dimensions, bounding radius, slop), `rotation`, `center` and the tables of hulls, so that the
narrow phase takes parts as it takes bodies. The row of a compound has the half extents of all its parts.

All of this is left out of kernels whose scene has no compound: `many.bodies.parts` is None there.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from physics.compiler.decorators import if_given, inlined
from physics.kernels.math import quaternion as qt
from physics.kernels.math.vector import minus, plus, row_vector
from physics.kernels.state.layout import COMPOUND


class ActingBodies(NamedTuple):
    """Members of `many.bodies` that loads and fields read, with rows of bodies only."""

    body: np.ndarray  # (bodies,) the first records of `many.bodies.body`
    state: np.ndarray
    touched: np.ndarray
    fixed: np.ndarray | None


class Parts(NamedTuple):
    """Parts of the compounds of a world, and the parts that touch in each contact."""

    owner: np.ndarray  # (parts,) int, body of each part
    span: np.ndarray  # (bodies, 2) int, first part of a body and the end of its parts; (b, b + 1) of no compound
    place: np.ndarray  # (parts, 3) geometric centre from the body's centre of mass, body frame [m]
    turn: np.ndarray  # (parts, 9) rotation matrix from the part's frame to the body frame, row by row
    touching: np.ndarray  # (contacts, 2) int, parts of both ends; -1 - k for wall k
    acting: ActingBodies | None  # None in the scratch of queries


class Part(NamedTuple):
    """Part of a compound for `make_parts`."""

    owner: int
    shape: int  # code of `state.layout`
    dims: np.ndarray  # (3,) half edges, semi-axes or half extents [m]
    radius: float  # of the bounding sphere about the geometric centre [m]
    place: np.ndarray  # (3,) geometric centre from the body's centre of mass, body frame [m]
    turn: np.ndarray  # (3, 3) rotation from the part's frame to the body frame


def make_parts(
    bodies: int, parts: Sequence[Part], contacts: int = 0, acting: ActingBodies | None = None
) -> Parts | None:
    """Make the table of the parts of a world with so many bodies, sorted by their bodies; None if there are no parts.

    It has room for so many `contacts`.
    """
    if not parts:
        return None
    count, i = bodies + len(parts), np.int64
    table = Parts(
        np.arange(count, dtype=i), np.stack((np.arange(bodies), np.arange(bodies) + 1), axis=1).astype(i),
        np.zeros((count, 3)), np.tile(np.eye(3).ravel(), (count, 1)), np.zeros((contacts, 2), i),
        acting,
    )  # fmt: skip
    for k, part in enumerate(parts, bodies):
        table.owner[k], table.place[k], table.turn[k] = part.owner, part.place, part.turn.ravel()
        if table.span[part.owner, 0] == part.owner:
            table.span[part.owner, 0] = k
        table.span[part.owner, 1] = k + 1
    return table


def write_part_records(records: np.ndarray, bodies: int, parts: Sequence[Part]) -> None:
    """Write shapes, dimensions and radii of the parts into the records behind those of the bodies."""
    for k, part in enumerate(parts, bodies):
        records[k]["shape"], records[k]["dims"], records[k]["radius"] = part.shape, part.dims, part.radius


def _same(part, many):
    return part


def _same_pair(a, b, normal, points, many):
    return a, b, normal, points


def _same_vector(part, arm, many):
    return arm


def _velocity(part, many):
    return row_vector(many.bodies.twist, part, 0)


def _same_pose(part, x, R, many):
    return x, R


def _all_bodies(many):
    return many.bodies


@if_given("many.bodies.parts", _all_bodies)
def acting_bodies(many):
    """Bodies of the world as loads and fields take them, without rows of parts."""
    return many.bodies.parts.acting


@if_given("many.bodies.parts", False)
def is_compound(b, many):
    """True if body b is a compound."""
    return many.bodies.body[b].shape == COMPOUND


@if_given("many.bodies.parts", _same)
def body_of(part, many):
    """Body of a part; a code below 0, of a wall, stays as it is."""
    return many.bodies.parts.owner[part] if part >= 0 else part


@if_given("many.bodies.parts", _same_pair)
def lower_body_first(a, b, normal, points, many):
    """Order parts a and b of a contact by their bodies: (first, second, normal out of the second, points).

    So all contacts of two bodies have the same first body.
    """
    if 0 <= body_of(b, many) < body_of(a, many):
        return b, a, (-normal[0], -normal[1], -normal[2]), (points[1], points[0])
    return a, b, normal, points


@if_given("many.bodies.parts")
def note_parts(k, a, b, many):
    """Note that parts a and b touch in contact k; b = -1 - k is wall k."""
    many.bodies.parts.touching[k, 0], many.bodies.parts.touching[k, 1] = a, b


@if_given("many.bodies.parts")
def copy_parts(k, to, many):
    """Copy the parts of contact k to contact `to`."""
    for end in range(2):
        many.bodies.parts.touching[to, end] = many.bodies.parts.touching[k, end]


def _first_body(k, many):
    return many.contacts.bodies[k, 0]


@if_given("many.bodies.parts", _first_body)
def first_part(k, many):
    """First part of contact k."""
    return many.bodies.parts.touching[k, 0]


def _second(end, k, many):
    return end


@if_given("many.bodies.parts", _second)
def second_part(end, k, many):
    """Second part of contact k, whose second body is `end`, below 0 for a wall."""
    return many.bodies.parts.touching[k, 1]


@if_given("many.bodies.parts", _same_vector)
def from_center(part, arm, many):
    """Vector `arm` from a body's centre of mass, from the geometric centre of its part instead; world frame [m].

    Of a body that is no compound it stays as it is.
    """
    b = body_of(part, many)
    if part == b:
        return arm
    return minus(arm, minus(row_vector(many.bodies.center, part, 0), row_vector(many.bodies.state, b, 0)))


@if_given("many.bodies.parts", _same_vector)
def from_body(part, arm, many):
    """Vector `arm` from the geometric centre of a part, from the centre of mass of its body instead; world frame [m].

    Of a body that is no compound it stays as it is.
    """
    b = body_of(part, many)
    if part == b:
        return arm
    return plus(arm, minus(row_vector(many.bodies.center, part, 0), row_vector(many.bodies.state, b, 0)))


@if_given("many.bodies.parts", _velocity)
def center_velocity(part, many):
    """Velocity of the geometric centre of a part [m/s]; of a body that is no compound, of its centre of mass."""
    b = body_of(part, many)
    v = row_vector(many.bodies.twist, b, 0)
    if part == b:
        return v
    return plus(v, qt.cross(row_vector(many.bodies.twist, b, 3), from_body(part, (0.0, 0.0, 0.0), many)))


@if_given("many.bodies.parts", _same_vector)
def plus_turning(part, acceleration, many):
    """Acceleration relative to the geometric centre of a part, plus ω x (ω x r) of this centre, world frame [m/s²]."""
    b = body_of(part, many)
    if part == b:
        return acceleration
    w = row_vector(many.bodies.twist, b, 3)
    return plus(acceleration, qt.cross(w, qt.cross(w, from_body(part, (0.0, 0.0, 0.0), many))))


@inlined
def _matrix(rows, i):
    return (
        rows[i, 0], rows[i, 1], rows[i, 2], rows[i, 3], rows[i, 4], rows[i, 5], rows[i, 6], rows[i, 7], rows[i, 8],
    )  # fmt: skip


@inlined
def _matrix_product(R, Q):
    x, y, z = qt.matvec(R, (Q[0], Q[3], Q[6])), qt.matvec(R, (Q[1], Q[4], Q[7])), qt.matvec(R, (Q[2], Q[5], Q[8]))
    return (x[0], y[0], z[0], x[1], y[1], z[1], x[2], y[2], z[2])


@if_given("many.bodies.parts", _same_pose)
def posed_part(part, x, R, many):
    """Geometric centre [m] and rotation matrix of a part, from those of its body, x and R; world frame."""
    if part == body_of(part, many):
        return x, R
    table = many.bodies.parts
    return plus(x, qt.matvec(R, row_vector(table.place, part, 0))), _matrix_product(R, _matrix(table.turn, part))


@if_given("many.bodies.parts")
def place_parts(b, many):
    """Write geometric centres and rotation matrices of the parts of body b, from those of the body."""
    if not is_compound(b, many):
        return
    x, R = row_vector(many.bodies.center, b, 0), _matrix(many.bodies.rotation, b)
    for part in range(many.bodies.parts.span[b, 0], many.bodies.parts.span[b, 1]):
        y, S = posed_part(part, x, R, many)
        for c in range(3):
            many.bodies.center[part, c] = y[c]
        for c in range(9):
            many.bodies.rotation[part, c] = S[c]


def _no_parts(many):
    return None


@if_given("many.bodies.parts", _no_parts)
def bind_parts(many):
    """Give every part the slop of its body."""
    for part in range(many.bodies.state.shape[0], many.bodies.body.shape[0]):
        many.bodies.body[part].slop = many.bodies.body[many.bodies.parts.owner[part]].slop
