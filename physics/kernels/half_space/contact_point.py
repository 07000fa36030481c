"""Features of a body: contact points relative to its centre of mass, and their motion over the body."""

from __future__ import annotations

import math

from physics.compiler.decorators import inlined
from physics.kernels.half_space import support_function as geo
from physics.kernels.math import quaternion as qt
from physics.kernels.state.layout import BLOCK, SPHERE, WALL_NORMAL, WALL_TANGENT_1, WALL_TANGENT_2


@inlined
def wall_of(slot, scene):
    """Wall of a contact, by a shift: `features`, 8 or 1, is a power of two, and a division would be too slow."""
    return slot >> scene.feature_bits


@inlined
def feature_of(slot, scene):
    """Feature of the body in a contact."""
    return slot & (scene.features - 1)


@inlined
def wall_normal(walls, k):
    """Unit normal of wall k."""
    return (walls[k, WALL_NORMAL], walls[k, WALL_NORMAL + 1], walls[k, WALL_NORMAL + 2])


@inlined
def center_arm(R, body):
    """Geometric centre of a body relative to its centre of mass, world frame [m]; with `offset_frame` only."""
    return qt.matvec(R, (body.center[0], body.center[1], body.center[2]))


@inlined
def geometric_center(x, R, body, offset_frame):
    """Geometric centre of a body whose centre of mass is at x [m] (the same unless `offset_frame`)."""
    if offset_frame is None:
        return x
    r = center_arm(R, body)
    return (x[0] + r[0], x[1] + r[1], x[2] + r[2])


@inlined
def _plus(a, b):
    return (a[0] + b[0], a[1] + b[1], a[2] + b[2])


@inlined
def ellipsoid_point_and_rate(dims, R, w, n):
    """Point of an ellipsoid with the normal -n from its centre, and its rate of change, world frame [m, m/s].

    r = R c with c = -D e/s, e = D Rᵀ n, s = |e| and de/dt = D (Rᵀn x Rᵀω).
    """
    nb, wb = qt.transposed_matvec(R, n), qt.transposed_matvec(R, w)
    e = (dims[0] * nb[0], dims[1] * nb[1], dims[2] * nb[2])
    s = math.sqrt(qt.dot(e, e))
    m = qt.cross(nb, wb)
    f = (dims[0] * m[0], dims[1] * m[1], dims[2] * m[2])
    along = qt.dot(e, f) / (s * s)
    c = (-dims[0] * e[0] / s, -dims[1] * e[1] / s, -dims[2] * e[2] / s)
    dc = (
        -dims[0] * (f[0] - along * e[0]) / s,
        -dims[1] * (f[1] - along * e[1]) / s,
        -dims[2] * (f[2] - along * e[2]) / s,
    )
    r = qt.matvec(R, c)
    return r, _plus(qt.cross(w, r), qt.matvec(R, dc))


@inlined
def contact_arm_and_rate(shape, dims, R, w, n, feature, offset_frame, body):
    """Contact point relative to the centre of mass, and its rate of change, world frame [m, m/s]."""
    if shape == BLOCK:
        r = geo.vertex_arm(dims, R, feature)
        if offset_frame is not None:
            r = _plus(r, center_arm(R, body))
        return r, qt.cross(w, r)
    if shape == SPHERE:
        return (-dims[0] * n[0], -dims[0] * n[1], -dims[0] * n[2]), (0.0, 0.0, 0.0)
    return ellipsoid_point_and_rate(dims, R, w, n)


@inlined
def place_arms(n, R, offset_frame, scratch):
    """Contact points of the set at this pose: `contacts.arm`, relative to the centre of mass, world frame [m]."""
    scene, body, contacts = scratch.scene, scratch.body, scratch.contacts
    walls, shape = scene.walls, body.shape
    dims = (body.dims[0], body.dims[1], body.dims[2])
    for i in range(n):
        wall = wall_of(contacts.slot[i], scene)
        if shape == BLOCK:
            r = geo.vertex_arm(dims, R, feature_of(contacts.slot[i], scene))
            if offset_frame is not None:
                c = center_arm(R, body)
                r = (r[0] + c[0], r[1] + c[1], r[2] + c[2])
        else:
            normal = wall_normal(walls, wall)
            r = geo.support_arm(shape, dims, R, normal, geo.scaled_normal(shape, dims, R, normal))
        contacts.arm[i, 0], contacts.arm[i, 1], contacts.arm[i, 2] = r


@inlined
def wall_axis(walls, wall, first):
    """Three columns of a wall's row: its normal or a tangent."""
    return (walls[wall, first], walls[wall, first + 1], walls[wall, first + 2])


@inlined
def wall_axes(walls, wall):
    """Normal and the two tangents of a wall."""
    return (
        wall_axis(walls, wall, WALL_NORMAL),
        wall_axis(walls, wall, WALL_TANGENT_1),
        wall_axis(walls, wall, WALL_TANGENT_2),
    )


@inlined
def contact_arm(contacts, i):
    """Arm of contact i from the centre of mass [m]."""
    return (contacts.arm[i, 0], contacts.arm[i, 1], contacts.arm[i, 2])
