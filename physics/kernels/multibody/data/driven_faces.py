"""Flat faces of driven bodies below spheres, capsules and ellipsoids: the normal of such a contact turns with the face.

A driven body may be large, and no impulse slows it. While its face turns at Ω in a stage of length h, it comes towards
a body that slides over it at u, or goes away, by |u| |Ω| h²/2. This may be more than the body's radius.

All of this is left out of kernels whose scene has no body with a motion.
"""

from __future__ import annotations

from physics.compiler.decorators import if_given, inlined, kernel
from physics.kernels.half_space.contact_point import ellipsoid_point_and_rate
from physics.kernels.math import quaternion as qt
from physics.kernels.math.vector import minus, plus, row_vector, times
from physics.kernels.multibody.data.capsules import is_capsule
from physics.kernels.multibody.data.cylinders import rotation_of
from physics.kernels.multibody.data.driven_bodies import is_driven
from physics.kernels.multibody.data.hull_tables import FIRST_FACE, LAST_FACE
from physics.kernels.multibody.data.parts import body_of, first_part
from physics.kernels.state.layout import BLOCK, ELLIPSOID, SPHERE

# Cosine of the angle below which two directions are the same (1.4e-6 rad).
_SAME_DIRECTION = 1.0 - 1.0e-12


@inlined
def _is_round(part, many):
    return many.bodies.body[part].shape in (SPHERE, ELLIPSOID) or is_capsule(part, many)


def _no_face(part, n, many):
    return False


@if_given("many.narrowphase.hulls", _no_face)
def _is_normal_of_hull(part, n, many):
    """True if the unit vector n, in the frame of the part, is the normal of one of its faces, if it is a hull."""
    tables = many.narrowphase.hulls
    for f in range(tables.of[part, FIRST_FACE], tables.of[part, LAST_FACE]):
        if qt.dot(n, row_vector(tables.normals, f, 0)) > _SAME_DIRECTION:
            return True
    return False


@kernel
def _has_face(part, n, many):
    """True if the unit vector n out of a block or hull, world frame, is the normal of one of its faces."""
    m = qt.transposed_matvec(rotation_of(part, many), n)
    if many.bodies.body[part].shape == BLOCK:
        return max(abs(m[0]), max(abs(m[1]), abs(m[2]))) > _SAME_DIRECTION
    return _is_normal_of_hull(part, m, many)


def _same_owner(one, other, owner, n, many):
    return owner


@if_given("many.driven", _same_owner)
def driven_owner(one, other, owner, n, many):
    """Owner of a contact's normal n: part `other` if a face of it is driven and below round part `one`, else `owner`.

    `other` is below 0 for a wall.
    """
    if owner != -1 or other < 0 or not is_driven(body_of(other, many), many) or not _is_round(one, many):
        return owner
    return other if _has_face(other, n, many) else owner


@inlined
def _arm_and_rates(part, w, spin, n, many):
    """Arm ρ to the contact point of a round part, and its rates: for a normal n that is still, or turns at `spin`.

    The arm leads from the centre of the part, of a capsule from that of its ball. The part turns at w.
    """
    d = many.bodies.body[part].dims
    if many.bodies.body[part].shape != ELLIPSOID:
        arm = times(-d[0], n)
        return arm, (0.0, 0.0, 0.0), qt.cross(spin, arm)
    d, R = (d[0], d[1], d[2]), rotation_of(part, many)
    arm, still = ellipsoid_point_and_rate(d, R, w, n)
    _, rate = ellipsoid_point_and_rate(d, R, minus(w, spin), n)
    return arm, still, plus(qt.cross(spin, arm), rate)


def _coriolis_of_point(k, owner, n, u, many):
    return qt.dot(n, qt.cross(row_vector(many.bodies.twist, body_of(owner, many), 3), u))


@if_given("many.driven", _coriolis_of_point)
def coriolis_of_owner(k, owner, n, u, many):
    """Acceleration n·(Ω x u) of contact k as its normal n turns at Ω with its owner, with that of a round part [m/s²].

    The contact points of the two bodies have the relative velocity u. Over a round body that turns at ω, the point
    moves: its arm ρ has the rate ρ', so that it moves over the body at δ = ρ' - ω x ρ. In the second derivative of the
    gap, n·(ω x ρ') - n·(Ω x δ) takes the place of n·(ω x ρ₀'), with the rate ρ₀' for a normal that is still, which
    other terms have. Half of this difference, reversed, is added.
    """
    one, spin = first_part(k, many), row_vector(many.bodies.twist, body_of(owner, many), 3)
    found = qt.dot(n, qt.cross(spin, u))
    if owner == one or not _is_round(one, many):
        return found
    w = row_vector(many.bodies.twist, body_of(one, many), 3)
    arm, still, rate = _arm_and_rates(one, w, spin, n, many)
    more = minus(qt.cross(w, minus(rate, still)), qt.cross(spin, minus(rate, qt.cross(w, arm))))
    return found - 0.5 * qt.dot(n, more)
