"""Contacts of a body with a wall: vertices of a block, corners of a hull, the nearest point of a round body."""

from __future__ import annotations

from physics.compiler.decorators import kernel
from physics.kernels.half_space import support_function as geo
from physics.kernels.math import quaternion as qt
from physics.kernels.math.vector import row_vector
from physics.kernels.multibody.data.contact_set import add_contact, add_scaled, row_matrix
from physics.kernels.multibody.data.hull_tables import FIRST_CORNER, LAST_CORNER
from physics.kernels.multibody.narrowphase.hull_pose import corner_arm
from physics.kernels.state.layout import BLOCK, VERTEX_COUNT, WALL_NORMAL, WALL_OFFSET


@kernel
def collide_body_wall(b, wall, margin, h, many):
    """Add the contacts of body b, a block, sphere or ellipsoid, with a wall whose gaps are at most `margin` [m].

    `wall` is the wall's index, h the length of the stage [s].
    """
    body, R = many.bodies.body[b], row_matrix(many.bodies.rotation, b)
    n, x = row_vector(many.walls, wall, WALL_NORMAL), row_vector(many.bodies.center, b, 0)
    d = qt.dot(n, x) - many.walls[wall, WALL_OFFSET]
    if d > body.radius + margin:
        return
    dims = (body.dims[0], body.dims[1], body.dims[2])
    e = geo.scaled_normal(body.shape, dims, R, n)
    if d - geo.support(body.shape, dims, e) > margin:
        return
    if body.shape == BLOCK:
        for vertex in range(VERTEX_COUNT):
            gap = d + geo.vertex_height(e, vertex)
            if gap <= margin:
                point = add_scaled(x, 1.0, geo.vertex_arm(dims, R, vertex))
                add_contact(b, -1 - wall, vertex, -1, n, (point, point), gap, h, many)
    else:
        gap = d - geo.support(body.shape, dims, e)
        point = add_scaled(x, 1.0, geo.support_arm(body.shape, dims, R, n, e))
        add_contact(b, -1 - wall, 0, -1, n, (point, point), gap, h, many)


@kernel
def collide_hull_wall(b, wall, margin, h, many):
    """Add the contacts of hull b with a wall: one for each corner whose gap is at most `margin` [m].

    `wall` is the wall's index, h the length of the stage [s]. The feature of a contact is the number of its corner.
    """
    n, x, first = (
        row_vector(many.walls, wall, WALL_NORMAL),
        row_vector(many.bodies.center, b, 0),
        many.narrowphase.hulls.of[b, FIRST_CORNER],
    )
    d = qt.dot(n, x) - many.walls[wall, WALL_OFFSET]
    if d > many.bodies.body[b].radius + margin:
        return
    for k in range(many.narrowphase.hulls.of[b, LAST_CORNER] - first):
        r = corner_arm(b, first + k, many)
        gap = d + qt.dot(n, r)
        if gap <= margin:
            point = add_scaled(x, 1.0, r)
            add_contact(b, -1 - wall, k, -1, n, (point, point), gap, h, many)
