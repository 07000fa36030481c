"""Contact points of a lone body on edges: they follow the edges, not the material of a body.

Two faces touch in a polygon: one face, clipped by the sides of the other one (`narrowphase.box_clip`). A vertex of this
polygon is of one of three kinds, and moves accordingly. Let u be the velocity of the reference body's material relative
to that of the other body, both at the vertex. Then the vertex moves relative to the other body with the velocity

    0                     a vertex of the incident face;
    u along that face     a corner of the reference face above it;
    d (e·u) / (e·d)       an edge along d of the incident face, where it crosses the side with the normal e.

If points were carried along with the other body instead, a block that slides over the end of a ramp would lean on
points beyond that end, and tip too late.

All of this is left out of kernels unless exactly one body moves, among fixed ones.
"""

from __future__ import annotations

from physics.compiler.decorators import if_given, inlined, kernel
from physics.kernels.math import quaternion as qt
from physics.kernels.math.vector import minus, plus, row_vector, times
from physics.kernels.multibody.data.arrays import NUM_CONTACTS
from physics.kernels.multibody.data.fixed_bodies import body_at
from physics.kernels.state import layout as at

# Least sine of the angle between an edge and a side whose crossing is followed: it runs away where both are parallel.
_LEAST_SINE = 0.05


@if_given("many.lone")
def clear_follow(k, many):
    """Let the point of contact k be carried along by a body."""
    for c in range(3):
        many.lone.follow[k, c] = 0.0


@if_given("many.lone")
def copy_follow(k, to, many):
    """Copy the velocity of contact k along its edge to contact `to`."""
    for c in range(3):
        many.lone.follow[to, c] = many.lone.follow[k, c]


@inlined
def _point_velocity(b, point, many):
    arm = minus(point, row_vector(many.bodies.state, b, at.POS))
    return plus(row_vector(many.bodies.twist, b, 0), qt.cross(row_vector(many.bodies.twist, b, 3), arm))


@inlined
def _along_edge(d, side, out, u):
    """Velocity d (e·u)/(e·d) of the crossing of an edge along d with a side along `side`, of a face with normal out."""
    e = qt.cross(minus(side, times(qt.dot(side, out), out)), out)
    across = qt.dot(e, d)
    if not across * across > _LEAST_SINE * _LEAST_SINE * qt.dot(e, e) * qt.dot(d, d):
        return (0.0, 0.0, 0.0)
    return times(qt.dot(e, u) / across, d)


@inlined
def _along_face(d, side, out, u):
    """Part of the velocity u along a face with the edges d and `side`: the point stays above the same point below.

    `out` is the direction of above, the normal of the reference face.
    """
    m = qt.cross(d, side)
    height = qt.dot(m, out)
    u = minus(u, times(qt.dot(u, out), out))
    return minus(u, times(qt.dot(m, u) / height, out)) if height * height > 0.5 * qt.dot(m, m) else u


@kernel
def _write_follow(before, bodies, sides, edges, out, point, many):
    k = before
    into_side, out_of_side = sides
    if many.counts[NUM_CONTACTS] == k or not (into_side or out_of_side):
        return  # the contact was left out, or its point is a vertex
    u = minus(_point_velocity(bodies[0], point, many), _point_velocity(bodies[1], point, many))
    if into_side and out_of_side:
        w = _along_face(edges[0], edges[1], out, u)
    elif into_side:
        w = _along_edge(edges[1], edges[0], out, u)
    else:
        w = _along_edge(edges[0], edges[1], out, u)
    for c in range(3):
        many.lone.follow[k, c] = w[c]


@if_given("many.lone")
def follow_vertex(before, bodies, sides, edges, out, point, many):
    """Write the velocity at which the last contact of the set moves relative to the incident face's body.

    Parameters
    ----------
    before : int
        Number of contacts before it was added; it may have been left out.
    bodies : pair of ints
        Body with the reference face, body with the incident face.
    sides : pair of bools
        Whether the polygon's edges into and out of the vertex are sides of the reference face.
    edges : pair of tuples of 3 floats
        Vectors along these two edges, world frame.
    out : tuple of 3 floats
        Normal of the reference face, world frame.
    point : tuple of 3 floats
        Vertex, world frame [m].
    many : BodiesWorkspace
        Workspace of the world.
    """
    _write_follow(before, bodies, sides, edges, out, point, many)


@if_given("many.lone")
def follow_edges(n, h, many):
    """Move the points of the n contacts along their edges for h [s], after bodies have carried them along."""
    for k in range(n):
        way = times(h, row_vector(many.lone.follow, k, 0))
        height = qt.dot(way, row_vector(many.contacts.frame, k, 0))
        is_of_first = many.contacts.owner[k] == body_at(many.contacts.bodies[k, 1], many)
        many.contacts.gap[k] += height if is_of_first else -height
        for c in range(3):
            many.contacts.arm[k, c] += way[c]
            many.contacts.arm[k, 3 + c] += way[c]
