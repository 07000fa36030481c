"""Plane faces that a cylinder may touch: faces of a polyhedron, and ends of another cylinder.

A polyhedron is number 0 of the pair, and its faces have the numbers of its tables (`hull_pose`). The ends of a cylinder
have the numbers 0, the lower one, and 1. Vectors are in world axes, and points lead from the centre of the face's body.
"""

from __future__ import annotations

import math

from physics.compiler.decorators import if_given, inlined, kernel
from physics.kernels.math import quaternion as qt
from physics.kernels.math.vector import minus, row_vector, times
from physics.kernels.multibody.data.cylinders import across_axis, axis_of, is_cylinder, rotation_of
from physics.kernels.multibody.data.hull_tables import FIRST_FACE
from physics.kernels.multibody.narrowphase.hull_clip import side_plane


def _no_plane(other, face, many):
    return (0.0, 1.0, 0.0), 0.0


@if_given("many.narrowphase.hulls", _no_plane)
def _polygon_plane(other, face, many):
    hulls = many.narrowphase.hulls
    return row_vector(hulls.normal[0], face, 0), hulls.offset[0, face]


@inlined
def face_plane(other, face, many):
    """Plane of a face of body or part `other`: (unit normal n out of it, offset n·x [m])."""
    if is_cylinder(other, many):
        return times(2.0 * face - 1.0, axis_of(rotation_of(other, many))), many.bodies.body[other].dims[1]
    return _polygon_plane(other, face, many)


def _nothing(other, face, p, q, slack, many):
    return 1.0, 0.0, 0, 0


@if_given("many.narrowphase.hulls", _nothing)
def _part_over_polygon(other, face, p, q, slack, many):
    hulls = many.narrowphase.hulls
    n, k = row_vector(hulls.normal[0], face, 0), hulls.of[other, FIRST_FACE] + face
    start, stop = hulls.loops[k, 0], hulls.loops[k, 1]
    first, last, into, out_of = 0.0, 1.0, -1, -1
    for side in range(stop - start):
        m, bound = side_plane(0, hulls.ring, side, start, stop, n, hulls)
        here, there = qt.dot(m, p) - bound, qt.dot(m, q) - bound
        if here > slack and there > slack:
            return 1.0, 0.0, 0, 0
        if here > slack and here / (here - there) > first:
            first, into = here / (here - there), side
        if there > slack and here / (here - there) < last:
            last, out_of = here / (here - there), side
    return first, last, into, out_of


@kernel
def _part_over_disk(other, p, q, slack, many):
    r, y = many.bodies.body[other].dims[0], axis_of(rotation_of(other, many))
    w, d = across_axis(y, p), across_axis(y, minus(q, p))
    a, b, far = qt.dot(d, d), qt.dot(w, d), r + slack
    if not a > 0.0:
        return (0.0, 1.0, -1, -1) if qt.dot(w, w) <= far * far else (1.0, 0.0, 0, 0)
    room = b * b - a * (qt.dot(w, w) - r * r)
    if room < 0.0:
        return 1.0, 0.0, 0, 0
    root = math.sqrt(room)
    first, last, into, out_of = (-b - root) / a, (root - b) / a, 0, 1
    if first <= 0.0 or qt.dot(w, w) <= far * far:
        first, into = 0.0, -1
    e = across_axis(y, q)
    if last >= 1.0 or qt.dot(e, e) <= far * far:
        last, out_of = 1.0, -1
    return first, last, into, out_of


@inlined
def part_over(other, face, p, q, slack, many):
    """Part of the segment from p to q above a face: (first place, last place, side there, side here).

    Places are from 0 to 1; the first one is larger if nothing is above. A side of the face is -1 where the segment
    itself ends. An end outside by at most `slack` [m] counts as inside: it would else come and go by rounding.
    """
    if is_cylinder(other, many):
        return _part_over_disk(other, p, q, slack, many)
    return _part_over_polygon(other, face, p, q, slack, many)


@inlined
def is_over(other, face, p, slack, many):
    """True if the point p is above a face, or outside by at most `slack` [m]."""
    first, last, _, _ = part_over(other, face, p, p, slack, many)
    return first <= last
