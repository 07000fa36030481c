"""Contact points of a body relative to its centre of mass, and their motion over the body, for each of its features."""

from __future__ import annotations

import math

from physics.compiler.decorators import inlined
from physics.kernels.half_space import support_function as geo
from physics.kernels.math import quaternion as qt
from physics.kernels.state.layout import BLOCK, SPHERE, WALL_NORMAL, WALL_TANGENT_1, WALL_TANGENT_2


@inlined
def wall_of(slot, scene):
    """Index of the wall in a contact slot, wall * features + feature.

    The number of features is 8 or 1, a power of two: a shift takes the place of a slow division.
    """
    return slot >> scene.feature_bits


@inlined
def feature_of(slot, scene):
    """Index of the body's feature in a contact slot, wall * features + feature."""
    return slot & (scene.features - 1)


@inlined
def wall_normal(walls, k):
    """Unit normal of wall k, out of the wall, world frame."""
    return (walls[k, WALL_NORMAL], walls[k, WALL_NORMAL + 1], walls[k, WALL_NORMAL + 2])


@inlined
def center_arm(R, body):
    """Geometric centre of a body relative to its centre of mass, world frame [m].

    R is the body's rotation matrix. `body.center` is only set where the scene has the switch `offset_frame`.
    """
    return qt.matvec(R, (body.center[0], body.center[1], body.center[2]))


@inlined
def geometric_center(x, R, body, offset_frame):
    """Geometric centre of a body whose centre of mass is at x, world frame [m].

    The two coincide where the switch `offset_frame` is None.
    """
    if offset_frame is None:
        return x
    r = center_arm(R, body)
    return (x[0] + r[0], x[1] + r[1], x[2] + r[2])


@inlined
def _plus(a, b):
    return (a[0] + b[0], a[1] + b[1], a[2] + b[2])


@inlined
def ellipsoid_point_and_rate(dims, R, w, n):
    """Lowest point r of an ellipsoid above a wall of normal n, relative to its centre, and dr/dt [m, m/s].

    The point wanders over the body as it turns at the angular velocity w. With the semi-axes D = diag(dims),
    r = R c with c = -D e/s, e = D Rᵀ n, s = |e| and de/dt = D (Rᵀn x Rᵀω). All vectors are in the world frame.
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
    """Contact point of a feature at a wall of normal n, relative to the centre of mass, and its rate of change.

    R is the body's rotation matrix and w its angular velocity [rad/s]; world frame [m, m/s].
    """
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
    """Write the arms of the n contacts of the set into `contacts.arm`, for a body with the rotation matrix R.

    An arm is the contact point relative to the centre of mass, world frame [m].
    """
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
    """Axis of a wall from the column `first` of its row, WALL_NORMAL or a WALL_TANGENT: its unit normal or tangent."""
    return (walls[wall, first], walls[wall, first + 1], walls[wall, first + 2])


@inlined
def wall_axes(walls, wall):
    """Unit normal and two unit tangents of a wall, a right-handed frame."""
    return (
        wall_axis(walls, wall, WALL_NORMAL),
        wall_axis(walls, wall, WALL_TANGENT_1),
        wall_axis(walls, wall, WALL_TANGENT_2),
    )


@inlined
def contact_arm(contacts, i):
    """Arm of contact i: from the centre of mass to the contact point, world frame [m]."""
    return (contacts.arm[i, 0], contacts.arm[i, 1], contacts.arm[i, 2])
