"""Contacts of a capsule and a convex polyhedron, a block or a hull.

A capsule touches with balls about points of its axis (`capsule_contacts`): about both ends, and about the points that
are nearest to an edge or a corner. Each ball touches the nearest point of the polyhedron.
"""

from __future__ import annotations

import math

from physics.compiler.decorators import inlined, kernel
from physics.kernels.math import quaternion as qt
from physics.kernels.math.segments import nearest_place, nearest_places, point_on_segment
from physics.kernels.math.vector import minus, plus, row_vector
from physics.kernels.multibody.data.arrays import NUM_CONTACTS
from physics.kernels.multibody.data.capsules import half_axis, half_length
from physics.kernels.multibody.data.contact_set import add_contact, add_scaled, pair_slop, subtract
from physics.kernels.multibody.data.hull_tables import FIRST_CORNER, FIRST_EDGE, LAST_CORNER, LAST_EDGE
from physics.kernels.multibody.data.parts import first_part
from physics.kernels.multibody.narrowphase.box_sat import FLAT_COSINE
from physics.kernels.multibody.narrowphase.hull_ellipsoid import nearest_on_hull
from physics.kernels.multibody.narrowphase.hull_pose import pose_hull
from physics.kernels.multibody.narrowphase.segment_polyhedron import (
    edge_segment,
    part_inside,
    segment_separation,
)

# Features of a contact: two ends of the axis, then the edges, the corners, and the axis inside. A polyhedron of 64
# corners has at most 186 edges (Euler's formula); `contact_set.PARTED` contacts have the feature 511.
_FIRST_EDGE, _FIRST_CORNER, _INSIDE = 2, 256, 400


@inlined
def _is_known(s, first, capsule, slop, many):
    """True if a contact from row `first` of the set on is that of the ball at place s of the axis."""
    l = half_length(capsule, many)
    for k in range(first, many.counts[NUM_CONTACTS]):
        column = 0 if first_part(k, many) == capsule else 3
        if abs(many.contacts.anchor[k, column + 1] - s * l) <= slop:
            return True
    return False


@inlined
def _add_ball(capsule, hull, feature, p, y, n, distance, h, many):
    """Add the contact of the ball about point p of the axis and point y of the hull, both from the hull's centre."""
    r, origin = many.bodies.body[capsule].dims[0], row_vector(many.bodies.center, hull, 0)
    p, y = plus(origin, add_scaled(p, -r, n)), plus(origin, y)
    if capsule < hull:
        add_contact(capsule, hull, feature, -1, n, (p, y), distance - r, h, many)
    else:
        add_contact(hull, capsule, feature, -1, (-n[0], -n[1], -n[2]), (y, p), distance - r, h, many)


@kernel
def _add_passing(capsule, hull, feature, s, q, first, margin, h, many):
    """Add the contact of the ball at place s of the axis, which is nearest to the point q of an edge or corner.

    It is left out if the ball touches the polyhedron elsewhere, by more than 11 degrees, or if a contact from row
    `first` of the set on is that of the same ball. Between the two directions the ball's own nearest point counts: a
    capsule that lies on a face touches it above the face's edges, and rounding must not decide about that.
    """
    x = subtract(row_vector(many.bodies.center, capsule, 0), row_vector(many.bodies.center, hull, 0))
    p = point_on_segment(x, half_axis(capsule, many), s)
    w = minus(p, q)
    far = FLAT_COSINE * math.sqrt(qt.dot(w, w))
    if far > many.bodies.body[capsule].dims[0] + margin:
        return
    y, n, distance = nearest_on_hull(hull, p, many)
    if far > distance or distance > many.bodies.body[capsule].dims[0] + margin:
        return
    if not _is_known(s, first, capsule, pair_slop(capsule, hull, many), many):
        _add_ball(capsule, hull, feature, p, y, n, distance, h, many)


@kernel
def _add_inside(capsule, hull, x, u, place, margin, h, many):
    """Add the contact of a capsule whose axis passes through the polyhedron, at this place: the shortest way out."""
    apart, n = segment_separation(hull, x, u, many)
    r = many.bodies.body[capsule].dims[0]
    if apart - r <= margin:
        p = point_on_segment(x, u, place)
        _add_ball(capsule, hull, _INSIDE, p, add_scaled(p, -apart, n), n, apart, h, many)


@kernel
def collide_capsule_hull(capsule, hull, margin, h, many):
    """Add the contacts of a capsule and a block or hull whose gaps are at most `margin` [m].

    h is the length of the stage [s].
    """
    tables, origin = many.narrowphase.hulls, row_vector(many.bodies.center, hull, 0)
    pose_hull(0, hull, origin, many)
    x, u = subtract(row_vector(many.bodies.center, capsule, 0), origin), half_axis(capsule, many)
    near, first_row = many.bodies.body[capsule].dims[0] + margin, many.counts[NUM_CONTACTS]
    if segment_separation(hull, x, u, many)[0] > near:
        return
    first, last = part_inside(hull, x, u, many)
    if first < last:
        _add_inside(capsule, hull, x, u, 0.5 * (first + last), margin, h, many)
        return
    for end in range(2):
        p = point_on_segment(x, u, 2.0 * end - 1.0)
        y, n, distance = nearest_on_hull(hull, p, many)
        if distance <= near:
            _add_ball(capsule, hull, end, p, y, n, distance, h, many)
    for k in range(tables.of[hull, LAST_CORNER] - tables.of[hull, FIRST_CORNER]):
        q = row_vector(tables.corner[0], k, 0)
        s = nearest_place(q, x, u)
        if abs(s) < 1.0:
            _add_passing(capsule, hull, _FIRST_CORNER + k, s, q, first_row, margin, h, many)
    for e in range(tables.of[hull, LAST_EDGE] - tables.of[hull, FIRST_EDGE]):
        y, v = edge_segment(hull, e, many)
        s, t, is_crossing = nearest_places(x, u, y, v)
        if is_crossing and abs(s) < 1.0 and abs(t) < 1.0:
            _add_passing(capsule, hull, _FIRST_EDGE + e, s, point_on_segment(y, v, t), first_row, margin, h, many)
