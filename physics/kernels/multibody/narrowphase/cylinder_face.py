"""Contacts of a cylinder with a plane face: of a polyhedron, or the end of another cylinder (`plane_faces`).

Over the face the cylinder touches as it touches a wall (`cylinder_wall`): with the lowest point of each rim, or with a
ring of points of an end that lies flat. Where its lower line leaves the face, it touches at the side of the face. These
points belong to the cylinder, and the face owns their normal.

Where an end lies flat, or is the face that separates the bodies, the outline of the other face touches it: corners on
the disk, and points at which its sides cross the rim. These belong to the other body, and the end owns their normal. So
a cylinder tips over the edge of a table, and a block over a rim.

A pair is (cylinder, other body); normals lead out of the other body.
"""

from __future__ import annotations

import math

from physics.compiler.decorators import if_given, inlined, kernel
from physics.kernels.math import quaternion as qt
from physics.kernels.math.vector import minus, plus, row_vector, times
from physics.kernels.multibody.data.contact_set import add_contact, pair_slop, row_matrix
from physics.kernels.multibody.data.cylinders import (
    CLIPPED_FEATURE,
    CORNER_FEATURE,
    CROSSING_FEATURE,
    LOWEST_FEATURE,
    RING_FEATURE,
    RING_POINTS,
    across_axis,
    axis_of,
    is_cylinder,
    rim_arm,
    rolling_arm,
    rotation_of,
)
from physics.kernels.multibody.data.hull_tables import FIRST_FACE
from physics.kernels.multibody.data.pair_materials import pair_coefficients
from physics.kernels.multibody.data.parts import body_of
from physics.kernels.multibody.narrowphase.box_sat import FLAT_COSINE
from physics.kernels.multibody.narrowphase.flat_ends import (
    first_of_ring,
    is_level,
    may_lie_flat,
    middle_of_end,
    ring_arm,
)
from physics.kernels.multibody.narrowphase.plane_faces import face_plane, is_over, part_over


@inlined
def place_between(pair, many):
    """Vector from the centre of the second part of a pair to that of the first one, world frame [m]."""
    return minus(row_vector(many.bodies.center, pair[0], 0), row_vector(many.bodies.center, pair[1], 0))


@inlined
def end_towards(can, n, many):
    """End of a cylinder that faces against n: 0 the lower one, 1 the upper one."""
    return 0 if qt.dot(n, axis_of(rotation_of(can, many))) > 0.0 else 1


@inlined
def add_of_pair(pair, feature, owner, n, points, gap, h, many):
    """Add a contact of a pair. Its `points`, of both bodies, lead from the second centre; n leads out of the second."""
    (a, b), origin = pair, row_vector(many.bodies.center, pair[1], 0)
    p, q = plus(origin, points[0]), plus(origin, points[1])
    if a < b:
        add_contact(a, b, feature, owner, n, (p, q), gap, h, many)
    else:
        add_contact(b, a, feature, owner, (-n[0], -n[1], -n[2]), (q, p), gap, h, many)


@inlined
def _add_point(pair, feature, face, arm, limits, h, many):
    """Add the contact of the cylinder's point at `arm` with a face, if it is above; return its gap, else inf [m].

    `limits` are the least gap that it is given and the largest one that counts [m].
    """
    n, offset = face_plane(pair[1], face, many)
    p, (least, margin) = plus(place_between(pair, many), arm), limits
    gap = qt.dot(n, p) - offset
    if gap > margin or not is_over(
        pair[1], face, p, pair_slop(body_of(pair[0], many), body_of(pair[1], many), many), many
    ):
        return math.inf
    gap = max(gap, least)
    add_of_pair(pair, feature, pair[1], n, (p, plus(p, times(-gap, n))), gap, h, many)
    return gap


@kernel
def _add_ring(pair, face, end, lowest, height, limits, h, many):
    """Add the points of an end's ring that are above a face: the least gap [m]. See `cylinder_wall._add_ring`."""
    (can, other), low = pair, math.inf
    n = face_plane(other, face, many)[0]
    if is_level(can, height, many):
        out = minus(lowest, middle_of_end(can, end, rotation_of(can, many), many))
        if qt.dot(out, out) > 0.0:
            low = _add_point(pair, LOWEST_FEATURE + end, face, lowest, limits, h, many)
    mu = pair_coefficients(body_of(can, many), body_of(other, many), many)[0]
    along = first_of_ring(can, end, other, lowest, height, mu, n, many)
    for k in range(RING_POINTS):
        feature = RING_FEATURE + RING_POINTS * end + k
        low = min(low, _add_point(pair, feature, face, ring_arm(can, end, k, along, many), limits, h, many))
    return low


@inlined
def _add_on_end(pair, feature, end, p, limits, h, many):
    """Add the contact of the other body's point p with an end of the cylinder; return its gap, else inf [m]."""
    n, offset = face_plane(pair[0], end, many)
    least, margin = limits
    gap = qt.dot(n, minus(p, place_between(pair, many))) - offset
    if gap > margin:
        return math.inf
    gap = max(gap, least)
    add_of_pair(pair, feature, pair[0], times(-1.0, n), (plus(p, times(-gap, n)), p), gap, h, many)
    return gap


def _no_outline(pair, face, end, limits, h, many):
    return math.inf


@if_given("many.narrowphase.hulls", _no_outline)
def _add_polygon(pair, face, end, limits, h, many):
    """Add corners of a polygon that lie on an end, and the crossings of its sides with the rim: the least gap [m]."""
    hulls, (can, other), low = many.narrowphase.hulls, pair, math.inf
    slop = pair_slop(body_of(can, many), body_of(other, many), many)
    x, far = place_between(pair, many), many.bodies.body[can].dims[0] + slop
    y, k = axis_of(rotation_of(can, many)), hulls.of[other, FIRST_FACE] + face
    start, stop = hulls.loops[k, 0], hulls.loops[k, 1]
    for side in range(stop - start):
        p = row_vector(hulls.corner[0], hulls.ring[start + side], 0)
        q = row_vector(hulls.corner[0], hulls.ring[start + side + 1 if start + side + 1 < stop else start], 0)
        w = across_axis(y, minus(p, x))
        if qt.dot(w, w) <= far * far:
            low = min(low, _add_on_end(pair, CORNER_FEATURE + side, end, p, limits, h, many))
        first, last, into, out_of = part_over(can, end, minus(p, x), minus(q, x), slop, many)
        if first > last:
            continue
        if into >= 0:
            at = plus(p, times(first, minus(q, p)))
            low = min(low, _add_on_end(pair, CROSSING_FEATURE + 2 * side, end, at, limits, h, many))
        if out_of >= 0:
            at = plus(p, times(last, minus(q, p)))
            low = min(low, _add_on_end(pair, CROSSING_FEATURE + 2 * side + 1, end, at, limits, h, many))
    return low


@kernel
def _add_disk(pair, face, end, limits, h, many):
    """Add the ring of another cylinder's end that lies on an end, and the crossings of both rims: the least gap [m]."""
    (can, other), x = pair, place_between(pair, many)
    y, r, s = axis_of(rotation_of(can, many)), many.bodies.body[can].dims[0], many.bodies.body[other].dims[0]
    n = face_plane(can, end, many)[0]
    arm = rim_arm(other, face, rotation_of(other, many), times(-1.0, n), many)
    p = across_axis(axis_of(rotation_of(other, many)), n)
    height = 2.0 * s * math.sqrt(qt.dot(p, p))
    low = _add_ring((other, can), end, face, arm, height, limits, h, many)
    middle = middle_of_end(other, face, rotation_of(other, many), many)
    w = across_axis(y, minus(middle, x))
    d = math.sqrt(qt.dot(w, w))
    if not abs(r - s) < d < r + s:
        return low
    along = 0.5 * (d * d + r * r - s * s) / d
    wide = math.sqrt(max(0.0, r * r - along * along))
    foot = plus(x, plus(middle_of_end(can, end, rotation_of(can, many), many), times(along / d, w)))
    for k in range(2):
        at = plus(foot, times((2.0 * k - 1.0) * wide / d, qt.cross(y, w)))
        gap = qt.dot(n, minus(middle, at))  # both ends are nearly parallel
        low = min(low, _add_on_end(pair, CROSSING_FEATURE + k, end, plus(at, times(gap, n)), limits, h, many))
    return low


@inlined
def add_outline(pair, face, end, limits, h, many):
    """Add the contacts of the outline of a face with an end of the cylinder; return the least gap [m].

    `limits` are the least gap that they are given and the largest one that counts [m].
    """
    if is_cylinder(pair[1], many):
        return _add_disk(pair, face, end, limits, h, many)
    return _add_polygon(pair, face, end, limits, h, many)


@kernel
def add_flat_end(pair, face, end, limits, h, many):
    """Add the ring of an end that may lie flat on a face within h [s]: (least gap [m], whether it may).

    On another end one that leans by more than 11 degrees does not count: crossings of rims are found in one plane.
    Arguments are those of `add_outline`.
    """
    can, other = pair
    n, offset = face_plane(other, face, many)
    R = row_matrix(many.bodies.rotation, can)
    p, arm = across_axis(axis_of(R), n), rim_arm(can, end, R, times(-1.0, n), many)
    height = 2.0 * many.bodies.body[can].dims[0] * math.sqrt(qt.dot(p, p))
    gap = qt.dot(n, plus(place_between(pair, many), arm)) - offset
    if gap > limits[1] or (is_cylinder(other, many) and abs(qt.dot(n, axis_of(R))) < FLAT_COSINE):
        return math.inf, False
    if not may_lie_flat(can, end, other, n, arm, (gap, height), h, many):
        return math.inf, False
    return _add_ring(pair, face, end, arm, height, limits, h, many), True


@kernel
def _add_line(pair, face, one, two, limits, h, many):
    """Add the contacts of the cylinder's lower line where it passes the sides of a face: the least gap [m].

    `one` and `two` are the arms of the line's ends.
    """
    (can, other), x, low = pair, place_between(pair, many), math.inf
    n, l = face_plane(other, face, many)[0], many.bodies.body[can].dims[1]
    slop = pair_slop(body_of(can, many), body_of(other, many), many)
    first, last, into, out_of = part_over(other, face, plus(x, one), plus(x, two), slop, many)
    if first > last:
        return low
    for k in range(2):
        side, place = (into, (2.0 * first - 1.0) * l) if k == 0 else (out_of, (2.0 * last - 1.0) * l)
        if side >= 0:
            arm = rolling_arm(can, place, rotation_of(can, many), times(-1.0, n), many)
            low = min(low, _add_point(pair, CLIPPED_FEATURE + side, face, arm, limits, h, many))
    return low


@kernel
def add_on_face(pair, face, limits, h, many):
    """Add the contacts of a cylinder above a face; return the least gap, inf if there is none [m].

    `limits` are the least gap that they are given and the largest one that counts [m].
    """
    can, other = pair
    n, R = face_plane(other, face, many)[0], rotation_of(can, many)
    one, two = rim_arm(can, 0, R, times(-1.0, n), many), rim_arm(can, 1, R, times(-1.0, n), many)
    low, lower = _add_line(pair, face, one, two, limits, h, many), end_towards(can, n, many)
    for end in range(2):
        found, is_flat = math.inf, False
        if end == lower:
            found, is_flat = add_flat_end(pair, face, end, limits, h, many)
        if is_flat:
            if abs(qt.dot(n, axis_of(R))) >= FLAT_COSINE:  # else the end's normal is no way out
                found = min(found, add_outline(pair, face, end, limits, h, many))
        else:
            found = _add_point(pair, end, face, one if end == 0 else two, limits, h, many)
        low = min(low, found)
    return low
