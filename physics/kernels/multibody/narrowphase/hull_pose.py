"""Pose of a pair of convex polyhedra in the world, and nearest points of their faces.

`hull_tables.Hulls` has tables of all polyhedra in their body frames, and room for a pair of them in world axes. Bodies
of the pair have the numbers 0 and 1, which functions take as `which`.
"""

from __future__ import annotations

import math

from physics.compiler.decorators import inlined, kernel
from physics.kernels.math import quaternion as qt
from physics.kernels.math.vector import row_vector
from physics.kernels.multibody.data.contact_set import add_scaled, put_vector, row_matrix, subtract
from physics.kernels.multibody.data.hull_tables import FIRST_CORNER, FIRST_FACE, LAST_CORNER, LAST_FACE
from physics.kernels.state.layout import BLOCK


@inlined
def hull_scale(b, many):
    """Scale of the corners of body b in the tables along its axes: half edges of a block, 1 for a hull."""
    d = many.bodies.body[b].dims
    if many.bodies.body[b].shape == BLOCK:
        return (d[0], d[1], d[2])
    return (1.0, 1.0, 1.0)


@inlined
def corner_arm(b, k, many):
    """Corner k of the tables from the geometric centre of body b, world frame [m]."""
    r, s = row_vector(many.narrowphase.hulls.corners, k, 0), hull_scale(b, many)
    return qt.matvec(row_matrix(many.bodies.rotation, b), (s[0] * r[0], s[1] * r[1], s[2] * r[2]))


@kernel
def pose_hull(which, b, origin, many):
    """Write corners, face normals, face offsets and centre of body b into the pair, as number `which`.

    They are in world axes, relative to the point `origin` (world frame) [m].
    """
    hulls, R = many.narrowphase.hulls, row_matrix(many.bodies.rotation, b)
    x = subtract(row_vector(many.bodies.center, b, 0), origin)
    put_vector(hulls.centre, which, 0, x)
    first, face = hulls.of[b, FIRST_CORNER], hulls.of[b, FIRST_FACE]
    for k in range(hulls.of[b, LAST_CORNER] - first):
        r = add_scaled(x, 1.0, corner_arm(b, first + k, many))
        hulls.corner[which, k, 0], hulls.corner[which, k, 1], hulls.corner[which, k, 2] = r
    for f in range(hulls.of[b, LAST_FACE] - face):
        n = qt.matvec(R, row_vector(hulls.normals, face + f, 0))
        hulls.normal[which, f, 0], hulls.normal[which, f, 1], hulls.normal[which, f, 2] = n
        hulls.offset[which, f] = qt.dot(n, row_vector(hulls.corner[which], hulls.ring[hulls.loops[face + f, 0]], 0))


@inlined
def nearest_on_segment(x, p, q):
    """Point of the segment from p to q that is nearest to x."""
    d = subtract(q, p)
    return add_scaled(p, min(max(qt.dot(d, subtract(x, p)) / qt.dot(d, d), 0.0), 1.0), d)


@kernel
def is_above_face(which, b, face, x, many):
    """True if the projection of x on the plane of a face of body b lies inside the face.

    Body b is number `which` of the pair; x is in the coordinates of the pair.
    """
    hulls = many.narrowphase.hulls
    out, k = row_vector(hulls.normal[which], face, 0), hulls.of[b, FIRST_FACE] + face
    first, last = hulls.loops[k, 0], hulls.loops[k, 1]
    for side in range(last - first):
        p = row_vector(hulls.corner[which], hulls.ring[first + side], 0)
        q = row_vector(hulls.corner[which], hulls.ring[first + side + 1 if first + side + 1 < last else first], 0)
        if qt.dot(qt.cross(subtract(q, p), out), subtract(x, p)) > 0.0:
            return False
    return True


@kernel
def nearest_on_face(which, b, face, x, many):
    """Point of a face of body b, number `which` of the pair, that is nearest to x; in the coordinates of the pair."""
    hulls = many.narrowphase.hulls
    out, k = row_vector(hulls.normal[which], face, 0), hulls.of[b, FIRST_FACE] + face
    first, last = hulls.loops[k, 0], hulls.loops[k, 1]
    best, nearest = math.inf, x
    for side in range(last - first):
        p = row_vector(hulls.corner[which], hulls.ring[first + side], 0)
        q = row_vector(hulls.corner[which], hulls.ring[first + side + 1 if first + side + 1 < last else first], 0)
        y = nearest_on_segment(x, p, q)
        w = subtract(x, y)
        if qt.dot(w, w) < best:
            best, nearest = qt.dot(w, w), y
    if is_above_face(which, b, face, x, many):
        return add_scaled(x, hulls.offset[which, face] - qt.dot(out, x), out)
    return nearest
