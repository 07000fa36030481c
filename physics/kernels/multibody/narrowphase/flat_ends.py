"""Ends of a cylinder that lie flat on a wall or face, or may do so within a stage: the ring of points that carry them.

On a face a cylinder would touch with a disk. The points of a ring about it carry all loads that the disk can carry
whose resultant passes within the polygon of these points. One of them is

- the lowest point of the rim, while the rim is tilted, or
- the point towards which the loads would tip a cylinder that stands, or a body that stands on it.

So a cylinder tips over exactly this point. Where other bodies press on it, the polygon reaches at least
r cos(π/`RING_POINTS`) far, 7.6 % less than the disk.
"""

from __future__ import annotations

import math

from physics.compiler.decorators import inlined, kernel
from physics.kernels.math import quaternion as qt
from physics.kernels.math.vector import as_vector, minus, plus, row_vector, times
from physics.kernels.multibody.data.contact_set import row_matrix
from physics.kernels.multibody.data.cylinders import RING_POINTS, across_axis, axis_of
from physics.kernels.multibody.data.parts import body_of, from_body

# Sine of the tilt up to which the direction of the lowest point is too uncertain to place the ring: rounding of unit
# vectors turns it by 1e-16 over this sine. Twenty times it is the error of the ring, if the lowest point were left out.
_FLAT_SINE = 1.0e-6

# Largest acceleration of a point of a rim, in accelerations by loads: a thin disk that tips over its edge turns
# at 4 g/(5 r), so that the farthest point falls at 1.6 g.
_FALL_SHARE = 2.0


@inlined
def is_level(b, height, many):
    """True if a rim whose highest point is so much higher than its lowest one has no certain lowest point [m]."""
    return height <= 2.0 * _FLAT_SINE * many.bodies.body[b].dims[0]


@inlined
def _velocity_at(part, point, many):
    """Velocity of the point of a part at `point`, world frame; of a wall 0 [m/s]."""
    if part < 0:
        return (0.0, 0.0, 0.0)
    b = body_of(part, many)
    arm = minus(point, row_vector(many.bodies.state, b, 0))
    return plus(row_vector(many.bodies.twist, b, 0), qt.cross(row_vector(many.bodies.twist, b, 3), arm))


@kernel
def may_lie_flat(b, end, other, n, lowest, place, h, many):
    """True if the highest point of a rim of cylinder b may reach a face within h [s].

    The face belongs to part `other`, below 0 for a wall, and has the normal n. `lowest` is the arm of the rim's lowest
    point, `place` its gap and how much higher the highest one is [m].
    """
    gap, height = place
    y, body = axis_of(row_matrix(many.bodies.rotation, b)), body_of(b, many)
    highest = minus(times(2.0 * (2.0 * end - 1.0) * many.bodies.body[b].dims[1], y), lowest)
    point = plus(row_vector(many.bodies.state, body, 0), from_body(b, highest, many))
    v = minus(_velocity_at(b, point, many), _velocity_at(other, point, many))
    pull = many.bodies.body[body].acceleration
    if other >= 0:
        pull += many.bodies.body[body_of(other, many)].acceleration
    fall = h * min(0.0, qt.dot(n, v))
    fall -= _FALL_SHARE * h * h * pull
    return gap + height + fall <= many.bodies.body[body].slop or is_level(b, height, many)


@kernel
def _tipping_direction(b, middle, mu, n, many):
    """Direction along a face, of any length, from the middle of an end towards the point that carries body b's loads.

    The face's force F acts at p from the centre of mass, and its moment balances the torque τ of the loads:

        τ + p x F = 0,    F = N n + F_t,    so that    N p_t = -n x τ + (n·p) F_t.

    F_t balances the loads along the face if friction of coefficient `mu` can, else it is as large as friction can be.
    `middle` is that of the end, from the centre of mass [m]. The result is N (p_t - middle_t), per mass.
    """
    body, share = many.bodies.body[b], many.bodies.inv_mass[b]
    a, torque = as_vector(body.free_acceleration), as_vector(body.torque)
    press, pull = max(0.0, -qt.dot(n, a)), across_axis(n, a)
    size, most = math.sqrt(qt.dot(pull, pull)), mu * press
    if size > most:
        pull = times(most / size, pull)
    found = minus(times(-qt.dot(n, middle), pull), times(share, qt.cross(n, torque)))
    return minus(found, times(press, across_axis(n, middle)))


@inlined
def middle_of_end(b, end, R, many):
    """Middle of the lower (0) or upper (1) end of cylinder b, from its centre, world frame [m]."""
    return times((2.0 * end - 1.0) * many.bodies.body[b].dims[1], axis_of(R))


@inlined
def _leaning_direction(b, other, middle, mu, n, many):
    """Do the work of `_tipping_direction` for the body that its loads press on the other one, of parts b and `other`.

    That is cylinder b unless they pull it away from the face. `middle` leads from the centre of b.
    """
    body = body_of(b, many)
    if other >= 0 and not qt.dot(n, as_vector(many.bodies.body[body].free_acceleration)) < 0.0:
        point, rider = plus(row_vector(many.bodies.center, b, 0), middle), body_of(other, many)
        arm = minus(point, row_vector(many.bodies.state, rider, 0))
        return _tipping_direction(rider, arm, mu, times(-1.0, n), many)
    return _tipping_direction(body, from_body(b, middle, many), mu, n, many)


@kernel
def first_of_ring(b, end, other, lowest, height, mu, n, many):
    """First point of the ring of a rim of cylinder b on a face with the normal n, from the middle of the end [m].

    The face belongs to part `other`, below 0 for a wall. `lowest` is the arm of the rim's lowest point, `height` how
    much higher the highest one is [m], `mu` the friction.
    """
    R, r = row_matrix(many.bodies.rotation, b), many.bodies.body[b].dims[0]
    middle = middle_of_end(b, end, R, many)
    along = minus(lowest, middle)
    if is_level(b, height, many):
        along = across_axis(axis_of(R), _leaning_direction(b, other, middle, mu, n, many))
    square = qt.dot(along, along)
    if not square > 0.0:
        along, square = (R[0], R[3], R[6]), 1.0
    return times(r / math.sqrt(square), along)


@inlined
def ring_arm(b, end, k, along, many):
    """Point k of the ring whose first point is `along`, from the centre of cylinder b, world frame [m]."""
    R, angle = row_matrix(many.bodies.rotation, b), 2.0 * math.pi * k / RING_POINTS
    across = qt.cross(axis_of(R), along)
    return plus(middle_of_end(b, end, R, many), plus(times(math.cos(angle), along), times(math.sin(angle), across)))
