"""Contacts of two blocks: separating axis test, then the clipped face or the nearest points of two edges.

Of the fifteen axes that can separate two blocks (three face normals of each, nine products of edges), the one with the
largest separation is the contact normal. If it is a face normal, the opposite face of the other block is clipped by the
sides of that face. So up to eight points touch. Each has an id that stays the same while the same edges cross.
"""

from __future__ import annotations

import math

from physics.compiler.decorators import if_given, inlined, kernel
from physics.kernels.math import quaternion as qt
from physics.kernels.math.vector import row_vector
from physics.kernels.multibody.data.arrays import NUM_CONTACTS
from physics.kernels.multibody.data.clipped_points import follow_vertex
from physics.kernels.multibody.data.contact_set import add_contact, add_scaled, pair_slop, subtract
from physics.kernels.multibody.narrowphase.box_clip import (
    FIRST_SIDE,
    clamp_to_half_width,
    clip_polygon,
    find_rim_edge,
    is_polygon_inside,
    keep_deepest_vertex,
    min_vertex_height,
    write_incident_face,
)
from physics.kernels.multibody.narrowphase.box_sat import (
    FROM_A,
    FROM_B,
    body_axis,
    is_edge_axis_face_normal,
    is_face_flat_on_other,
    max_box_edge_separation,
    max_box_face_separation,
    write_relative_axes,
)

# Features of a contact: face (of a: 0 to 2, of b: 3 to 5) * 64 + edge in * 8 + edge out; then pairs of edges.
_FEATURES_PER_FACE = 64
_FIRST_EDGE_FEATURE = 6 * _FEATURES_PER_FACE


@inlined
def _reference_face(a, b, face, many):
    """Find the block to which `face` belongs: (block, other block, body axis across the face, sign).

    `face` is numbered as in `box_sat.max_box_face_separation`. The sign is that of the axis towards the other block.
    """
    if face < 3:
        return a, b, face, math.copysign(1.0, many.narrowphase.relative_axes[FROM_A, 0, face])
    return b, a, face - 3, -math.copysign(1.0, many.narrowphase.relative_axes[FROM_B, 0, face - 3])


@inlined
def _clip_face(a, b, face, many):
    """Clip the opposite face of the other block by the sides of `face`: (copy of the polygon, number of vertices)."""
    r, o, axis, sign = _reference_face(a, b, face, many)
    write_incident_face(r, o, axis, sign, many)
    d, slop = many.bodies.body[r].dims, pair_slop(a, b, many)
    source, count = 0, 4
    for side in range(4):
        k, s = side // 2, 1.0 - 2.0 * (side % 2)
        bound = d[(axis + 1 + k) % 3]
        if not is_polygon_inside(source, count, k, s, bound + slop, many):
            count = clip_polygon(source, count, k, s, bound, 4 + side, slop, many)
            source = 1 - source
    return source, count


@inlined
def _parallel_edge_normal(o, out, rim, point, many):
    """Contact normal of two parallel edges that touch: the middle of all normals that both edges allow.

    An edge of a convex body allows every direction between the normals of its two faces. For the block with the
    reference face, these are the directions from `out`, that face's normal, to `rim`, the normal of the next face. For
    block o they lie between the two normals, reversed, of the faces whose edge passes `point`. Both ranges contain
    `out`. The range of o ends before `rim`, a quarter turn from its other end. So both allow the directions between
    `out` and that end.
    """
    end, most, along = out, 0.0, qt.cross(out, rim)
    w = subtract(point, row_vector(many.bodies.center, o, 0))
    for j in range(3):
        axis = body_axis(many.bodies.rotation, o, j)
        s = -math.copysign(1.0, qt.dot(axis, w))
        normal = (s * axis[0], s * axis[1], s * axis[2])
        towards = qt.dot(normal, rim)
        if abs(qt.dot(normal, along)) < 0.5 and towards > most:
            most, end = towards, normal
    n = add_scaled(out, 1.0, end)
    s = 1.0 / math.sqrt(qt.dot(n, n))
    return (s * n[0], s * n[1], s * n[2])


@inlined
def _point_above_face(r, x, y, s, t, many):
    """Point at s along the unit vector x and t along y from the centre of block r, world frame [m]."""
    return add_scaled(add_scaled(row_vector(many.bodies.center, r, 0), s, x), t, y)


@if_given("many.lone")
def _follow_clipped(before, bodies, place, axes, point, many):
    """Let the contact that was added last follow its edges (`clipped_points.follow_vertex`).

    `before` is the number of contacts before it, `bodies` are those with the reference and the incident face. Its
    `point` is vertex k of `count` in copy `source` of `many.narrowphase.polygon`, where `place` is (k, count, source).
    `axes` are those of the polygon's coordinates. Points are in the world frame [m].
    """
    if many.lone.slow[0] == 1:
        return
    (k, count, source), (x, y, out) = place, axes
    p, edge = many.narrowphase.polygon[source], many.narrowphase.edge
    here, last, following = (
        row_vector(p, k, 0),
        row_vector(p, (k + count - 1) % count, 0),
        row_vector(p, (k + 1) % count, 0),
    )
    into, out_of = subtract(here, last), subtract(following, here)
    one = add_scaled(add_scaled((into[0] * x[0], into[0] * x[1], into[0] * x[2]), into[1], y), into[2], out)
    other = add_scaled(add_scaled((out_of[0] * x[0], out_of[0] * x[1], out_of[0] * x[2]), out_of[1], y), out_of[2], out)
    sides = (edge[source, k, 0] >= FIRST_SIDE, edge[source, k, 1] >= FIRST_SIDE)
    follow_vertex(before, bodies, sides, (one, other), out, point, many)


@inlined
def _add_face_contacts(a, b, face, source, count, least, h, many):
    """Add the contacts between `face` and the clipped face of the other block, given as a polygon.

    The polygon has `count` vertices in copy `source` of `many.narrowphase.polygon`. It is lifted along the normal until
    no contact has a gap below `least` [m]. If the blocks touch with two parallel edges, only the ends of the common
    edge are added. h is the length of the stage [s].
    """
    r, o, axis, sign = _reference_face(a, b, face, many)
    d = many.bodies.body[r].dims
    if count == 0:
        write_incident_face(r, o, axis, sign, many)
        source, count = keep_deepest_vertex(d[(axis + 1) % 3], d[(axis + 2) % 3], many), 1
    R, p = many.bodies.rotation, many.narrowphase.polygon
    x, y, out = body_axis(R, r, (axis + 1) % 3), body_axis(R, r, (axis + 2) % 3), body_axis(R, r, axis)
    out = (sign * out[0], sign * out[1], sign * out[2])
    slop = pair_slop(a, b, many)
    lift = max(0.0, least + d[axis] - min_vertex_height(source, count, p))
    n, owner, first, last, side, sense = out, r, -1, -1, 0, 1.0
    if lift <= slop and not is_face_flat_on_other(face, many):
        first, last, side, sense = find_rim_edge(d, axis, source, count, slop, many)
    if first >= 0:
        rim = body_axis(R, r, side)
        point = _point_above_face(r, x, y, p[source, first, 0], p[source, first, 1], many)
        point = add_scaled(point, p[source, first, 2], out)
        n, owner = _parallel_edge_normal(o, out, (sense * rim[0], sense * rim[1], sense * rim[2]), point, many), -1
    for k in range(count):
        if first >= 0 and k != first and k != last:
            continue
        gap = p[source, k, 2] - d[axis] + lift
        point = _point_above_face(r, x, y, p[source, k, 0], p[source, k, 1], many)
        on_face, on_other = add_scaled(point, d[axis], out), add_scaled(point, d[axis] + gap, out)
        gap *= qt.dot(n, out)
        feature = (
            face * _FEATURES_PER_FACE + 8 * many.narrowphase.edge[source, k, 0] + many.narrowphase.edge[source, k, 1]
        )
        before = many.counts[NUM_CONTACTS]
        if face < 3:
            add_contact(a, b, feature, owner, (-n[0], -n[1], -n[2]), (on_face, on_other), gap, h, many)
        else:
            add_contact(a, b, feature, owner, n, (on_other, on_face), gap, h, many)
        if first < 0 and count > 2:
            _follow_clipped(before, (r, o), (k, count, source), (x, y, out), on_other, many)


@inlined
def _middle_of_edge(b, k, n, many):
    """Middle of the edge of block b along its body axis k that reaches furthest along n, world frame [m]."""
    R, d = many.bodies.rotation, many.bodies.body[b].dims
    point = row_vector(many.bodies.center, b, 0)
    for j in range(3):
        axis = body_axis(R, b, j)
        if j != k:
            point = add_scaled(point, math.copysign(d[j], qt.dot(axis, n)), axis)
    return point


@inlined
def _add_edge_contact(a, b, edges, gap, h, many):
    """Add the contact of two crossing edges of blocks a and b at their nearest points, with a given gap [m].

    `edges` = 3 i + j are the edge along body axis i of a and that along body axis j of b. h is the length of the stage
    [s].
    """
    i, j = edges // 3, edges % 3
    x, y = body_axis(many.bodies.rotation, a, i), body_axis(many.bodies.rotation, b, j)
    n = qt.cross(x, y)
    s = 1.0 / math.sqrt(qt.dot(n, n))
    if qt.dot(n, subtract(row_vector(many.bodies.center, a, 0), row_vector(many.bodies.center, b, 0))) < 0.0:
        s = -s
    n = (s * n[0], s * n[1], s * n[2])
    p, q = _middle_of_edge(a, i, (-n[0], -n[1], -n[2]), many), _middle_of_edge(b, j, n, many)
    # Points p + s x and q + t y whose difference is along n.
    w, c = subtract(q, p), qt.dot(x, y)
    t = (c * qt.dot(x, w) - qt.dot(y, w)) / (1.0 - c * c)
    s = clamp_to_half_width(qt.dot(x, w) + t * c, many.bodies.body[a].dims[i])
    t = clamp_to_half_width(t, many.bodies.body[b].dims[j])
    add_contact(a, b, _FIRST_EDGE_FEATURE + edges, -1, n, (add_scaled(p, s, x), add_scaled(q, t, y)), gap, h, many)


@kernel
def collide_blocks(a, b, margin, h, many):
    """Add the contacts of blocks a and b that are at most `margin` [m] apart; h is the length of the stage [s].

    If a face separates the blocks, or nearly so, and a part of the other block is above it, that part touches: no
    product of edges can have a larger separation.
    """
    write_relative_axes(a, b, many)
    apart, face = max_box_face_separation(a, b, margin, many)
    if apart > margin:
        return
    slop = pair_slop(a, b, many)
    source = count = 0
    is_clipped = apart >= -slop
    if is_clipped:
        source, count = _clip_face(a, b, face, many)
    further, edges = apart, 0
    if count == 0:
        further, edges = max_box_edge_separation(a, b, margin, many)
    if further > margin:
        return
    is_face = further <= apart + slop
    if is_face or is_edge_axis_face_normal(edges, face, many):
        if not is_clipped:
            source, count = _clip_face(a, b, face, many)
        if is_face or count > 0:
            _add_face_contacts(a, b, face, source, count, max(apart, further), h, many)
            return
    _add_edge_contact(a, b, edges, further, h, many)
