"""Stages of a lone body end where the last contact of a face that pushes passes its rim.

Contacts are found at the start of a stage, and last until its end. Where a block slides off the end of a ramp, the edge
would push on nothing for the rest of the stage: an error of first order. So a stage ends when the last point on a
pair's reference face has left that face. A point at p, in the frame of the body with the face, that moves
with the velocity u along the face crosses the plane m·x = c of another face at the time

    (c - m·p) / (m·u),    if m·u > 0.

Under error control short parts meet these moments (`sudden_change`).

All of this is left out of kernels unless exactly one body moves, among fixed ones.
"""

from __future__ import annotations

import math

from physics.compiler.decorators import if_given, inlined, kernel
from physics.kernels.math import quaternion as qt
from physics.kernels.math.vector import minus, row_vector
from physics.kernels.multibody.data.contact_set import (
    end_of_pair,
    pair_slop,
    relative_velocity,
    row_matrix,
)
from physics.kernels.multibody.data.driven_bodies import driven_velocity
from physics.kernels.multibody.data.fixed_bodies import body_at
from physics.kernels.multibody.data.hull_tables import FIRST_CORNER, FIRST_FACE, LAST_FACE
from physics.kernels.multibody.data.rolling_points import plus_rolling
from physics.kernels.multibody.data.warm_start import load_warm_impulses
from physics.kernels.state import layout as at

# Faces whose normals have at least this cosine with that of the contact are the face itself.
_SAME_FACE = 0.99

# Gap up to which a contact is on the face, in slops.
_TOUCH_SLOPS = 10.0

# Least length of a stage that ends at a rim, as a share of the stage without it.
_LEAST_SHARE = 1.0e-4

# Distance beyond the rim at which the stage ends, in slops: clipping keeps points outside by one slop.
_BEYOND_SLOPS = 2.0


@inlined
def _crossing(m, c, p, u, n, first):
    """Time at which a point at p with velocity u crosses the face m·x = c, if that is before `first`, else `first`."""
    rate = qt.dot(m, u)
    if qt.dot(m, n) >= _SAME_FACE or not rate > 0.0:
        return first
    return min(first, max(0.0, c - qt.dot(m, p)) / rate)


@inlined
def _time_on_block(b, p, u, n, beyond, many):
    d, first = many.bodies.body[b].dims, math.inf
    for j in range(3):
        for sign in (-1.0, 1.0):
            m = (sign if j == 0 else 0.0, sign if j == 1 else 0.0, sign if j == 2 else 0.0)
            first = _crossing(m, d[j] + beyond, p, u, n, first)
    return first


def _no_hulls(b, p, u, n, beyond, many):
    return math.inf


@if_given("many.narrowphase.hulls", _no_hulls)
def _time_on_hull(b, p, u, n, beyond, many):
    tables, first = many.narrowphase.hulls, math.inf
    for f in range(tables.of[b, FIRST_FACE], tables.of[b, LAST_FACE]):
        m = row_vector(tables.normals, f, 0)
        corner = row_vector(tables.corners, tables.of[b, FIRST_CORNER] + tables.ring[tables.loops[f, 0]], 0)
        first = _crossing(m, qt.dot(m, corner) + beyond, p, u, n, first)
    return first


@inlined
def _time_on_face(k, many):
    """Time for which the point of contact k stays above the face that owns its normal, at its present velocity [s]."""
    a, owner = many.contacts.bodies[k, 0], many.contacts.owner[k]
    u = minus(relative_velocity(k, many.bodies.twist, many), driven_velocity(k, many))
    if owner == a:
        u = plus_rolling(k, body_at(many.contacts.bodies[k, 1], many), 3, 1.0, (-u[0], -u[1], -u[2]), many)
    else:
        u = plus_rolling(k, a, 0, -1.0, u, many)
    arm = row_vector(many.contacts.arm, k, 0)
    point = minus(row_vector(many.bodies.center, owner, 0), row_vector(many.bodies.state, a, at.POS))
    R, n = row_matrix(many.bodies.rotation, owner), row_vector(many.contacts.normal, k, 0)
    p, u = qt.transposed_matvec(R, minus(arm, point)), qt.transposed_matvec(R, u)
    if owner == a:
        n = (-n[0], -n[1], -n[2])
    beyond = _BEYOND_SLOPS * pair_slop(a, many.contacts.bodies[k, 1], many)
    if many.bodies.body[owner].shape == at.BLOCK:
        return _time_on_block(owner, p, u, n, beyond, many)
    return _time_on_hull(owner, p, u, n, beyond, many)


@inlined
def _is_on_face(k, many):
    """True if contact k has pushed in the stage before, or touches."""
    slop = pair_slop(many.contacts.bodies[k, 0], many.contacts.bodies[k, 1], many)
    return many.contacts.impulse[k, 0] > 0.0 or many.contacts.gap[k] <= _TOUCH_SLOPS * slop


@kernel
def _first_crossing(n, world, h, memory, many):
    load_warm_impulses(n, world, h, None, memory, many)
    first, k = h, 0
    while k < n:
        last, latest, is_pushing = end_of_pair(k, n, many), 0.0, False
        for i in range(k, last):
            is_pushing = is_pushing or many.contacts.impulse[i, 0] > 0.0
            if latest < first and _is_on_face(i, many):
                latest = max(latest, _time_on_face(i, many) if many.contacts.owner[i] >= 0 else math.inf)
        if is_pushing and latest > _LEAST_SHARE * h:
            first = min(first, latest)
        k = last
    return first


def _whole_stage(n, world, h, is_last, memory, many):
    return h


@if_given("many.lone", _whole_stage)
def stage_to_rim(n, world, h, is_last, memory, many):
    """Length of a stage of at most h [s] that ends where the last pushing contact of a pair passes a rim.

    The last stage of a substep (`is_last`) is not cut. `world` is the index of the world, `memory` has its warm starts.
    """
    if is_last or n == 0 or many.lone.slow[0] == 1 or many.settings[0].is_error_controlled == 1:
        return h
    return _first_crossing(n, world, h, memory, many)
