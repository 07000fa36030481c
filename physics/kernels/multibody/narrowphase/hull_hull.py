"""Contacts of two convex polyhedra: separating axis test, then the clipped face or nearest points of two edges.

As in `box_box`, but for any polygons. The plane that separates two polyhedra best is parallel to a face of one of them,
or to an edge of each. The arc of an edge joins the normals of its two faces on the unit sphere. A pair of edges counts
only if the arc of one crosses the reversed arc of the other. Other pairs do not form a face of the Minkowski difference
[1]_.

References
----------
.. [1] D. Gregorius, *The separating axis test between convex polyhedra*, Game Developers Conference, 2013.
"""

from __future__ import annotations

import math

from physics.compiler.decorators import if_given, inlined, kernel
from physics.kernels.math import quaternion as qt
from physics.kernels.math.vector import row_vector
from physics.kernels.multibody.data.arrays import NUM_CONTACTS
from physics.kernels.multibody.data.clipped_points import follow_vertex
from physics.kernels.multibody.data.contact_set import add_contact, add_scaled, pair_slop, subtract
from physics.kernels.multibody.data.hull_tables import (
    EDGE_END,
    EDGE_LEFT_FACE,
    EDGE_RIGHT_FACE,
    EDGE_START,
    FIRST_CORNER,
    FIRST_EDGE,
    FIRST_FACE,
    LAST_CORNER,
    LAST_EDGE,
    LAST_FACE,
)
from physics.kernels.multibody.narrowphase.box_sat import FLAT_COSINE, PARALLEL_SINE_SQUARED, are_faces_parallel
from physics.kernels.multibody.narrowphase.hull_clip import (
    CLIP_SIDE_OFFSET,
    clip_incident_face,
    write_hull_incident_face,
)
from physics.kernels.multibody.narrowphase.hull_pose import nearest_on_face, pose_hull

# Features of a contact: ((body of the pair, face) * 128 + edge in) * 128 + edge out (see `hull_clip.CLIP_SIDE_OFFSET`);
# then pairs of edges. A polyhedron of 64 corners has at most 124 faces and 186 edges (Euler's formula).
_MAX_FACES, _MAX_EDGES = 128, 192
_FIRST_EDGE_FEATURE = 2 * _MAX_FACES * 4 * CLIP_SIDE_OFFSET * CLIP_SIDE_OFFSET


@inlined
def max_hull_face_separation(which, b, other, far, many):
    """Find the face of body b that is farthest from the body `other`: (separation [m], face).

    Body b is number `which` of the pair. The search stops at a face farther than `far` [m].
    """
    hulls, best, face = many.narrowphase.hulls, -math.inf, 0
    count = hulls.of[other, LAST_CORNER] - hulls.of[other, FIRST_CORNER]
    for f in range(hulls.of[b, LAST_FACE] - hulls.of[b, FIRST_FACE]):
        n, low = row_vector(hulls.normal[which], f, 0), math.inf
        for k in range(count):
            low = min(low, qt.dot(n, row_vector(hulls.corner[1 - which], k, 0)))
        if low - hulls.offset[which, f] > best:
            best, face = low - hulls.offset[which, f], f
            if best > far:
                break
    return best, face


@inlined
def hull_edge(which, b, e, many):
    """Edge e of body b: (start [m], vector to its end [m], normal of the left face, normal of the right face).

    Body b is number `which` of the pair; results are in the coordinates of the pair (`hull_pose`).
    """
    hulls, k = many.narrowphase.hulls, many.narrowphase.hulls.of[b, FIRST_EDGE] + e
    p = row_vector(hulls.corner[which], hulls.edges[k, EDGE_START], 0)
    left, right = (
        row_vector(hulls.normal[which], hulls.edges[k, EDGE_LEFT_FACE], 0),
        row_vector(hulls.normal[which], hulls.edges[k, EDGE_RIGHT_FACE], 0),
    )
    return p, subtract(row_vector(hulls.corner[which], hulls.edges[k, EDGE_END], 0), p), left, right


@inlined
def _is_minkowski_face(d, left, right, e, other_left, other_right):
    """True if two edges form a face of the Minkowski difference of their bodies.

    d and e are the vectors of the edges; `left`, `right`, `other_left` and `other_right` are the normals of the faces
    at them. The arc between the first edge's normals must cross the arc between the opposite normals of the other edge.
    The great circle of an arc is perpendicular to its edge. So the arcs cross if the ends of each lie on both sides of
    the other's circle, and all on one hemisphere.
    """
    c, f = qt.dot(d, other_left), qt.dot(d, other_right)
    a, b = qt.dot(e, left), qt.dot(e, right)
    return c * f < 0.0 and a * b < 0.0 and c * b < 0.0


@inlined
def max_hull_edge_separation(a, b, many):
    """Find the two edges across which bodies a and b are farthest apart: (separation [m], edge of a, edge of b).

    Body a is number 0 of the pair, b number 1. The separation is -inf if no pair of edges counts
    (`_is_minkowski_face`).
    """
    hulls, best, first, second = many.narrowphase.hulls, -math.inf, 0, 0
    inside = row_vector(hulls.centre, 0, 0)
    for i in range(hulls.of[a, LAST_EDGE] - hulls.of[a, FIRST_EDGE]):
        p, d, left, right = hull_edge(0, a, i, many)
        for j in range(hulls.of[b, LAST_EDGE] - hulls.of[b, FIRST_EDGE]):
            q, e, other_left, other_right = hull_edge(1, b, j, many)
            if not _is_minkowski_face(d, left, right, e, other_left, other_right):
                continue
            n = qt.cross(d, e)
            square = qt.dot(n, n)
            if square < PARALLEL_SINE_SQUARED * qt.dot(d, d) * qt.dot(e, e):
                continue
            s = math.copysign(1.0 / math.sqrt(square), qt.dot(n, subtract(p, inside)))
            if s * qt.dot(n, subtract(q, p)) > best:
                best, first, second = s * qt.dot(n, subtract(q, p)), i, j
    return best, first, second


@inlined
def _edge_normal(a, b, i, j, many):
    """Unit vector across edge i of body a and edge j of body b, out of a."""
    p, d, _, _ = hull_edge(0, a, i, many)
    _, e, _, _ = hull_edge(1, b, j, many)
    n = qt.cross(d, e)
    s = math.copysign(
        1.0 / math.sqrt(qt.dot(n, n)), qt.dot(n, subtract(p, row_vector(many.narrowphase.hulls.centre, 0, 0)))
    )
    return (s * n[0], s * n[1], s * n[2])


@inlined
def _keep_deepest_vertex(which, r, o, face, many):
    """Reduce the polygon in copy 0 of `hulls.polygon` to the lowest vertex of the incident face: (copy 0, 1 vertex).

    Body r, number `which` of the pair, has the reference face `face`; body o has the incident face. The vertex is moved
    over the reference face. This serves bodies that are also apart sideways: the plane of the face still separates
    them.
    """
    hulls, low = many.narrowphase.hulls, 0
    out = row_vector(hulls.normal[which], face, 0)
    p, sides, count = hulls.polygon, hulls.sides, write_hull_incident_face(1 - which, o, out, many)
    for k in range(count):
        if qt.dot(out, row_vector(p[0], k, 0)) < qt.dot(out, row_vector(p[0], low, 0)):
            low = k
    x = row_vector(p[0], low, 0)
    y = nearest_on_face(which, r, face, x, many)
    p[0, 0, 0], p[0, 0, 1], p[0, 0, 2] = add_scaled(y, qt.dot(out, subtract(x, y)), out)
    sides[0, 0, 0], sides[0, 0, 1] = sides[0, low, 0], sides[0, low, 1]
    return 0, 1


@inlined
def _clipped_height(which, face, source, count, many):
    """Height of the lowest of `count` vertices of `hulls.polygon[source]` above a face [m]; inf if there is none.

    `face` belongs to body `which` of the pair.
    """
    out, low = row_vector(many.narrowphase.hulls.normal[which], face, 0), math.inf
    for k in range(count):
        low = min(low, qt.dot(out, row_vector(many.narrowphase.hulls.polygon[source], k, 0)))
    return low - many.narrowphase.hulls.offset[which, face]


@if_given("many.lone")
def _follow_clipped(before, bodies, place, out, point, many):
    """Let the contact that was added last follow its edges (`clipped_points.follow_vertex`).

    `before` is the number of contacts before it, `bodies` are those with the reference and the incident face. Its
    `point` [m] is vertex k of `count` in copy `source` of `hulls.polygon`, where `place` is (k, count, source). `out`
    is the normal of the reference face. All vectors are in the world frame.
    """
    if many.lone.slow[0] == 1:
        return
    k, count, source = place
    p, sides = many.narrowphase.hulls.polygon[source], many.narrowphase.hulls.sides
    here = row_vector(p, k, 0)
    into = subtract(here, row_vector(p, (k + count - 1) % count, 0))
    out_of = subtract(row_vector(p, (k + 1) % count, 0), here)
    kinds = (sides[source, k, 0] >= CLIP_SIDE_OFFSET, sides[source, k, 1] >= CLIP_SIDE_OFFSET)
    follow_vertex(before, bodies, kinds, (into, out_of), out, point, many)


@inlined
def _add_face_contacts(a, b, which, face, source, count, least, h, many):
    """Add the contacts between `face` and the clipped face of the other body, given as a polygon.

    `face` belongs to body `which` of the pair (0: a, 1: b). The polygon has `count` vertices in copy `source` of
    `hulls.polygon`. It is lifted along the normal until no contact has a gap below `least` [m]. h is the length of the
    stage [s].
    """
    hulls, origin = many.narrowphase.hulls, row_vector(many.bodies.center, a, 0)
    out, offset = row_vector(hulls.normal[which], face, 0), hulls.offset[which, face]
    lift = max(0.0, least - _clipped_height(which, face, source, count, many))
    for k in range(count):
        p = add_scaled(origin, 1.0, row_vector(hulls.polygon[source], k, 0))
        height = qt.dot(out, row_vector(hulls.polygon[source], k, 0)) - offset
        on_face, on_other = add_scaled(p, -height, out), add_scaled(p, lift, out)
        into, out_of = hulls.sides[source, k, 0], hulls.sides[source, k, 1]
        feature = ((which * _MAX_FACES + face) * 2 * CLIP_SIDE_OFFSET + into) * 2 * CLIP_SIDE_OFFSET + out_of
        before = many.counts[NUM_CONTACTS]
        if which == 0:
            add_contact(a, b, feature, a, (-out[0], -out[1], -out[2]), (on_face, on_other), height + lift, h, many)
        else:
            add_contact(a, b, feature, b, out, (on_other, on_face), height + lift, h, many)
        if count > 2:
            _follow_clipped(before, (a, b) if which == 0 else (b, a), (k, count, source), out, on_other, many)


@inlined
def _add_edge_contact(a, b, i, j, n, gap, h, many):
    """Add the contact of edge i of body a and edge j of body b at their nearest points, with a given gap [m].

    n is the unit vector across both edges, out of a; h is the length of the stage [s].
    """
    origin = row_vector(many.bodies.center, a, 0)
    p, d, _, _ = hull_edge(0, a, i, many)
    q, e, _, _ = hull_edge(1, b, j, many)
    # Points p + s d and q + t e whose difference is along n, both on their segments.
    w, dd, de, ee = subtract(q, p), qt.dot(d, d), qt.dot(d, e), qt.dot(e, e)
    t = (de * qt.dot(d, w) - dd * qt.dot(e, w)) / (dd * ee - de * de)
    s = min(max((qt.dot(d, w) + t * de) / dd, 0.0), 1.0)
    t = min(max(t, 0.0), 1.0)
    on_a, on_b = add_scaled(add_scaled(origin, 1.0, p), s, d), add_scaled(add_scaled(origin, 1.0, q), t, e)
    feature = _FIRST_EDGE_FEATURE + i * _MAX_EDGES + j
    add_contact(a, b, feature, -1, (-n[0], -n[1], -n[2]), (on_a, on_b), gap, h, many)


def _never(face, other, many):
    return False


@if_given("many.even", _never)
def _are_parallel(face, other, many):
    """True if `face` of polyhedron 0 and face `other` of polyhedron 1 lie on each other (`are_faces_parallel`)."""
    n, m = row_vector(many.narrowphase.hulls.normal[0], face, 0), row_vector(many.narrowphase.hulls.normal[1], other, 0)
    return are_faces_parallel(-qt.dot(n, m), many)


@kernel
def collide_hulls(a, b, margin, h, many):
    """Add the contacts of polyhedra a and b (hulls or blocks) that are at most `margin` [m] apart.

    If a face separates the bodies, or nearly so, and a part of the other body is above it, that part touches: no pair
    of edges can have a larger separation. Else the pair of edges with the largest separation may touch. If the normal
    of the edges is nearly that of the face, the part above the face touches instead, at the separation of the edges,
    unless that part is farther away.

    The face of a is preferred unless that of b separates by a slop more, and a face is preferred to edges likewise: a
    choice between equals must not change with rounding. Under error control parallel faces are equals. h is the length
    of the stage [s].
    """
    origin, slop = row_vector(many.bodies.center, a, 0), pair_slop(a, b, many)
    pose_hull(0, a, origin, many)
    pose_hull(1, b, origin, many)
    apart, face = max_hull_face_separation(0, a, b, margin, many)
    other, other_face = max_hull_face_separation(1, b, a, margin, many)
    which, r, o = 0, a, b
    if other > apart + slop and not _are_parallel(face, other_face, many):
        apart, face, which, r, o = other, other_face, 1, b, a
    if apart > margin:
        return
    source = count = 0
    is_clipped = apart >= -slop
    if is_clipped:
        source, count = clip_incident_face(which, r, o, face, slop, many)
    further, i, j = apart, 0, 0
    if count == 0:
        further, i, j = max_hull_edge_separation(a, b, many)
    if further > margin:
        return
    is_face = further <= apart + slop
    n = (0.0, 0.0, 0.0)
    if not is_face:
        n = _edge_normal(a, b, i, j, many)
    out = row_vector(many.narrowphase.hulls.normal[which], face, 0)
    if is_face or (qt.dot(n, out) if which == 0 else -qt.dot(n, out)) >= FLAT_COSINE:
        if not is_clipped:
            source, count = clip_incident_face(which, r, o, face, slop, many)
        if is_face and count == 0:
            source, count = _keep_deepest_vertex(which, r, o, face, many)
        if is_face or _clipped_height(which, face, source, count, many) <= further:
            _add_face_contacts(a, b, which, face, source, count, max(apart, further), h, many)
            return
    _add_edge_contact(a, b, i, j, n, further, h, many)
