"""Contacts of a cylinder with a wall: the lowest point of each rim, or a ring of points of a rim that lies flat.

A tilted cylinder touches a wall with the lowest point of a rim, which rolls along it; on its side, with those of both
rims. On a face it would touch with a disk. The points of a ring about the face carry all loads that the disk can carry
whose resultant passes within the polygon of these points. One of them is

- the lowest point of the rim, while the rim is tilted, or
- the point towards which the loads would tip a cylinder that stands.

So a cylinder tips over exactly this point. Where other bodies press on it, the polygon reaches at least
r cos(π/`RING_POINTS`) far, 7.6 % less than the disk.
"""

from __future__ import annotations

import math

from physics.compiler.decorators import if_given, inlined, kernel
from physics.kernels.contact_law.materials import friction_at
from physics.kernels.math import quaternion as qt
from physics.kernels.math.vector import as_vector, minus, plus, row_vector, times
from physics.kernels.multibody.data.contact_set import add_contact, row_matrix
from physics.kernels.multibody.data.cylinders import (
    ROLLING_FEATURES,
    across_axis,
    axis_of,
    is_cylinder,
    rim_arm,
)
from physics.kernels.multibody.data.parts import body_of, from_body
from physics.kernels.state.layout import WALL_NORMAL, WALL_OFFSET

# Points of the ring of a face, and the feature of the lowest point where it is not one of them; the other end follows.
RING_POINTS = 8
LOWEST_FEATURE = ROLLING_FEATURES + 2 * RING_POINTS

# Sine of the tilt up to which the direction of the lowest point is too uncertain to place the ring: rounding of unit
# vectors turns it by 1e-16 over this sine. Twenty times it is the error of the ring, if the lowest point were left out.
_FLAT_SINE = 1.0e-6

# Largest acceleration of a point of a rim, in accelerations by loads: a thin disk that tips over its edge turns
# at 4 g/(5 r), so that the farthest point falls at 1.6 g.
_FALL_SHARE = 2.0


@inlined
def _speed_along(b, arm, n, many):
    """Speed along n of the point of a cylinder at `arm` from the centre of mass of its body b [m/s]."""
    v, w = row_vector(many.bodies.twist, b, 0), row_vector(many.bodies.twist, b, 3)
    return qt.dot(n, plus(v, qt.cross(w, arm)))


@kernel
def _tipping_direction(b, middle, wall, n, many):
    """Direction along the wall, of any length, from the middle of a face towards the point that carries body b's loads.

    The wall's force F acts at p from the centre of mass, and its moment balances the torque τ of the loads:

        τ + p x F = 0,    F = N n + F_t,    so that    N p_t = -n x τ + (n·p) F_t.

    F_t balances the loads along the wall if friction can, else it is as large as friction can be. `middle` is that of
    the face, from the centre of mass [m]. The result is N (p_t - middle_t), per mass.
    """
    body, share = many.bodies.body[b], many.bodies.inv_mass[b]
    a, torque = as_vector(body.free_acceleration), as_vector(body.torque)
    press, pull = max(0.0, -qt.dot(n, a)), across_axis(n, a)
    size, most = math.sqrt(qt.dot(pull, pull)), friction_at(wall, body) * press
    if size > most:
        pull = times(most / size, pull)
    found = minus(times(-qt.dot(n, middle), pull), times(share, qt.cross(n, torque)))
    return minus(found, times(press, across_axis(n, middle)))


@inlined
def _add_point(b, feature, wall, point, margin, h, many):
    """Add the contact of a point of cylinder b with a wall, if its gap is at most `margin` [m]."""
    n = row_vector(many.walls, wall, WALL_NORMAL)
    gap = qt.dot(n, point) - many.walls[wall, WALL_OFFSET]
    if gap <= margin:
        add_contact(b, -1 - wall, feature, -1, n, (point, point), gap, h, many)


@kernel
def _add_ring(b, end, wall, lowest, height, margin, h, many):
    """Add the contacts of a rim that lies flat, or may do so within the stage of length h [s].

    `lowest` is the arm of its lowest point, `height` how much higher the highest one is [m].
    """
    R, n = row_matrix(many.bodies.rotation, b), row_vector(many.walls, wall, WALL_NORMAL)
    x, y, r = row_vector(many.bodies.center, b, 0), axis_of(R), many.bodies.body[b].dims[0]
    middle = times((2.0 * end - 1.0) * many.bodies.body[b].dims[1], y)
    along = minus(lowest, middle)
    if height <= 2.0 * _FLAT_SINE * r:
        if qt.dot(along, along) > 0.0:  # else no point of the rim is the lowest one
            _add_point(b, LOWEST_FEATURE + end, wall, plus(x, lowest), margin, h, many)
        along = across_axis(y, _tipping_direction(body_of(b, many), from_body(b, middle, many), wall, n, many))
    square = qt.dot(along, along)
    if not square > 0.0:
        along, square = (R[0], R[3], R[6]), 1.0
    along = times(r / math.sqrt(square), along)
    across = qt.cross(y, along)
    for k in range(RING_POINTS):
        angle = 2.0 * math.pi * k / RING_POINTS
        point = plus(x, plus(middle, plus(times(math.cos(angle), along), times(math.sin(angle), across))))
        _add_point(b, ROLLING_FEATURES + RING_POINTS * end + k, wall, point, margin, h, many)


@inlined
def _may_lie_flat(b, end, lowest, gap, height, wall, h, many):
    """True if the highest point of a rim of cylinder b may reach a wall within h [s]; arguments as of `_add_ring`."""
    n, y, body = (
        row_vector(many.walls, wall, WALL_NORMAL),
        axis_of(row_matrix(many.bodies.rotation, b)),
        body_of(b, many),
    )
    highest = minus(times(2.0 * (2.0 * end - 1.0) * many.bodies.body[b].dims[1], y), lowest)
    fall = h * min(0.0, _speed_along(body, from_body(b, highest, many), n, many))
    fall -= _FALL_SHARE * h * h * many.bodies.body[body].acceleration
    return (
        gap + height + fall <= many.bodies.body[body].slop or height <= 2.0 * _FLAT_SINE * many.bodies.body[b].dims[0]
    )


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
        point = plus(row_vector(many.bodies.center, b, 0), arm)
        gap = qt.dot(n, point) - many.walls[wall, WALL_OFFSET]
        if gap > margin:
            continue
        if _may_lie_flat(b, end, arm, gap, height, wall, h, many):
            _add_ring(b, end, wall, arm, height, margin, h, many)
        else:
            _add_point(b, end, wall, point, margin, h, many)
    return True
