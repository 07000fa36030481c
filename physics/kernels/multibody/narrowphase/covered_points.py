"""Contacts at points of a compound that another of its parts covers: they are no contacts of the whole.

Where two parts meet flush, each has an edge that the whole has not. A ball that rolls over such a seam is nearest to
the edge of the part ahead, along a normal that leans back. The whole has no such normal there: the point x + ε n, a
little above the edge, is nearer to a face of the part behind, whose normal is the only one. A contact is left out

1. if its point lies inside another part, deeper than the slop, or
2. if it is at an edge or corner of a block or hull, and another block or hull has a face below x + ε n that is nearer.

The second rule does not touch contacts whose normal is that of a face of the part: such a face may end at another
part in a concave corner, and is touched up to there. Nor does it touch a normal that leans away from the other face. A
contact stays if the part that covers it has no contact with the other body that stays: something must carry that body.
Contacts that are deep already stay, too.
"""

from __future__ import annotations

import math

from physics.compiler.decorators import if_given, inlined, kernel
from physics.kernels.math import quaternion as qt
from physics.kernels.math.segments import nearest_place, point_on_segment
from physics.kernels.math.vector import minus, plus, row_vector, times
from physics.kernels.multibody.data.arrays import NUM_CONTACTS, NUM_STOPPING
from physics.kernels.multibody.data.capsules import half_axis, is_capsule
from physics.kernels.multibody.data.compliance import is_pressed_in
from physics.kernels.multibody.data.contact_set import is_stopping, pair_slop, row_matrix
from physics.kernels.multibody.data.cylinders import is_cylinder
from physics.kernels.multibody.data.hull_tables import FIRST_CORNER, FIRST_FACE, LAST_FACE
from physics.kernels.multibody.data.parts import body_of
from physics.kernels.multibody.data.warm_start import copy_contact
from physics.kernels.state.layout import BLOCK, HULL, SPHERE

# Height ε above a point at which other parts are compared, as a share of the bounding radius of its part.
_PROBE_SHARE = 1.0e-4

# Share of ε by which a face must be nearer than the point: rounding of heights over ε is less.
_NEARER_SHARE = 1.0e-8

# One minus the cosine of the angle (4e-5 rad) within which a normal is that of a face.
_SAME_NORMAL = 1.0e-9

# Rounding of coordinates, as a share of the bounding radius.
_ROUNDING = 1.0e-12

# Depth, in slops, from which a contact is kept whatever covers it.
_KEPT_DEPTH = 4.0


@inlined
def _block_face(part, y, many):
    """Height of a point y over the face of a block that is most below it, the next height, and the face's normal.

    The next height is the largest one over another face. All vectors are in the frame of the part.
    """
    d = many.bodies.body[part].dims
    best, second, n = -math.inf, -math.inf, (0.0, 0.0, 0.0)
    for k in range(3):
        height = abs(y[k]) - d[k]
        if height > best:
            s = math.copysign(1.0, y[k])
            best, second = height, best
            n = (s if k == 0 else 0.0, s if k == 1 else 0.0, s if k == 2 else 0.0)
        else:
            second = max(second, height)
    return best, second, n


def _no_face(part, y, many):
    return math.inf, math.inf, (0.0, 0.0, 0.0)


@if_given("many.narrowphase.hulls", _no_face)
def _hull_face(part, y, many):
    """Do the work of `_block_face` for a hull."""
    tables = many.narrowphase.hulls
    first = tables.of[part, FIRST_CORNER]
    best, second, n = -math.inf, -math.inf, (0.0, 0.0, 0.0)
    for f in range(tables.of[part, FIRST_FACE], tables.of[part, LAST_FACE]):
        m = row_vector(tables.normals, f, 0)
        height = qt.dot(m, minus(y, row_vector(tables.corners, first + tables.ring[tables.loops[f, 0]], 0)))
        if height > best:
            best, second, n = height, best, m
        else:
            second = max(second, height)
    return best, second, n


@inlined
def _face_below(part, x, many):
    """Do the work of `_block_face` for a block or hull and a point x, all vectors in the world frame."""
    R = row_matrix(many.bodies.rotation, part)
    y = qt.transposed_matvec(R, minus(x, row_vector(many.bodies.center, part, 0)))
    if many.bodies.body[part].shape == BLOCK:
        best, second, n = _block_face(part, y, many)
    else:
        best, second, n = _hull_face(part, y, many)
    return best, second, qt.matvec(R, n)


@inlined
def _is_polyhedron(part, many):
    return many.bodies.body[part].shape == BLOCK or many.bodies.body[part].shape == HULL


@inlined
def _depth(part, x, many):
    """Depth of a point x in a part [m], negative outside; of an ellipsoid, and outside, at most so much."""
    center, d = row_vector(many.bodies.center, part, 0), many.bodies.body[part].dims
    if _is_polyhedron(part, many):
        return -_face_below(part, x, many)[0]
    y = minus(x, center)
    if is_capsule(part, many):
        u = half_axis(part, many)
        y = minus(x, point_on_segment(center, u, nearest_place(x, center, u)))
    if is_capsule(part, many) or many.bodies.body[part].shape == SPHERE:
        return d[0] - math.sqrt(qt.dot(y, y))
    y = qt.transposed_matvec(row_matrix(many.bodies.rotation, part), y)
    if is_cylinder(part, many):
        return min(d[0] - math.sqrt(y[0] * y[0] + y[2] * y[2]), d[1] - abs(y[1]))
    f = (y[0] / d[0], y[1] / d[1], y[2] / d[2])
    return (1.0 - math.sqrt(qt.dot(f, f))) * min(d[0], min(d[1], d[2]))


@inlined
def _is_at_edge(part, x, n, many):
    """True if the normal n of a point x of a block or hull is that of none of its faces, so that x is at an edge."""
    probe = many.bodies.body[part].radius
    return qt.dot(_face_below(part, plus(x, times(probe, n)), many)[2], n) < 1.0 - _SAME_NORMAL


@kernel
def _covers(other, part, x, n, is_at_edge, slop, many):
    """True if a part covers the point x of another one of the same compound, by the rules of this module."""
    if _depth(other, x, many) > slop:
        return True
    if not (is_at_edge and _is_polyhedron(other, many)):
        return False
    height = _PROBE_SHARE * many.bodies.body[part].radius
    found, second, m = _face_below(other, plus(x, times(height, n)), many)
    is_over = second <= _ROUNDING * many.bodies.body[other].radius
    return is_over and qt.dot(m, n) > 0.0 and found < (1.0 - _NEARER_SHARE) * height


@kernel
def _cover(part, x, n, gap, many):
    """Find a part of the same compound that covers the contact of a part at its point x; -1 if there is none.

    n is the unit normal out of the part, `gap` that of the contact [m].
    """
    b = body_of(part, many)
    if part == b or gap < -_KEPT_DEPTH * many.bodies.body[b].slop:
        return -1
    is_at_edge = _is_polyhedron(part, many) and _is_at_edge(part, x, n, many)
    for other in range(many.bodies.parts.span[b, 0], many.bodies.parts.span[b, 1]):
        if other != part and _covers(other, part, x, n, is_at_edge, many.bodies.body[b].slop, many):
            return other
    return -1


@inlined
def _own_point(k, part, first, side, many):
    """Point of a part in contact k before both bodies' points were joined, world frame [m].

    `first` is the column of its anchor; `side` is -1 for the first end of the contact, 1 for the second.
    """
    arm = qt.matvec(row_matrix(many.bodies.rotation, part), row_vector(many.contacts.anchor, k, first))
    x = plus(row_vector(many.bodies.center, part, 0), arm)
    if is_capsule(part, many):
        x = plus(x, times(side * many.bodies.body[part].dims[0], row_vector(many.contacts.frame, k, 0)))
    return x


@inlined
def _mark_covers(first, many):
    """Write the part that covers each contact from row `first` on into its target, -1 for none: first end, second end.

    Targets are set later in the stage.
    """
    for k in range(first, many.counts[NUM_CONTACTS]):
        a, b = many.bodies.parts.touching[k, 0], many.bodies.parts.touching[k, 1]
        n, gap = row_vector(many.contacts.frame, k, 0), many.contacts.gap[k]
        many.contacts.target[k, 0] = _cover(a, _own_point(k, a, 0, -1.0, many), times(-1.0, n), gap, many)
        many.contacts.target[k, 1] = _cover(b, _own_point(k, b, 3, 1.0, many), n, gap, many)


@inlined
def _is_carried(k, end, first, many):
    """True if the part that covers one end (0 or 1) of contact k has a contact from row `first` on that stays."""
    cover = many.contacts.target[k, end]
    if cover < 0.0:
        return False
    for j in range(first, many.counts[NUM_CONTACTS]):
        is_free = many.contacts.target[j, 0] < 0.0 and many.contacts.target[j, 1] < 0.0
        if is_free and float(many.bodies.parts.touching[j, end]) == cover:
            return True
    return False


@kernel
def leave_out_covered(first, h, many):
    """Leave out the contacts from row `first` on, all of one pair of bodies, that parts cover; see this module.

    h is the length of the stage [s].
    """
    _mark_covers(first, many)
    left = first
    for k in range(first, many.counts[NUM_CONTACTS]):
        if _is_carried(k, 0, first, many) or _is_carried(k, 1, first, many):
            slop = pair_slop(many.contacts.bodies[k, 0], many.contacts.bodies[k, 1], many)
            gap = many.contacts.gap[k]
            if is_stopping(gap, many.contacts.speed[k], slop, h) and not is_pressed_in(gap, many):
                many.counts[NUM_STOPPING] -= 1
            continue
        if left < k:
            copy_contact(k, left, many)
        left += 1
    many.counts[NUM_CONTACTS] = left
