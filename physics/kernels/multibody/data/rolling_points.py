"""Points of a cylinder in contact that roll over its surface, on a wall or on a face that owns the normal.

All of this is left out of kernels whose scene has no cylinder.
"""

from __future__ import annotations

from physics.compiler.decorators import if_given, inlined, kernel
from physics.kernels.math import quaternion as qt
from physics.kernels.math.vector import minus, plus, row_vector, times
from physics.kernels.multibody.data.arrays import FEATURES_PER_PAIR
from physics.kernels.multibody.data.cylinders import (
    ROLLING_FEATURES,
    is_cylinder,
    rolling_arm,
    rolling_arm_rate,
    rotation_of,
)
from physics.kernels.multibody.data.fixed_bodies import body_at
from physics.kernels.multibody.data.parts import body_of, first_part, second_part


@inlined
def rolls_on_rim(k, b, many):
    """True if body or part b is a cylinder whose point in contact k, with a wall or face, rolls over its surface."""
    if not is_cylinder(b, many) or many.contacts.id[k] % FEATURES_PER_PAIR >= ROLLING_FEATURES:
        return False
    owner = many.contacts.owner[k]
    return body_at(many.contacts.bodies[k, 1], many) < 0 or (owner >= 0 and owner != b)


@if_given("many.bodies.cylinders", False)
def may_roll(k, many):
    """True if a point of contact k rolls over the surface of a cylinder."""
    end = body_at(many.contacts.bodies[k, 1], many)
    return rolls_on_rim(k, first_part(k, many), many) or (end >= 0 and rolls_on_rim(k, second_part(end, k, many), many))


@inlined
def _spin_of_owner(k, many):
    """Angular velocity of the body whose face owns the normal of contact k, world frame; of a wall 0 [rad/s]."""
    owner = many.contacts.owner[k]
    return row_vector(many.bodies.twist, body_of(owner, many), 3) if owner >= 0 else (0.0, 0.0, 0.0)


@kernel
def rolling_rate(k, b, first, side, many):
    """Velocity r' of the rolling point of part b in contact k, from the centre of the cylinder [m/s].

    The face to which the point rolls turns at Ω. In its frame the cylinder turns at ω - Ω, and the face stays as it is;
    the turn of that frame adds Ω x r. `first` is the column of the part's anchor; `side` is -1 for the first part of
    the contact, 1 for the second.
    """
    R, place, n = rotation_of(b, many), many.contacts.anchor[k, first + 1], row_vector(many.contacts.frame, k, 0)
    w, spin, way = row_vector(many.bodies.twist, body_of(b, many), 3), _spin_of_owner(k, many), times(side, n)
    rate = rolling_arm_rate(b, place, R, minus(w, spin), way, many)
    return plus(rate, qt.cross(spin, rolling_arm(b, place, R, way, many)))


@kernel
def rolling_acceleration(k, b, first, side, many):
    """Acceleration ω x r' of the body's point under the rolling point of part b in contact k [m/s²].

    As the point moves over the body at δ = r' - ω x r, the gap to a face that turns at Ω gains -n·(Ω x δ), too. So the
    whole is ω x r' - Ω x δ = (ω - Ω) x r' + Ω x (ω x r). Arguments are those of `rolling_rate`.
    """
    R, place, n = rotation_of(b, many), many.contacts.anchor[k, first + 1], row_vector(many.contacts.frame, k, 0)
    w, spin = row_vector(many.bodies.twist, body_of(b, many), 3), _spin_of_owner(k, many)
    around = qt.cross(w, rolling_arm(b, place, R, times(side, n), many))
    return plus(qt.cross(minus(w, spin), rolling_rate(k, b, first, side, many)), qt.cross(spin, around))


def _same_velocity(k, b, first, side, u, many):
    return u


@if_given("many.bodies.cylinders", _same_velocity)
def plus_rolling(k, b, first, side, u, many):
    """Velocity u of contact k, plus that at which its point rolls over the surface of part b [m/s].

    Arguments are those of `rolling_rate`.
    """
    if not rolls_on_rim(k, b, many):
        return u
    n, R = row_vector(many.contacts.frame, k, 0), rotation_of(b, many)
    arm = rolling_arm(b, many.contacts.anchor[k, first + 1], R, times(side, n), many)
    spin = row_vector(many.bodies.twist, body_of(b, many), 3)
    return plus(u, minus(rolling_rate(k, b, first, side, many), qt.cross(spin, arm)))
