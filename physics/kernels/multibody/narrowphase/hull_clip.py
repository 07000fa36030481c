"""Clip the incident face of a convex polyhedron by the sides of the reference face of another one.

The reference face is the one whose normal separates the bodies; the incident face is that of the other body opposite to
it. The polygon `hulls.polygon` exists in two copies; a clip reads one and writes the other. For every vertex
`hulls.sides` has the edges into and out of it. Bodies have the numbers 0 and 1 in the pair (`hull_pose`).

References
----------
.. [1] I. E. Sutherland, G. W. Hodgman, *Reentrant polygon clipping*, CACM 17, 1974.
"""

from __future__ import annotations

import math

from physics.compiler.decorators import inlined
from physics.kernels.math import quaternion as qt
from physics.kernels.math.vector import row_vector
from physics.kernels.multibody.data.contact_set import add_scaled, subtract
from physics.kernels.multibody.data.hull_tables import FIRST_CORNER, FIRST_FACE, LAST_CORNER, LAST_FACE

# Edges of the polygon: from this number on they are sides of the reference face, below it edges of the incident face.
CLIP_SIDE_OFFSET = 64


@inlined
def side_plane(which, ring, k, first, last, out, hulls):
    """Plane through side k of a face and along the face's normal `out`: (outward unit normal m, offset m·x).

    The face belongs to body `which` of the pair; its corners are `ring[first:last]`.
    """
    p = row_vector(hulls.corner[which], ring[first + k], 0)
    q = row_vector(hulls.corner[which], ring[first + k + 1 if first + k + 1 < last else first], 0)
    m = qt.cross(subtract(q, p), out)
    s = 1.0 / math.sqrt(qt.dot(m, m))
    m = (s * m[0], s * m[1], s * m[2])
    return m, qt.dot(m, p)


@inlined
def _clip_polygon(source, count, m, bound, side, slop, hulls):
    """Clip a polygon by m·x <= bound, for a unit vector m: (copy of the result, its number of vertices).

    The polygon has `count` vertices in copy `source` of `hulls.polygon`. `side` is the number of the clipping edge. A
    vertex outside by at most the slop [m] stays, too, since it would otherwise come and go by rounding where two faces
    end together. Such a vertex replaces the point where its edge crosses the bound, which is far away if both are
    nearly parallel.
    """
    p, sides, into = hulls.polygon, hulls.sides, 1 - source
    furthest = -math.inf
    for k in range(count):
        furthest = max(furthest, qt.dot(m, row_vector(p[source], k, 0)))
    if furthest - bound <= slop:
        return source, count
    kept = 0
    for k in range(count):
        v, w = row_vector(p[source], k, 0), row_vector(p[source], (k + 1) % count, 0)
        here, there = qt.dot(m, v) - bound, qt.dot(m, w) - bound
        if here <= slop and kept < p.shape[1]:
            p[into, kept, 0], p[into, kept, 1], p[into, kept, 2] = v
            sides[into, kept, 0], sides[into, kept, 1] = sides[source, k, 0], sides[source, k, 1]
            kept += 1
        if (here <= slop) != (there <= slop) and min(here, there) < 0.0 and kept < p.shape[1]:
            p[into, kept, 0], p[into, kept, 1], p[into, kept, 2] = add_scaled(v, here / (here - there), subtract(w, v))
            leaving = here <= slop
            sides[into, kept, 0] = sides[source, k, 1] if leaving else side
            sides[into, kept, 1] = side if leaving else sides[source, k, 1]
            kept += 1
    return into, kept


@inlined
def has_corner(f, corner, hulls):
    """True if face f of the tables has this corner, counted from 0 in its polyhedron."""
    for k in range(hulls.loops[f, 0], hulls.loops[f, 1]):
        if hulls.ring[k] == corner:
            return True
    return False


@inlined
def write_hull_incident_face(which, o, out, many):
    """Write the incident face of body o, number `which` of the pair, as a polygon; return its number of vertices.

    The polygon is copy 0 of `hulls.polygon`. The face is at the corner of o that is farthest against the direction
    `out`. Among the faces there it is the one whose normal is most opposed to `out`. The most opposed of all faces of o
    need not have that corner.
    """
    hulls, low, deepest = many.narrowphase.hulls, math.inf, 0
    for k in range(hulls.of[o, LAST_CORNER] - hulls.of[o, FIRST_CORNER]):
        height = qt.dot(out, row_vector(hulls.corner[which], k, 0))
        if height < low:
            low, deepest = height, k
    first, face, best = hulls.of[o, FIRST_FACE], 0, math.inf
    for f in range(hulls.of[o, LAST_FACE] - first):
        c = qt.dot(out, row_vector(hulls.normal[which], f, 0))
        if c < best and has_corner(first + f, deepest, hulls):
            best, face = c, f
    start, stop = hulls.loops[first + face, 0], hulls.loops[first + face, 1]
    for k in range(stop - start):
        r = row_vector(hulls.corner[which], hulls.ring[start + k], 0)
        hulls.polygon[0, k, 0], hulls.polygon[0, k, 1], hulls.polygon[0, k, 2] = r
        hulls.sides[0, k, 0], hulls.sides[0, k, 1] = k - 1 if k > 0 else stop - start - 1, k
    return stop - start


@inlined
def clip_incident_face(which, r, o, face, slop, many):
    """Clip the incident face of body o by the sides of a face of body r: (copy of the polygon, number of vertices).

    Body r is number `which` of the pair, `face` is counted from 0 in r, and `slop` [m] is as in `_clip_polygon`.
    """
    hulls = many.narrowphase.hulls
    out = row_vector(hulls.normal[which], face, 0)
    source, count = 0, write_hull_incident_face(1 - which, o, out, many)
    k = hulls.of[r, FIRST_FACE] + face
    first, last = hulls.loops[k, 0], hulls.loops[k, 1]
    for side in range(last - first):
        m, bound = side_plane(which, hulls.ring, side, first, last, out, hulls)
        source, count = _clip_polygon(source, count, m, bound, CLIP_SIDE_OFFSET + side, slop, hulls)
    return source, count
