"""Contacts of a sphere with a sphere and with a block, from the distance of the sphere's centre."""

from __future__ import annotations

import math

from physics.compiler.decorators import inlined
from physics.kernels.math import quaternion as qt
from physics.kernels.math.vector import row_vector
from physics.kernels.multibody.data.contact_set import (
    add_contact,
    add_ordered_contact,
    add_scaled,
    row_matrix,
    subtract,
)
from physics.kernels.multibody.narrowphase.ellipsoid_distance import nearest_on_block
from physics.kernels.state.layout import BLOCK


@inlined
def collide_spheres(a, b, margin, h, many):
    """Add the contact of spheres a and b to the contact set if their gap is at most `margin` [m].

    h is the length of the stage [s].
    """
    x, y = row_vector(many.bodies.center, a, 0), row_vector(many.bodies.center, b, 0)
    ra, rb = many.bodies.body[a].dims[0], many.bodies.body[b].dims[0]
    n = subtract(x, y)
    size = math.sqrt(qt.dot(n, n))
    if size - ra - rb > margin:
        return
    n = (n[0] / size, n[1] / size, n[2] / size) if size > 0.0 else (0.0, 1.0, 0.0)
    add_contact(a, b, 0, -1, n, (add_scaled(x, -ra, n), add_scaled(y, rb, n)), size - ra - rb, h, many)


@inlined
def collide_sphere_block(a, b, margin, h, many):
    """Add the contact of a sphere and a block if their gap is at most `margin` [m]; a and b are these in either order.

    h is the length of the stage [s].
    """
    ball, brick = a, b
    if many.bodies.body[a].shape == BLOCK:
        ball, brick = b, a
    R, dims, r = (
        row_matrix(many.bodies.rotation, brick),
        many.bodies.body[brick].dims,
        many.bodies.body[ball].dims[0],
    )
    x, y = row_vector(many.bodies.center, ball, 0), row_vector(many.bodies.center, brick, 0)
    q, n, distance = nearest_on_block(qt.transposed_matvec(R, subtract(x, y)), (dims[0], dims[1], dims[2]))
    if distance - r > margin:
        return
    n = qt.matvec(R, n)
    add_ordered_contact(a, b, ball, n, add_scaled(x, -r, n), add_scaled(y, 1.0, qt.matvec(R, q)), distance - r, h, many)
