"""Two convex polyhedra: separating axes, then the clipped face or the nearest points of two edges.

What `box_box` does for two blocks, for polygons. A plane that separates them best is parallel to a face of one, or
to an edge of each. Of two edges only those count whose arcs on the sphere of normals cross, one of them turned round:
the others are no face of the difference of the two [1].

References
----------
.. [1] D. Gregorius, *The separating axis test between convex polyhedra*, Game Developers Conference, 2013.
"""

from __future__ import annotations

import math

from physics.kernels.compile.decorators import inlined, kernel
from physics.kernels.math import quaternion as qt
from physics.kernels.multibody.data.contact_set import minus, pair_slop, plus, record, vector
from physics.kernels.multibody.data.hull_tables import (
    BEGIN,
    END,
    FIRST_CORNER,
    FIRST_EDGE,
    FIRST_FACE,
    LAST_CORNER,
    LAST_EDGE,
    LAST_FACE,
    LEFT,
    RIGHT,
)
from physics.kernels.multibody.narrowphase.box_sat import FLAT, PARALLEL
from physics.kernels.multibody.narrowphase.hull_clip import SIDES, clip_face, incident
from physics.kernels.multibody.narrowphase.hull_pose import nearest_on_face, put_in_place

# Names: ((body of the pair, face) * 128 + edge in) * 128 + edge out (see `hull_clip.SIDES`); then pairs of edges. A
# polyhedron of 64 corners has at most 124 faces and 186 edges (Euler's formula).
MOST_FACES, MOST_EDGES = 128, 192
FIRST_EDGE_NAME = 2 * MOST_FACES * 4 * SIDES * SIDES


@inlined
def best_face(which, b, other, far, many):
    """(separation, face) of the face of body b, number `which` of the pair, that is furthest from the body `other`.

    Beyond `far` nothing more is looked for: that is too far already.
    """
    hulls, best, face = many.hulls, -math.inf, 0
    count = hulls.of[other, LAST_CORNER] - hulls.of[other, FIRST_CORNER]
    for f in range(hulls.of[b, LAST_FACE] - hulls.of[b, FIRST_FACE]):
        n, low = vector(hulls.normal[which], f, 0), math.inf
        for k in range(count):
            low = min(low, qt.dot(n, vector(hulls.corner[1 - which], k, 0)))
        if low - hulls.offset[which, f] > best:
            best, face = low - hulls.offset[which, f], f
            if best > far:
                break
    return best, face


@inlined
def edge_of(which, b, e, many):
    """(begin, direction, normal on the left, on the right) of edge e of body b, number `which` of the pair."""
    hulls, k = many.hulls, many.hulls.of[b, FIRST_EDGE] + e
    p = vector(hulls.corner[which], hulls.edges[k, BEGIN], 0)
    left, right = (
        vector(hulls.normal[which], hulls.edges[k, LEFT], 0),
        vector(hulls.normal[which], hulls.edges[k, RIGHT], 0),
    )
    return p, minus(vector(hulls.corner[which], hulls.edges[k, END], 0), p), left, right


@inlined
def _arcs_cross(d, left, right, e, other_left, other_right):
    """True if the arc between the normals of an edge crosses that between the opposite normals of another edge.

    The arc's great circle is perpendicular to the edge: its ends must be on both sides of the other's circle, and the
    other way round, on the same hemisphere.
    """
    c, f = qt.dot(d, other_left), qt.dot(d, other_right)
    a, b = qt.dot(e, left), qt.dot(e, right)
    return c * f < 0.0 and a * b < 0.0 and c * b < 0.0


@inlined
def best_edges(a, b, many):
    """(separation, number of the edge of a, of b) of the two edges that separate most, -inf if there are none."""
    hulls, best, first, second = many.hulls, -math.inf, 0, 0
    inside = vector(hulls.centre, 0, 0)
    for i in range(hulls.of[a, LAST_EDGE] - hulls.of[a, FIRST_EDGE]):
        p, d, left, right = edge_of(0, a, i, many)
        for j in range(hulls.of[b, LAST_EDGE] - hulls.of[b, FIRST_EDGE]):
            q, e, other_left, other_right = edge_of(1, b, j, many)
            if not _arcs_cross(d, left, right, e, other_left, other_right):
                continue
            n = qt.cross(d, e)
            square = qt.dot(n, n)
            if square < PARALLEL * qt.dot(d, d) * qt.dot(e, e):
                continue
            s = math.copysign(1.0 / math.sqrt(square), qt.dot(n, minus(p, inside)))
            if s * qt.dot(n, minus(q, p)) > best:
                best, first, second = s * qt.dot(n, minus(q, p)), i, j
    return best, first, second


@inlined
def _edge_normal(a, b, i, j, many):
    """Unit vector out of a, across edges i of a and j of b."""
    p, d, _, _ = edge_of(0, a, i, many)
    _, e, _, _ = edge_of(1, b, j, many)
    n = qt.cross(d, e)
    s = math.copysign(1.0 / math.sqrt(qt.dot(n, n)), qt.dot(n, minus(p, vector(many.hulls.centre, 0, 0))))
    return (s * n[0], s * n[1], s * n[2])


@inlined
def _lowest_vertex(which, r, o, face, many):
    """Leave the vertex of the face against this one that is lowest in copy 0, moved above this one: (copy, vertices).

    For bodies that are apart beside each other as well: the plane between them keeps them from each other all the same.
    """
    hulls, low = many.hulls, 0
    out = vector(hulls.normal[which], face, 0)
    p, sides, count = hulls.polygon, hulls.sides, incident(1 - which, o, out, many)
    for k in range(count):
        if qt.dot(out, vector(p[0], k, 0)) < qt.dot(out, vector(p[0], low, 0)):
            low = k
    x = vector(p[0], low, 0)
    y = nearest_on_face(which, r, face, x, many)
    p[0, 0, 0], p[0, 0, 1], p[0, 0, 2] = plus(y, qt.dot(out, minus(x, y)), out)
    sides[0, 0, 0], sides[0, 0, 1] = sides[0, low, 0], sides[0, low, 1]
    return 0, 1


@inlined
def _height(which, face, source, count, many):
    """Height of the lowest vertex of the clipped polygon above a face; inf where there is none."""
    out, low = vector(many.hulls.normal[which], face, 0), math.inf
    for k in range(count):
        low = min(low, qt.dot(out, vector(many.hulls.polygon[source], k, 0)))
    return low - many.hulls.offset[which, face]


@inlined
def _touch_face(a, b, which, face, source, count, least, h, many):
    """Contacts between a face and the clipped face of the other body, lifted until none has a gap < least."""
    hulls, origin = many.hulls, vector(many.place, a, 0)
    out, offset = vector(hulls.normal[which], face, 0), hulls.offset[which, face]
    lift = max(0.0, least - _height(which, face, source, count, many))
    for k in range(count):
        p = plus(origin, 1.0, vector(hulls.polygon[source], k, 0))
        height = qt.dot(out, vector(hulls.polygon[source], k, 0)) - offset
        on_face, on_other = plus(p, -height, out), plus(p, lift, out)
        into, out_of = hulls.sides[source, k, 0], hulls.sides[source, k, 1]
        name = ((which * MOST_FACES + face) * 2 * SIDES + into) * 2 * SIDES + out_of
        if which == 0:
            record(a, b, name, a, (-out[0], -out[1], -out[2]), on_face, on_other, height + lift, h, many)
        else:
            record(a, b, name, b, out, on_other, on_face, height + lift, h, many)


@inlined
def _touch_edges(a, b, i, j, n, gap, h, many):
    """The contact of edges i of a and j of b, n out of a, at their nearest points."""
    origin = vector(many.place, a, 0)
    p, d, _, _ = edge_of(0, a, i, many)
    q, e, _, _ = edge_of(1, b, j, many)
    # Points p + s d and q + t e whose difference is along n, both on their segments.
    w, dd, de, ee = minus(q, p), qt.dot(d, d), qt.dot(d, e), qt.dot(e, e)
    t = (de * qt.dot(d, w) - dd * qt.dot(e, w)) / (dd * ee - de * de)
    s = min(max((qt.dot(d, w) + t * de) / dd, 0.0), 1.0)
    t = min(max(t, 0.0), 1.0)
    on_a, on_b = plus(plus(origin, 1.0, p), s, d), plus(plus(origin, 1.0, q), t, e)
    name = FIRST_EDGE_NAME + i * MOST_EDGES + j
    record(a, b, name, -1, (-n[0], -n[1], -n[2]), on_a, on_b, gap, h, many)


@kernel
def touch_hulls(a, b, margin, h, many):
    """Add the contacts of polyhedra a and b (hulls or blocks) that are at most `margin` [m] apart.

    Where a face separates them or nearly does, and something of the other body is above it, no pair of edges can say
    that they are further apart: that something touches. Where edges do say so, and lie nearly flat on that face, what
    is above it touches, as far away as the edges say, unless it is further away itself.

    The first body's face is preferred unless the other's separates more by the slop, and a face to edges likewise: what
    is equal must not change with rounding.
    """
    origin, slop = vector(many.place, a, 0), pair_slop(a, b, many)
    put_in_place(0, a, origin, many)
    put_in_place(1, b, origin, many)
    apart, face = best_face(0, a, b, margin, many)
    other, other_face = best_face(1, b, a, margin, many)
    which, r, o = 0, a, b
    if other > apart + slop:
        apart, face, which, r, o = other, other_face, 1, b, a
    if apart > margin:
        return
    source = count = 0
    is_clipped = apart >= -slop
    if is_clipped:
        source, count = clip_face(which, r, o, face, slop, many)
    further, i, j = apart, 0, 0
    if count == 0:
        further, i, j = best_edges(a, b, many)
    if further > margin:
        return
    is_face = further <= apart + slop
    n = (0.0, 0.0, 0.0)
    if not is_face:
        n = _edge_normal(a, b, i, j, many)
    out = vector(many.hulls.normal[which], face, 0)
    if is_face or (qt.dot(n, out) if which == 0 else -qt.dot(n, out)) >= FLAT:
        if not is_clipped:
            source, count = clip_face(which, r, o, face, slop, many)
        if is_face and count == 0:
            source, count = _lowest_vertex(which, r, o, face, many)
        if is_face or _height(which, face, source, count, many) <= further:
            _touch_face(a, b, which, face, source, count, max(apart, further), h, many)
            return
    _touch_edges(a, b, i, j, n, further, h, many)
