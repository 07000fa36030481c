"""Clip the incident face of a block by the sides of the reference face of another block.

The reference face is the one whose normal separates the blocks; the incident face is the face of the other block most
opposed to it. The polygon `many.narrowphase.polygon` exists in two copies; a clip reads one and writes the other. Its
vertices are in the frame of the reference face: two coordinates along the face, and the height above its block's
centre. For every vertex `many.narrowphase.edge` has the edges into and out of it, which identify the vertex as long as
the same edges cross. Edges 0 to 3 are those of the incident face, 4 to 7 those of the reference face.

References
----------
I. E. Sutherland, G. W. Hodgman, *Reentrant polygon clipping*, CACM 17, 1974.
"""

from __future__ import annotations

import math

from physics.compiler.decorators import inlined
from physics.kernels.math import quaternion as qt
from physics.kernels.math.vector import row_vector
from physics.kernels.multibody.data.contact_set import add_scaled, subtract
from physics.kernels.multibody.narrowphase.box_sat import body_axis

# Number of the first edge that is a side of the reference face.
FIRST_SIDE = 4


@inlined
def _crossing(p, q, axis, bound):
    """Point of the line through vertices p and q at which coordinate `axis` is `bound`."""
    t = (bound - p[axis]) / (q[axis] - p[axis])
    return add_scaled(p, t, subtract(q, p))


@inlined
def is_polygon_inside(source, count, axis, sign, bound, many):
    """True if sign * coordinate `axis` <= bound for all `count` vertices of `many.narrowphase.polygon[source]`."""
    furthest = -math.inf
    for k in range(count):
        furthest = max(furthest, sign * many.narrowphase.polygon[source, k, axis])
    return furthest <= bound


@inlined
def clip_polygon(source, count, axis, sign, bound, side, slop, many):
    """Clip a polygon by sign * coordinate `axis` <= bound; return the new number of vertices.

    The polygon has `count` vertices in copy `source` of `many.narrowphase.polygon`; the result is written to the other
    copy. `side` is the number of the clipping edge. A vertex outside by at most the slop [m] stays, too, since it would
    otherwise come and go by rounding where two faces end together. Such a vertex replaces the point where its edge
    crosses the bound, which is far away if both are nearly parallel.
    """
    p, edge, into = many.narrowphase.polygon, many.narrowphase.edge, 1 - source
    kept = 0
    for k in range(count):
        m = (k + 1) % count
        here, there = sign * p[source, k, axis] - bound, sign * p[source, m, axis] - bound
        if here <= slop:
            for c in range(3):
                p[into, kept, c] = p[source, k, c]
            edge[into, kept, 0], edge[into, kept, 1] = edge[source, k, 0], edge[source, k, 1]
            kept += 1
        if (here <= slop) != (there <= slop) and min(here, there) < 0.0:
            cut = _crossing(row_vector(p[source], k, 0), row_vector(p[source], m, 0), axis, sign * bound)
            p[into, kept, 0], p[into, kept, 1], p[into, kept, 2] = cut
            leaving = here <= slop
            edge[into, kept, 0] = edge[source, k, 1] if leaving else side
            edge[into, kept, 1] = side if leaving else edge[source, k, 1]
            kept += 1
    return kept


@inlined
def write_incident_face(r, o, axis, sign, many):
    """Write the incident face of block o, the one most opposed to a face of block r, as a polygon.

    The polygon is copy 0 of `many.narrowphase.polygon`. The face of r has the outward normal sign * body axis `axis`.
    Coordinates of the vertices are along the next two body axes of r; heights are along the outward normal, above the
    centre of r [m].
    """
    R, d, p = many.bodies.rotation, many.bodies.body[o].dims, many.narrowphase.polygon
    out = body_axis(R, r, axis)
    out = (sign * out[0], sign * out[1], sign * out[2])
    x, y = body_axis(R, r, (axis + 1) % 3), body_axis(R, r, (axis + 2) % 3)
    best, face, side = -1.0, 0, 1.0
    for j in range(3):
        c = qt.dot(out, body_axis(R, o, j))
        if abs(c) > best:
            best, face, side = abs(c), j, -math.copysign(1.0, c)
    center = add_scaled(
        subtract(row_vector(many.bodies.center, o, 0), row_vector(many.bodies.center, r, 0)),
        side * d[face],
        body_axis(R, o, face),
    )
    j, k = (face + 1) % 3, (face + 2) % 3
    for vertex in range(4):
        s = d[j] if vertex == 1 or vertex == 2 else -d[j]
        t = d[k] if vertex >= 2 else -d[k]
        q = add_scaled(add_scaled(center, s, body_axis(R, o, j)), t, body_axis(R, o, k))
        p[0, vertex, 0], p[0, vertex, 1], p[0, vertex, 2] = qt.dot(x, q), qt.dot(y, q), qt.dot(out, q)
        many.narrowphase.edge[0, vertex, 0], many.narrowphase.edge[0, vertex, 1] = (vertex + 3) % 4, vertex


@inlined
def clamp_to_half_width(s, bound):
    """Clamp the number s to the interval from -bound to bound."""
    return min(max(s, -bound), bound)


@inlined
def keep_deepest_vertex(x, y, many):
    """Reduce the polygon in copy 0 of `many.narrowphase.polygon` to its lowest vertex; return the copy, 0.

    The vertex is moved over the reference face, which has the half edges x and y [m]. This serves blocks that are also
    apart sideways: the plane of the face still separates them.
    """
    p, edge, low = many.narrowphase.polygon, many.narrowphase.edge, 0
    for k in range(4):
        if p[0, k, 2] < p[0, low, 2]:
            low = k
    p[0, 0, 0], p[0, 0, 1], p[0, 0, 2] = (
        clamp_to_half_width(p[0, low, 0], x),
        clamp_to_half_width(p[0, low, 1], y),
        p[0, low, 2],
    )
    edge[0, 0, 0], edge[0, 0, 1] = (low + 3) % 4, low
    return 0


@inlined
def min_vertex_height(source, count, polygon):
    """Least height of the first `count` vertices of `polygon[source]` [m]."""
    low = math.inf
    for k in range(count):
        low = min(low, polygon[source, k, 2])
    return low


@inlined
def find_rim_edge(d, axis, source, count, slop, many):
    """Find the edge of the reference face on which all low vertices of the polygon lie, if there is one.

    d are the half edges of the block with the reference face, `axis` the body axis across it. A vertex of the polygon
    (`count` vertices in copy `source`) is low within a slop of the lowest one, and on an edge within two slops of it.
    Returns (first vertex, last vertex, body axis towards the edge, its sign); the vertices are -1 without such an edge.
    """
    p, low = many.narrowphase.polygon, min_vertex_height(source, count, many.narrowphase.polygon)
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
