"""Two blocks: separating axes, then the clipped face or the nearest points of two edges.

Of the fifteen axes that can separate two blocks (three face normals of each, nine products of edges) the one with the
largest separation is the contact normal. On a face normal the opposite face of the other block is clipped by the sides
of this one, so that up to eight points touch, each with a name that stays while the same edges cross.

References
----------
.. [1] S. Gottschalk, M. C. Lin, D. Manocha, *OBBTree*, SIGGRAPH 1996 (the fifteen axes).
.. [2] I. E. Sutherland, G. W. Hodgman, *Reentrant polygon clipping*, CACM 17, 1974.
"""

from __future__ import annotations

import math

from physics.kernels import quaternion as qt
from physics.kernels.compiler import inlined, kernel
from physics.kernels.many.contacts import minus, pair_slop, plus, record, vector

# Squared sine of the angle between two edges below which they are parallel: their product says nothing that a face
# does not. Rounding of the nine products is 1e-16; its square root would still be noise.
PARALLEL = 1.0e-12

# Cosine of the angle between the product of two edges and a face normal above which the faces count as lying flat on
# each other (11 degrees). One point would let them tip to and fro; the clipped face holds them, at the distance that
# the edges say.
FLAT = 0.98

# Names: face (of a: 0 to 2, of b: 3 to 5) * 64 + edge in * 8 + edge out, then edges.
FACE_NAMES = 64
FIRST_EDGE_NAME = 6 * FACE_NAMES

AXES, SIZES, FROM_A, FROM_B = 0, 1, 2, 3


@inlined
def _relate(a, b, many):
    """Write `many.mix`: axes of b in a, absolute values, and the way from a to b in both frames."""
    R, mix, place = many.rotation, many.mix, many.place
    for i in range(3):
        for j in range(3):
            c = R[a, i] * R[b, j] + R[a, 3 + i] * R[b, 3 + j] + R[a, 6 + i] * R[b, 6 + j]
            mix[AXES, i, j], mix[SIZES, i, j] = c, abs(c)
    d = minus(vector(place, b, 0), vector(place, a, 0))
    for i in range(3):
        mix[FROM_A, 0, i] = R[a, i] * d[0] + R[a, 3 + i] * d[1] + R[a, 6 + i] * d[2]
        mix[FROM_B, 0, i] = R[b, i] * d[0] + R[b, 3 + i] * d[1] + R[b, 6 + i] * d[2]


@inlined
def best_face(a, b, many):
    """(separation, face) of the face normal that separates most; the first block's unless the other's is better."""
    S, da, db = many.mix[SIZES], many.bodies[a].dims, many.bodies[b].dims
    way_a, way_b = many.mix[FROM_A, 0], many.mix[FROM_B, 0]
    best, face = -math.inf, 0
    slop = pair_slop(a, b, many)
    for i in range(3):
        s = abs(way_a[i]) - (da[i] + (db[0] * S[i, 0] + db[1] * S[i, 1] + db[2] * S[i, 2]))
        if s > best + slop:
            best, face = s, i
    for j in range(3):
        s = abs(way_b[j]) - (db[j] + (da[0] * S[0, j] + da[1] * S[1, j] + da[2] * S[2, j]))
        if s > best + slop:
            best, face = s, 3 + j
    return best, face


@inlined
def best_edges(a, b, many):
    """(separation, 3 i + j) of the product of edges i of a and j of b that separates most."""
    C, S, way = many.mix[AXES], many.mix[SIZES], many.mix[FROM_A, 0]
    da, db = many.bodies[a].dims, many.bodies[b].dims
    best, edges = -math.inf, 0
    for i in range(3):
        i1, i2 = (i + 1) % 3, (i + 2) % 3
        for j in range(3):
            square = 1.0 - C[i, j] * C[i, j]
            if square < PARALLEL:
                continue
            j1, j2 = (j + 1) % 3, (j + 2) % 3
            apart = abs(way[i2] * C[i1, j] - way[i1] * C[i2, j])
            size = (da[i1] * S[i2, j] + da[i2] * S[i1, j]) + (db[j1] * S[i, j2] + db[j2] * S[i, j1])
            s = (apart - size) / math.sqrt(square)
            if s > best:
                best, edges = s, 3 * i + j
    return best, edges


@inlined
def _column(R, b, k):
    """Axis k of body b, world frame."""
    return (R[b, k], R[b, 3 + k], R[b, 6 + k])


@inlined
def _crossing(p, q, axis, bound):
    """Point of the edge from p to q at coordinate `bound`."""
    t = (bound - p[axis]) / (q[axis] - p[axis])
    return plus(p, t, minus(q, p))


@inlined
def _is_within(source, count, axis, sign, bound, many):
    """Whether sign * coordinate <= bound for every vertex of the polygon in copy `source`: nothing to clip."""
    furthest = -math.inf
    for k in range(count):
        furthest = max(furthest, sign * many.polygon[source, k, axis])
    return furthest <= bound


@inlined
def _clip(source, count, axis, sign, bound, side, slop, many):
    """Clip the polygon in copy `source` by sign * coordinate <= bound; its vertices, now in the other copy.

    A vertex no further than the slop outside stays: it would otherwise come and go with rounding where two faces end
    together.
    """
    p, edge, into = many.polygon, many.edge, 1 - source
    kept = 0
    for k in range(count):
        m = (k + 1) % count
        here, there = sign * p[source, k, axis] - bound, sign * p[source, m, axis] - bound
        if here <= slop:
            for c in range(3):
                p[into, kept, c] = p[source, k, c]
            edge[into, kept, 0], edge[into, kept, 1] = edge[source, k, 0], edge[source, k, 1]
            kept += 1
        if (here <= slop) != (there <= slop):
            cut = _crossing(vector(p[source], k, 0), vector(p[source], m, 0), axis, sign * bound)
            p[into, kept, 0], p[into, kept, 1], p[into, kept, 2] = cut
            leaving = here <= slop
            edge[into, kept, 0] = edge[source, k, 1] if leaving else side
            edge[into, kept, 1] = side if leaving else edge[source, k, 1]
            kept += 1
    return kept


@inlined
def _incident(r, o, axis, sign, many):
    """Write the face of block o that looks most against the face of block r into copy 0, in the frame of that face.

    Coordinates along the axes behind `axis` of r, and height along sign * axis above the centre of r.
    """
    R, d, p = many.rotation, many.bodies[o].dims, many.polygon
    out = _column(R, r, axis)
    out = (sign * out[0], sign * out[1], sign * out[2])
    x, y = _column(R, r, (axis + 1) % 3), _column(R, r, (axis + 2) % 3)
    best, face, side = -1.0, 0, 1.0
    for j in range(3):
        c = qt.dot(out, _column(R, o, j))
        if abs(c) > best:
            best, face, side = abs(c), j, -math.copysign(1.0, c)
    center = plus(minus(vector(many.place, o, 0), vector(many.place, r, 0)), side * d[face], _column(R, o, face))
    j, k = (face + 1) % 3, (face + 2) % 3
    for vertex in range(4):
        s = d[j] if vertex == 1 or vertex == 2 else -d[j]
        t = d[k] if vertex >= 2 else -d[k]
        q = plus(plus(center, s, _column(R, o, j)), t, _column(R, o, k))
        p[0, vertex, 0], p[0, vertex, 1], p[0, vertex, 2] = qt.dot(x, q), qt.dot(y, q), qt.dot(out, q)
        many.edge[0, vertex, 0], many.edge[0, vertex, 1] = (vertex + 3) % 4, vertex


@inlined
def _within(s, bound):
    """s, no further than `bound` from 0."""
    return min(max(s, -bound), bound)


@inlined
def _lowest(x, y, many):
    """Leave the lowest vertex of copy 0, moved above the face of half edges x and y: the copy it is in.

    For blocks that are apart beside each other as well: the plane between them keeps them from each other all the same.
    """
    p, edge, low = many.polygon, many.edge, 0
    for k in range(4):
        if p[0, k, 2] < p[0, low, 2]:
            low = k
    p[0, 0, 0], p[0, 0, 1], p[0, 0, 2] = _within(p[0, low, 0], x), _within(p[0, low, 1], y), p[0, low, 2]
    edge[0, 0, 0], edge[0, 0, 1] = (low + 3) % 4, low
    return 0


@inlined
def lowest(source, count, polygon):
    """Least height of a vertex of the polygon in copy `source`."""
    low = math.inf
    for k in range(count):
        low = min(low, polygon[source, k, 2])
    return low


@inlined
def is_along_face(edges, face, many):
    """Whether the product of two edges is nearly a face normal: the faces then lie flat on each other."""
    C, i, j = many.mix[AXES], edges // 3, edges % 3
    square = 1.0 - C[i, j] * C[i, j]
    # Component of (edge i of a) x (edge j of b) along the face normal: on axis k of a it is the determinant
    # e_k · (e_i x b_j), one entry of C; on axis k of b likewise, with the transpose.
    if face < 3:
        c = 0.0 if face == i else C[3 - face - i, j]
    else:
        c = 0.0 if face - 3 == j else C[i, 6 - face - j]
    return c * c >= FLAT * FLAT * square


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
    _incident(r, o, axis, sign, many)
    d, slop = many.bodies[r].dims, pair_slop(a, b, many)
    source, count = 0, 4
    for side in range(4):
        k, s = side // 2, 1.0 - 2.0 * (side % 2)
        bound = d[(axis + 1 + k) % 3]
        if not _is_within(source, count, k, s, bound + slop, many):
            count = _clip(source, count, k, s, bound, 4 + side, slop, many)
            source = 1 - source
    return source, count


@inlined
def _edge_at_rim(d, axis, source, count, slop, many):
    """(its ends, axis of the rim, its sense) where all that is low of the polygon is an edge along the face's rim.

    What is within a slop of the lowest vertex is low; two slops from the rim are on it. Without such an edge the ends
    are -1.
    """
    p, low = many.polygon, lowest(source, count, many.polygon)
    for side in range(4):
        k, sense = side // 2, 1.0 - 2.0 * (side % 2)
        bound, first, last, is_rim = d[(axis + 1 + k) % 3], -1, -1, True
        for v in range(count):
            if p[source, v, 2] <= low + slop:
                is_rim = is_rim and sense * p[source, v, k] >= bound - 2.0 * slop
                first = v if first < 0 or p[source, v, 1 - k] < p[source, first, 1 - k] else first
                last = v if last < 0 or p[source, v, 1 - k] > p[source, last, 1 - k] else last
        if is_rim and p[source, last, 1 - k] - p[source, first, 1 - k] > 2.0 * slop:
            return first, last, (axis + 1 + k) % 3, sense
    return -1, -1, 0, 1.0


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
        axis = _column(many.rotation, o, j)
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
        _incident(r, o, axis, sign, many)
        source, count = _lowest(d[(axis + 1) % 3], d[(axis + 2) % 3], many), 1
    R, p = many.rotation, many.polygon
    x, y, out = _column(R, r, (axis + 1) % 3), _column(R, r, (axis + 2) % 3), _column(R, r, axis)
    out = (sign * out[0], sign * out[1], sign * out[2])
    slop = pair_slop(a, b, many)
    lift = max(0.0, least + d[axis] - lowest(source, count, p))
    n, owner, first, last, side, sense = out, r, -1, -1, 0, 1.0
    if lift <= slop:
        first, last, side, sense = _edge_at_rim(d, axis, source, count, slop, many)
    if first >= 0:
        rim = _column(R, r, side)
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
        axis = _column(R, b, j)
        if j != k:
            point = plus(point, math.copysign(d[j], qt.dot(axis, n)), axis)
    return point


@inlined
def _touch_edges(a, b, edges, gap, h, many):
    """The contact of two edges, at their nearest points."""
    i, j = edges // 3, edges % 3
    x, y = _column(many.rotation, a, i), _column(many.rotation, b, j)
    n = qt.cross(x, y)
    s = 1.0 / math.sqrt(qt.dot(n, n))
    if qt.dot(n, minus(vector(many.place, a, 0), vector(many.place, b, 0))) < 0.0:
        s = -s
    n = (s * n[0], s * n[1], s * n[2])
    p, q = _middle_of_edge(a, i, (-n[0], -n[1], -n[2]), many), _middle_of_edge(b, j, n, many)
    # Points p + s x and q + t y whose difference is along n.
    w, c = minus(q, p), qt.dot(x, y)
    t = (c * qt.dot(x, w) - qt.dot(y, w)) / (1.0 - c * c)
    s = _within(qt.dot(x, w) + t * c, many.bodies[a].dims[i])
    t = _within(t, many.bodies[b].dims[j])
    record(a, b, FIRST_EDGE_NAME + edges, -1, n, plus(p, s, x), plus(q, t, y), gap, h, many)


@kernel
def touch_blocks(a, b, margin, h, many):
    """Add the contacts of blocks a and b that are no more than `margin` [m] apart.

    Where a face separates them or nearly does, and something of the other block is above it, no product of edges can
    say that they are further apart: that something touches.
    """
    _relate(a, b, many)
    apart, face = best_face(a, b, many)
    if apart > margin:
        return
    slop = pair_slop(a, b, many)
    source = count = 0
    is_clipped = apart >= -slop
    if is_clipped:
        source, count = _clip_face(a, b, face, many)
    further, edges = apart, 0
    if count == 0:
        further, edges = best_edges(a, b, many)
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
