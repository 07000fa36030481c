"""Two blocks: separating axes, then the clipped face or the nearest points of two edges.

Of the fifteen axes that can separate two blocks (three face normals of each, nine products of edges) the one with the
largest separation is the contact normal. On a face normal the opposite face of the other block is clipped by the sides
of this one, so that up to eight points touch, each with a name that stays while the same edges cross.
"""

from __future__ import annotations

import math

from physics.kernels.compile.decorators import inlined, kernel
from physics.kernels.math import quaternion as qt
from physics.kernels.multibody.data.contact_set import minus, pair_slop, plus, record, vector
from physics.kernels.multibody.narrowphase.box_clip import (
    clip,
    edge_at_rim,
    is_within,
    keep_lowest,
    lowest,
    within,
    write_incident_face,
)
from physics.kernels.multibody.narrowphase.box_sat import (
    FROM_A,
    FROM_B,
    best_edges,
    best_face,
    column,
    is_along_face,
    lie_flat,
    relate,
)

# Names: face (of a: 0 to 2, of b: 3 to 5) * 64 + edge in * 8 + edge out, then edges.
FACE_NAMES = 64
FIRST_EDGE_NAME = 6 * FACE_NAMES


@inlined
def _reference(a, b, face, many):
    """(block with the face, other block, axis, its sense towards the other)."""
    if face < 3:
        return a, b, face, math.copysign(1.0, many.mix[FROM_A, 0, face])
    return b, a, face - 3, -math.copysign(1.0, many.mix[FROM_B, 0, face - 3])


@inlined
def _clip_face(a, b, face, many):
    """Clip the face that looks against this one by its sides: (copy of the polygon, vertices)."""
    r, o, axis, sign = _reference(a, b, face, many)
    write_incident_face(r, o, axis, sign, many)
    d, slop = many.bodies[r].dims, pair_slop(a, b, many)
    source, count = 0, 4
    for side in range(4):
        k, s = side // 2, 1.0 - 2.0 * (side % 2)
        bound = d[(axis + 1 + k) % 3]
        if not is_within(source, count, k, s, bound + slop, many):
            count = clip(source, count, k, s, bound, 4 + side, slop, many)
            source = 1 - source
    return source, count


@inlined
def _between_faces(o, out, rim, point, many):
    """Normal of two parallel edges that touch: the middle of all that are allowed.

    An edge of a convex body allows every direction between the normals of its two faces: of the one block from `out`
    to `rim`, of block o from one to the other of those whose edge passes `point`, turned round. Both hold `out`, and
    o's ends before `rim`, a quarter turn from its other end: what both allow lies between `out` and that end.
    """
    end, most, along = out, 0.0, qt.cross(out, rim)
    w = minus(point, vector(many.place, o, 0))
    for j in range(3):
        axis = column(many.rotation, o, j)
        s = -math.copysign(1.0, qt.dot(axis, w))
        normal = (s * axis[0], s * axis[1], s * axis[2])
        towards = qt.dot(normal, rim)
        if abs(qt.dot(normal, along)) < 0.5 and towards > most:
            most, end = towards, normal
    n = plus(out, 1.0, end)
    s = 1.0 / math.sqrt(qt.dot(n, n))
    return (s * n[0], s * n[1], s * n[2])


@inlined
def _above(r, x, y, s, t, many):
    """Point s along x and t along y from the centre of block r [m]."""
    return plus(plus(vector(many.place, r, 0), s, x), t, y)


@inlined
def _touch_face(a, b, face, source, count, least, h, many):
    """Contacts between a face and the clipped face of the other block, lifted until none has a gap < least."""
    r, o, axis, sign = _reference(a, b, face, many)
    d = many.bodies[r].dims
    if count == 0:
        write_incident_face(r, o, axis, sign, many)
        source, count = keep_lowest(d[(axis + 1) % 3], d[(axis + 2) % 3], many), 1
    R, p = many.rotation, many.polygon
    x, y, out = column(R, r, (axis + 1) % 3), column(R, r, (axis + 2) % 3), column(R, r, axis)
    out = (sign * out[0], sign * out[1], sign * out[2])
    slop = pair_slop(a, b, many)
    lift = max(0.0, least + d[axis] - lowest(source, count, p))
    n, owner, first, last, side, sense = out, r, -1, -1, 0, 1.0
    if lift <= slop and not lie_flat(face, many):
        first, last, side, sense = edge_at_rim(d, axis, source, count, slop, many)
    if first >= 0:
        rim = column(R, r, side)
        point = _above(r, x, y, p[source, first, 0], p[source, first, 1], many)
        point = plus(point, p[source, first, 2], out)
        n, owner = _between_faces(o, out, (sense * rim[0], sense * rim[1], sense * rim[2]), point, many), -1
    for k in range(count):
        if first >= 0 and k != first and k != last:
            continue
        gap = p[source, k, 2] - d[axis] + lift
        point = _above(r, x, y, p[source, k, 0], p[source, k, 1], many)
        on_face, on_other = plus(point, d[axis], out), plus(point, d[axis] + gap, out)
        gap *= qt.dot(n, out)
        name = face * FACE_NAMES + 8 * many.edge[source, k, 0] + many.edge[source, k, 1]
        if face < 3:
            record(a, b, name, owner, (-n[0], -n[1], -n[2]), on_face, on_other, gap, h, many)
        else:
            record(a, b, name, owner, n, on_other, on_face, gap, h, many)


@inlined
def _middle_of_edge(b, k, n, many):
    """Middle of the edge of block b along its axis k that reaches furthest along n, world frame [m]."""
    R, d = many.rotation, many.bodies[b].dims
    point = vector(many.place, b, 0)
    for j in range(3):
        axis = column(R, b, j)
        if j != k:
            point = plus(point, math.copysign(d[j], qt.dot(axis, n)), axis)
    return point


@inlined
def _touch_edges(a, b, edges, gap, h, many):
    """The contact of two edges, at their nearest points."""
    i, j = edges // 3, edges % 3
    x, y = column(many.rotation, a, i), column(many.rotation, b, j)
    n = qt.cross(x, y)
    s = 1.0 / math.sqrt(qt.dot(n, n))
    if qt.dot(n, minus(vector(many.place, a, 0), vector(many.place, b, 0))) < 0.0:
        s = -s
    n = (s * n[0], s * n[1], s * n[2])
    p, q = _middle_of_edge(a, i, (-n[0], -n[1], -n[2]), many), _middle_of_edge(b, j, n, many)
    # Points p + s x and q + t y whose difference is along n.
    w, c = minus(q, p), qt.dot(x, y)
    t = (c * qt.dot(x, w) - qt.dot(y, w)) / (1.0 - c * c)
    s = within(qt.dot(x, w) + t * c, many.bodies[a].dims[i])
    t = within(t, many.bodies[b].dims[j])
    record(a, b, FIRST_EDGE_NAME + edges, -1, n, plus(p, s, x), plus(q, t, y), gap, h, many)


@kernel
def touch_blocks(a, b, margin, h, many):
    """Add the contacts of blocks a and b that are at most `margin` [m] apart.

    Where a face separates them or nearly does, and something of the other block is above it, no product of edges can
    say that they are further apart: that something touches.
    """
    relate(a, b, many)
    apart, face = best_face(a, b, margin, many)
    if apart > margin:
        return
    slop = pair_slop(a, b, many)
    source = count = 0
    is_clipped = apart >= -slop
    if is_clipped:
        source, count = _clip_face(a, b, face, many)
    further, edges = apart, 0
    if count == 0:
        further, edges = best_edges(a, b, margin, many)
    if further > margin:
        return
    is_face = further <= apart + slop
    if is_face or is_along_face(edges, face, many):
        if not is_clipped:
            source, count = _clip_face(a, b, face, many)
        if is_face or count > 0:
            _touch_face(a, b, face, source, count, max(apart, further), h, many)
            return
    _touch_edges(a, b, edges, further, h, many)
