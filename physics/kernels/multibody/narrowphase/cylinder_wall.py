"""Contacts of a cylinder with a wall: the lowest point of each rim, or a ring of points of a rim that lies flat.

A tilted cylinder touches a wall with the lowest point of a rim, which rolls along it; on its side, with those of both
rims. On a face it touches with a ring of points (`flat_ends`).
"""

from __future__ import annotations

import math

from physics.compiler.decorators import if_given, inlined, kernel
from physics.kernels.contact_law.materials import friction_at
from physics.kernels.math import quaternion as qt
from physics.kernels.math.vector import minus, plus, row_vector, times
from physics.kernels.multibody.data.contact_set import add_contact, row_matrix
from physics.kernels.multibody.data.cylinders import (
    LOWEST_FEATURE,
    RING_FEATURE,
    RING_POINTS,
    across_axis,
    axis_of,
    is_cylinder,
    rim_arm,
)
from physics.kernels.multibody.data.parts import body_of
from physics.kernels.multibody.narrowphase.flat_ends import (
    first_of_ring,
    is_level,
    may_lie_flat,
    middle_of_end,
    ring_arm,
)
from physics.kernels.state.layout import WALL_NORMAL, WALL_OFFSET


@inlined
def _add_point(b, feature, wall, arm, margin, h, many):
    """Add the contact of the point of cylinder b at `arm` with a wall, if its gap is at most `margin` [m]."""
    n, point = row_vector(many.walls, wall, WALL_NORMAL), plus(row_vector(many.bodies.center, b, 0), arm)
    gap = qt.dot(n, point) - many.walls[wall, WALL_OFFSET]
    if gap <= margin:
        add_contact(b, -1 - wall, feature, -1, n, (point, point), gap, h, many)


@kernel
def _add_ring(b, end, wall, lowest, height, margin, h, many):
    """Add the contacts of a rim that lies flat, or may do so within the stage of length h [s].

    `lowest` is the arm of its lowest point, `height` how much higher the highest one is [m].
    """
    n = row_vector(many.walls, wall, WALL_NORMAL)
    if is_level(b, height, many):
        out = minus(lowest, middle_of_end(b, end, row_matrix(many.bodies.rotation, b), many))
        if qt.dot(out, out) > 0.0:  # else no point of the rim is the lowest one
            _add_point(b, LOWEST_FEATURE + end, wall, lowest, margin, h, many)
    mu = friction_at(wall, many.bodies.body[body_of(b, many)])
    along = first_of_ring(b, end, -1 - wall, lowest, height, mu, n, many)
    for k in range(RING_POINTS):
        _add_point(b, RING_FEATURE + RING_POINTS * end + k, wall, ring_arm(b, end, k, along, many), margin, h, many)


@if_given("many.bodies.cylinders", False)
def collide_cylinder_wall(b, wall, margin, h, many):
    """Add the contacts of body or part b with a wall, if it is a cylinder; return whether it is one.

    They are those whose gaps are at most `margin` [m]. h is the length of the stage [s].
    """
    if not is_cylinder(b, many):
        return False
    R, n = row_matrix(many.bodies.rotation, b), row_vector(many.walls, wall, WALL_NORMAL)
    p = across_axis(axis_of(R), n)
    height = 2.0 * many.bodies.body[b].dims[0] * math.sqrt(qt.dot(p, p))
    for end in range(2):
        arm = rim_arm(b, end, R, times(-1.0, n), many)
        gap = qt.dot(n, plus(row_vector(many.bodies.center, b, 0), arm)) - many.walls[wall, WALL_OFFSET]
        if gap > margin:
            continue
        if may_lie_flat(b, end, -1 - wall, n, arm, (gap, height), h, many):
            _add_ring(b, end, wall, arm, height, margin, h, many)
        else:
            _add_point(b, end, wall, arm, margin, h, many)
    return True
