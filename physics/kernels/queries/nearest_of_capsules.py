"""Nearest points of a capsule and a point or another body, as of `nearest_points`, for scenes or shapes with capsules.

They are those of its axis, moved by the radius.
"""

from __future__ import annotations

from physics.compiler.decorators import if_given, kernel
from physics.kernels.math.segments import nearest_place, nearest_places, point_on_segment
from physics.kernels.math.vector import minus, plus, row_vector, times
from physics.kernels.multibody.data.capsules import half_axis, is_capsule
from physics.kernels.multibody.data.contact_set import add_scaled
from physics.kernels.multibody.narrowphase.capsule_contacts import direction_between, nearest_of_capsule_ellipsoid
from physics.kernels.multibody.narrowphase.hull_pose import pose_hull
from physics.kernels.multibody.narrowphase.segment_polyhedron import (
    nearest_of_segment,
    part_inside,
    segment_separation,
)
from physics.kernels.state.layout import ELLIPSOID, SPHERE

_ZERO = (0.0, 0.0, 0.0)


@if_given("scratch.bodies.capsules", (0.0, _ZERO, _ZERO))
def nearest_on_capsule(b, x, scratch):
    """Nearest point of the surface of capsule b to a point x: (distance, n out of b, point)."""
    center, u, r = row_vector(scratch.bodies.center, b, 0), half_axis(b, scratch), scratch.bodies.body[b].dims[0]
    q = point_on_segment(center, u, nearest_place(x, center, u))
    distance, n = direction_between(x, q, u, u)
    return distance - r, n, add_scaled(q, r, n)


@kernel
def _nearest_of_capsules(a, b, scratch):
    x, u = row_vector(scratch.bodies.center, a, 0), half_axis(a, scratch)
    y, v = row_vector(scratch.bodies.center, b, 0), half_axis(b, scratch)
    s, t, _ = nearest_places(x, u, y, v)
    p, q = point_on_segment(x, u, s), point_on_segment(y, v, t)
    distance, n = direction_between(p, q, u, v)
    one, other = scratch.bodies.body[a].dims[0], scratch.bodies.body[b].dims[0]
    return distance - one - other, n, add_scaled(p, -one, n), add_scaled(q, other, n)


@kernel
def _nearest_of_capsule_hull(a, b, scratch):
    """Nearest points of a capsule a and a block or hull b; where the axis lies in b, along the shortest way out."""
    origin, r = row_vector(scratch.bodies.center, b, 0), scratch.bodies.body[a].dims[0]
    pose_hull(0, b, origin, scratch)
    x, u = minus(row_vector(scratch.bodies.center, a, 0), origin), half_axis(a, scratch)
    first, last = part_inside(b, x, u, scratch)
    if first < last:
        distance, n = segment_separation(b, x, u, scratch)
        p = plus(origin, point_on_segment(x, u, 0.5 * (first + last)))
        return distance - r, n, add_scaled(p, -r, n), add_scaled(p, -distance, n)
    distance, n, place, y = nearest_of_segment(b, x, u, scratch)
    p = plus(origin, point_on_segment(x, u, place))
    return distance - r, n, add_scaled(p, -r, n), plus(origin, y)


@if_given("scratch.bodies.capsules", (0.0, _ZERO, _ZERO, _ZERO))
def nearest_of_capsule(a, b, scratch):
    """Nearest points of a capsule a and a body b of any shape."""
    shape = scratch.bodies.body[b].shape
    if is_capsule(b, scratch):
        return _nearest_of_capsules(a, b, scratch)
    if shape == SPHERE:
        x, r = row_vector(scratch.bodies.center, b, 0), scratch.bodies.body[b].dims[0]
        distance, n, p = nearest_on_capsule(a, x, scratch)
        return distance - r, times(-1.0, n), p, add_scaled(x, -r, n)
    if shape == ELLIPSOID:
        gap, n, q = nearest_of_capsule_ellipsoid(a, b, scratch)
        return gap, times(-1.0, n), add_scaled(q, -gap, n), q
    return _nearest_of_capsule_hull(a, b, scratch)
