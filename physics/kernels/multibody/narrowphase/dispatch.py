"""Narrow phase: the contacts of every body with every wall, and of every pair that is near."""

from __future__ import annotations

import math

from physics.kernels.compile.decorators import inlined, kernel, shared_kernel
from physics.kernels.half_space import support_function as geo
from physics.kernels.math import quaternion as qt
from physics.kernels.math.vector import row_vector
from physics.kernels.multibody.broadphase.sweep_and_prune import (
    find_pairs,
    may_meet,
    may_reach_wall,
    surface_motion_bound,
)
from physics.kernels.multibody.data.arrays import NUM_CONTACTS, NUM_PAIRS
from physics.kernels.multibody.data.contact_set import (
    add_contact,
    add_ordered_contact,
    add_scaled,
    pair_slop,
    row_matrix,
    subtract,
)
from physics.kernels.multibody.data.hull_tables import FIRST_CORNER, LAST_CORNER
from physics.kernels.multibody.data.sleeping import wake_touched_groups
from physics.kernels.multibody.narrowphase.box_box import collide_blocks
from physics.kernels.multibody.narrowphase.ellipsoid_distance import (
    block_support_point,
    center_direction,
    ellipsoid_matrix,
    ellipsoid_support_point,
    max_separation_direction,
    nearest_on_block,
    relative_rotation,
)  # fmt: skip
from physics.kernels.multibody.narrowphase.hull_ellipsoid import collide_ellipsoid_hull, collide_sphere_hull
from physics.kernels.multibody.narrowphase.hull_hull import collide_hulls
from physics.kernels.multibody.narrowphase.hull_pose import corner_arm
from physics.kernels.state.layout import BLOCK, ELLIPSOID, HULL, SPHERE, VERTEX_COUNT, WALL_NORMAL, WALL_OFFSET
from physics.kernels.state.sleeping import is_asleep


@kernel
def collide_body_wall(b, wall, margin, h, many):
    """Add the contacts of body b with a wall that are at most `margin` [m] from it."""
    body, R = many.bodies.work[b], row_matrix(many.bodies.rotation, b)
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
                add_contact(b, -1 - wall, vertex, -1, n, point, point, gap, h, many)
    else:
        gap = d - geo.support(body.shape, dims, e)
        point = add_scaled(x, 1.0, geo.support_arm(body.shape, dims, R, n, e))
        add_contact(b, -1 - wall, 0, -1, n, point, point, gap, h, many)


@kernel
def collide_hull_wall(b, wall, margin, h, many):
    """Add the contacts of hull b with a wall: its corners that are at most `margin` [m] from it, by number."""
    n, x, first = (
        row_vector(many.walls, wall, WALL_NORMAL),
        row_vector(many.bodies.center, b, 0),
        many.narrowphase.hulls.of[b, FIRST_CORNER],
    )
    d = qt.dot(n, x) - many.walls[wall, WALL_OFFSET]
    if d > many.bodies.work[b].radius + margin:
        return
    for k in range(many.narrowphase.hulls.of[b, LAST_CORNER] - first):
        r = corner_arm(b, first + k, many)
        gap = d + qt.dot(n, r)
        if gap <= margin:
            point = add_scaled(x, 1.0, r)
            add_contact(b, -1 - wall, k, -1, n, point, point, gap, h, many)


@inlined
def collide_spheres(a, b, margin, h, many):
    """Add the contact of two spheres."""
    x, y = row_vector(many.bodies.center, a, 0), row_vector(many.bodies.center, b, 0)
    ra, rb = many.bodies.work[a].dims[0], many.bodies.work[b].dims[0]
    n = subtract(x, y)
    size = math.sqrt(qt.dot(n, n))
    if size - ra - rb > margin:
        return
    n = (n[0] / size, n[1] / size, n[2] / size) if size > 0.0 else (0.0, 1.0, 0.0)
    add_contact(a, b, 0, -1, n, add_scaled(x, -ra, n), add_scaled(y, rb, n), size - ra - rb, h, many)


@inlined
def collide_sphere_block(a, b, margin, h, many):
    """Add the contact of a sphere and a block, whichever of the two is a."""
    ball, brick = a, b
    if many.bodies.work[a].shape == BLOCK:
        ball, brick = b, a
    R, dims, r = (
        row_matrix(many.bodies.rotation, brick),
        many.bodies.work[brick].dims,
        many.bodies.work[ball].dims[0],
    )
    x, y = row_vector(many.bodies.center, ball, 0), row_vector(many.bodies.center, brick, 0)
    q, n, distance = nearest_on_block(qt.transposed_matvec(R, subtract(x, y)), (dims[0], dims[1], dims[2]))
    if distance - r > margin:
        return
    n = qt.matvec(R, n)
    add_ordered_contact(a, b, ball, n, add_scaled(x, -r, n), add_scaled(y, 1.0, qt.matvec(R, q)), distance - r, h, many)


@kernel
def collide_ellipsoid(a, b, margin, h, many):
    """Add the contact of an ellipsoid and any body, whichever of the two is a; in the frame of the other one."""
    first, second = a, b
    if many.bodies.work[a].shape != ELLIPSOID:
        first, second = b, a
    R, size, d = (
        row_matrix(many.bodies.rotation, second),
        many.bodies.work[second].dims,
        many.bodies.work[first].dims,
    )
    x, dims = row_vector(many.bodies.center, second, 0), (size[0], size[1], size[2])
    way = qt.transposed_matvec(R, subtract(row_vector(many.bodies.center, first, 0), x))
    A = ellipsoid_matrix(relative_rotation(R, row_matrix(many.bodies.rotation, first)), (d[0], d[1], d[2]))
    B = (size[0] * size[0], 0.0, 0.0, size[1] * size[1], 0.0, size[2] * size[2])
    is_block = many.bodies.work[second].shape == BLOCK
    start = nearest_on_block(way, dims)[1] if is_block else center_direction(way)
    n, gap = max_separation_direction(A, is_block, B, dims, way, start)
    if gap > margin:
        return
    on_first = subtract(way, ellipsoid_support_point(A, n)[1])
    on_second = block_support_point(dims, n, on_first) if is_block else ellipsoid_support_point(B, n)[1]
    n, on_first, on_second = (
        qt.matvec(R, n),
        add_scaled(x, 1.0, qt.matvec(R, on_first)),
        add_scaled(x, 1.0, qt.matvec(R, on_second)),
    )
    add_ordered_contact(a, b, first, n, on_first, on_second, gap, h, many)


@shared_kernel
def find_contacts(h, ellipsoids, hulls, world, sleep, many):
    """Write the contact set of the bodies where they are, for a stage of length h.

    `ellipsoids` and `hulls` are None where the scene has none, `sleep` where it does not declare it. What sleeps
    and comes near nothing is left out.
    """
    many.counts[NUM_CONTACTS] = many.counts[NUM_PAIRS] = 0
    bodies = many.bodies.work
    first_row = world * bodies.shape[0]
    if many.settings[0].meet == 1:
        find_pairs(h, many)
    if sleep is not None:
        wake_touched_groups(world, sleep, many)
    for b in range(bodies.shape[0]):
        many.bodies.touched[b] = 0
        if is_asleep(first_row + b, sleep):
            continue
        margin = surface_motion_bound(b, h, many) + bodies[b].slop
        for wall in range(many.walls.shape[0]):
            if not may_reach_wall(b, wall, h, many):
                continue
            if hulls is not None:  # noqa: SIM102 (a branch of its own is what the compiler prunes)
                if bodies[b].shape == HULL:
                    collide_hull_wall(b, wall, margin, h, many)
                    continue
            collide_body_wall(b, wall, margin, h, many)
    for k in range(many.counts[NUM_PAIRS]):
        a, b = many.broadphase.pairs[k, 0], many.broadphase.pairs[k, 1]
        if is_asleep(first_row + a, sleep):
            continue  # and so does b: `wake_touched_groups`
        if not may_meet(a, b, h, many):
            continue
        margin = surface_motion_bound(a, h, many) + surface_motion_bound(b, h, many) + pair_slop(a, b, many)
        first, second = bodies[a].shape, bodies[b].shape
        if hulls is not None:
            if ellipsoids is not None:  # noqa: SIM102 (as above)
                if (first == HULL and second == ELLIPSOID) or (first == ELLIPSOID and second == HULL):
                    collide_ellipsoid_hull(a, b, margin, h, many)
                    continue
            if first == HULL or second == HULL:
                if first == SPHERE or second == SPHERE:
                    collide_sphere_hull(a, b, margin, h, many)
                else:
                    collide_hulls(a, b, margin, h, many)
                continue
        if ellipsoids is not None:  # noqa: SIM102 (as above)
            if first == ELLIPSOID or second == ELLIPSOID:
                collide_ellipsoid(a, b, margin, h, many)
                continue
        if first == BLOCK and second == BLOCK:
            collide_blocks(a, b, margin, h, many)
        elif first == SPHERE and second == SPHERE:
            collide_spheres(a, b, margin, h, many)
        else:
            collide_sphere_block(a, b, margin, h, many)
