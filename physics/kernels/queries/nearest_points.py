"""Nearest points of two bodies, or of a body and a wall, in their present poses.

Each function returns (gap, n, p, q): the distance [m], the unit vector n out of the second body, and the points of the
first and of the second body, p = q + gap n, world frame. Where the bodies overlap, the gap is negative: -gap is the
shortest way that separates them, as the contact search has it.
"""

from __future__ import annotations

import math

from physics.compiler.decorators import inlined, kernel
from physics.kernels.math import quaternion as qt
from physics.kernels.math.vector import minus, plus, row_vector, times
from physics.kernels.multibody.data.capsules import is_capsule
from physics.kernels.multibody.data.contact_set import add_scaled, row_matrix
from physics.kernels.multibody.data.cylinders import is_cylinder
from physics.kernels.multibody.data.hull_tables import FIRST_EDGE, FIRST_FACE, LAST_EDGE, LAST_FACE
from physics.kernels.multibody.narrowphase.ellipsoid_distance import (
    center_direction,
    ellipsoid_matrix,
    ellipsoid_support_point,
    max_separation_direction,
    nearest_on_block,
    relative_rotation,
)
from physics.kernels.multibody.narrowphase.gjk import support_point
from physics.kernels.multibody.narrowphase.hull_ellipsoid import direction_from_edge, hull_separation, nearest_on_hull
from physics.kernels.multibody.narrowphase.hull_pose import is_above_face, pose_hull
from physics.kernels.queries.nearest_of_capsules import nearest_of_capsule, nearest_on_capsule
from physics.kernels.queries.nearest_of_cylinders import nearest_on_cylinder
from physics.kernels.queries.polyhedra_distance import nearest_of_polyhedra
from physics.kernels.state.layout import BLOCK, ELLIPSOID, HULL, SPHERE, WALL_NORMAL, WALL_OFFSET

_POINT = (0.0, 0.0, 0.0)  # half edges of a block that is a point
_NO_MATRIX = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


@inlined
def _dims(b, scratch):
    """Half edges or semi-axes of body b [m]."""
    d = scratch.bodies.body[b].dims
    return (d[0], d[1], d[2])


@kernel
def nearest_on_body(b, x, scratch):
    """Nearest point of the surface of body b to a point x: (distance, n out of b, point); negative for x inside."""
    center, R, dims = row_vector(scratch.bodies.center, b, 0), row_matrix(scratch.bodies.rotation, b), _dims(b, scratch)
    arm, shape = minus(x, center), scratch.bodies.body[b].shape
    if is_capsule(b, scratch):
        return nearest_on_capsule(b, x, scratch)
    if is_cylinder(b, scratch):
        return nearest_on_cylinder(b, x, scratch)
    if shape == SPHERE:
        n = center_direction(arm)
        return math.sqrt(qt.dot(arm, arm)) - dims[0], n, add_scaled(center, dims[0], n)
    if shape == BLOCK:
        y, n, distance = nearest_on_block(qt.transposed_matvec(R, arm), dims)
        return distance, qt.matvec(R, n), plus(center, qt.matvec(R, y))
    if shape == HULL:
        pose_hull(0, b, center, scratch)
        y, n, distance = nearest_on_hull(b, arm, scratch)
        return distance, n, plus(center, y)
    way, D = times(-1.0, arm), ellipsoid_matrix(R, dims)
    n, distance = max_separation_direction(D, True, _NO_MATRIX, _POINT, way, center_direction(way))
    return distance, times(-1.0, n), add_scaled(x, distance, n)


@kernel
def _nearest_of_ellipsoid(a, b, scratch):
    """Nearest points of an ellipsoid a and an ellipsoid or block b; see `multibody.narrowphase.ellipsoid_distance`."""
    R, x, dims = row_matrix(scratch.bodies.rotation, b), row_vector(scratch.bodies.center, b, 0), _dims(b, scratch)
    way = qt.transposed_matvec(R, minus(row_vector(scratch.bodies.center, a, 0), x))
    A = ellipsoid_matrix(relative_rotation(R, row_matrix(scratch.bodies.rotation, a)), _dims(a, scratch))
    B = (dims[0] * dims[0], 0.0, 0.0, dims[1] * dims[1], 0.0, dims[2] * dims[2])
    is_block = scratch.bodies.body[b].shape == BLOCK
    start = nearest_on_block(way, dims)[1] if is_block else center_direction(way)
    n, gap = max_separation_direction(A, is_block, B, dims, way, start)
    n, p = qt.matvec(R, n), plus(x, qt.matvec(R, minus(way, ellipsoid_support_point(A, n)[1])))
    return gap, n, p, add_scaled(p, -gap, n)


@kernel
def _nearest_of_ellipsoid_hull(a, b, scratch):
    """Nearest points of an ellipsoid a and a hull b; see `hull_ellipsoid.collide_ellipsoid_hull`."""
    hulls, origin = scratch.narrowphase.hulls, row_vector(scratch.bodies.center, b, 0)
    pose_hull(0, b, origin, scratch)
    way = minus(row_vector(scratch.bodies.center, a, 0), origin)
    S, dims = row_matrix(scratch.bodies.rotation, a), _dims(a, scratch)
    D, gap, face = ellipsoid_matrix(S, dims), -math.inf, 0
    for f in range(hulls.of[b, LAST_FACE] - hulls.of[b, FIRST_FACE]):
        m = row_vector(hulls.normal[0], f, 0)
        height = qt.dot(m, way) - ellipsoid_support_point(D, m)[0] - hulls.offset[0, f]
        if height > gap:
            gap, face = height, f
    n = row_vector(hulls.normal[0], face, 0)
    if not is_above_face(0, b, face, minus(way, ellipsoid_support_point(D, n)[1]), scratch):
        for e in range(hulls.of[b, LAST_EDGE] - hulls.of[b, FIRST_EDGE]):
            m = direction_from_edge(e, b, S, dims, way, scratch)
            height = hull_separation(b, D, way, m, scratch)
            if height > gap:
                gap, n = height, m
    p = plus(origin, minus(way, ellipsoid_support_point(D, n)[1]))
    return gap, n, p, add_scaled(p, -gap, n)


@inlined
def _is_first(a, b, scratch):
    """True if body a comes first in `_nearest_in_order`: spheres before ellipsoids before polyhedra."""
    first, second = scratch.bodies.body[a].shape, scratch.bodies.body[b].shape
    return first == SPHERE or (second != SPHERE and (first == ELLIPSOID or second != ELLIPSOID))


@kernel
def _nearest_in_order(a, b, scratch):
    first, second = scratch.bodies.body[a].shape, scratch.bodies.body[b].shape
    if first == SPHERE:
        x, r = row_vector(scratch.bodies.center, a, 0), scratch.bodies.body[a].dims[0]
        distance, n, q = nearest_on_body(b, x, scratch)
        return distance - r, n, add_scaled(x, -r, n), q
    if first != ELLIPSOID:
        return nearest_of_polyhedra(a, b, scratch)
    if second == HULL:
        return _nearest_of_ellipsoid_hull(a, b, scratch)
    return _nearest_of_ellipsoid(a, b, scratch)


@kernel
def nearest_of_bodies(a, b, scratch):
    """Nearest points of bodies a and b of any shapes."""
    if is_capsule(a, scratch):
        return nearest_of_capsule(a, b, scratch)
    if is_capsule(b, scratch):
        gap, n, q, p = nearest_of_capsule(b, a, scratch)
        return gap, times(-1.0, n), p, q
    if _is_first(a, b, scratch):
        return _nearest_in_order(a, b, scratch)
    gap, n, q, p = _nearest_in_order(b, a, scratch)
    return gap, times(-1.0, n), p, q


@kernel
def nearest_to_wall(a, wall, scratch):
    """Nearest points of body a and a wall."""
    n, x = row_vector(scratch.walls, wall, WALL_NORMAL), row_vector(scratch.bodies.center, a, 0)
    p = support_point(a, x, row_matrix(scratch.bodies.rotation, a), times(-1.0, n), 0.0, True, scratch)
    gap = qt.dot(n, p) - scratch.walls[wall, WALL_OFFSET]
    return gap, n, p, add_scaled(p, -gap, n)
