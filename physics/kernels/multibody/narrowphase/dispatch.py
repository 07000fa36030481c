"""Narrow phase: find the contacts of every body with every wall, and of every near pair; of compounds, of all parts."""

from __future__ import annotations

from physics.compiler.decorators import if_given, kernel, shared_kernel
from physics.kernels.math import quaternion as qt
from physics.kernels.math.vector import row_vector
from physics.kernels.multibody.broadphase.sweep_and_prune import (
    find_pairs,
    may_meet,
    may_reach_wall,
    surface_motion_bound,
)
from physics.kernels.multibody.data.arrays import NUM_CONTACTS, NUM_PAIRS, NUM_STOPPING
from physics.kernels.multibody.data.contact_set import pair_slop, subtract
from physics.kernels.multibody.data.parts import is_compound
from physics.kernels.multibody.data.sleeping import wake_touched_groups
from physics.kernels.multibody.narrowphase.body_wall import collide_body_wall, collide_hull_wall
from physics.kernels.multibody.narrowphase.box_box import collide_blocks
from physics.kernels.multibody.narrowphase.capsule import collide_capsule
from physics.kernels.multibody.narrowphase.capsule_contacts import collide_capsule_wall
from physics.kernels.multibody.narrowphase.covered_points import leave_out_covered
from physics.kernels.multibody.narrowphase.cylinder import collide_cylinder
from physics.kernels.multibody.narrowphase.cylinder_wall import collide_cylinder_wall
from physics.kernels.multibody.narrowphase.ellipsoid_distance import collide_ellipsoid
from physics.kernels.multibody.narrowphase.hull_ellipsoid import collide_ellipsoid_hull, collide_sphere_hull
from physics.kernels.multibody.narrowphase.hull_hull import collide_hulls
from physics.kernels.multibody.narrowphase.sphere_contacts import collide_sphere_block, collide_spheres
from physics.kernels.state.fixed_body import is_fixed
from physics.kernels.state.layout import BLOCK, ELLIPSOID, HULL, SPHERE
from physics.kernels.state.sleeping import is_asleep


@kernel
def _collide_with_wall(b, wall, margin, h, hulls, many):
    """Add the contacts of a body or part b with a wall whose gaps are at most `margin` [m]."""
    if hulls is not None:  # noqa: SIM102 (a branch of its own is what the compiler prunes)
        if many.bodies.body[b].shape == HULL:
            collide_hull_wall(b, wall, margin, h, many)
            return
    if not (collide_capsule_wall(b, wall, margin, h, many) or collide_cylinder_wall(b, wall, margin, h, many)):
        collide_body_wall(b, wall, margin, h, many)


@kernel
def _collide(a, b, margin, h, ellipsoids, hulls, many):
    """Add the contacts of two bodies or parts whose gaps are at most `margin` [m]."""
    if collide_cylinder(a, b, margin, h, ellipsoids, many) or collide_capsule(a, b, margin, h, ellipsoids, many):
        return
    first, second = many.bodies.body[a].shape, many.bodies.body[b].shape
    if hulls is not None:
        if ellipsoids is not None:  # noqa: SIM102 (a branch of its own is what the compiler prunes)
            if (first == HULL and second == ELLIPSOID) or (first == ELLIPSOID and second == HULL):
                collide_ellipsoid_hull(a, b, margin, h, many)
                return
        if first == HULL or second == HULL:
            if first == SPHERE or second == SPHERE:
                collide_sphere_hull(a, b, margin, h, many)
            else:
                collide_hulls(a, b, margin, h, many)
            return
    if ellipsoids is not None:  # noqa: SIM102 (as above)
        if first == ELLIPSOID or second == ELLIPSOID:
            collide_ellipsoid(a, b, margin, h, many)
            return
    if first == BLOCK and second == BLOCK:
        collide_blocks(a, b, margin, h, many)
    elif first == SPHERE and second == SPHERE:
        collide_spheres(a, b, margin, h, many)
    else:
        collide_sphere_block(a, b, margin, h, many)


@if_given("many.bodies.parts", False)
def _collide_parts_with_wall(b, wall, margin, h, hulls, many):
    """Add the contacts of body b with a wall, if b is a compound; return whether it is one."""
    if not is_compound(b, many):
        return False
    for part in range(many.bodies.parts.span[b, 0], many.bodies.parts.span[b, 1]):
        _collide_with_wall(part, wall, margin, h, hulls, many)
    return True


@kernel
def _are_near(a, b, margin, many):
    """True if the gap of the bounding spheres of parts a and b is at most `margin` [m]."""
    d = subtract(row_vector(many.bodies.center, a, 0), row_vector(many.bodies.center, b, 0))
    far = many.bodies.body[a].radius + many.bodies.body[b].radius + margin
    return not qt.dot(d, d) > far * far


@if_given("many.bodies.parts", False)
def _collide_parts(a, b, margin, h, ellipsoids, hulls, many):
    """Add the contacts of bodies a and b, if one of them is a compound; return whether one is."""
    if not (is_compound(a, many) or is_compound(b, many)):
        return False
    span, first = many.bodies.parts.span, many.counts[NUM_CONTACTS]
    for part in range(span[a, 0], span[a, 1]):
        for other in range(span[b, 0], span[b, 1]):
            if _are_near(part, other, margin, many):
                _collide(part, other, margin, h, ellipsoids, hulls, many)
    leave_out_covered(first, h, many)
    return True


@shared_kernel
def find_contacts(h, ellipsoids, hulls, world, sleep, many):
    """Find all contacts of a world in its bodies' present state, for a stage of length h [s].

    Writes the contact set `many.contacts` and the numbers of contacts and near pairs in `many.counts`. `ellipsoids` and
    `hulls` are None if the scene has none; `sleep` is None if it declares no sleep. Sleeping bodies that nothing
    approaches are left out. `world` is the index of the world.
    """
    many.counts[NUM_CONTACTS] = many.counts[NUM_PAIRS] = many.counts[NUM_STOPPING] = 0
    bodies, count = many.bodies.body, many.bodies.state.shape[0]
    first_row = world * count
    if many.settings[0].meet > 0:
        find_pairs(h, many)
    if sleep is not None:
        wake_touched_groups(world, sleep, many)
    for b in range(count):
        many.bodies.touched[b] = 0
        if is_asleep(first_row + b, sleep) or is_fixed(b, many.bodies):
            continue
        margin = surface_motion_bound(b, h, many) + bodies[b].slop
        for wall in range(many.walls.shape[0]):
            if not may_reach_wall(b, wall, h, many):
                continue
            if not _collide_parts_with_wall(b, wall, margin, h, hulls, many):
                _collide_with_wall(b, wall, margin, h, hulls, many)
    for k in range(many.counts[NUM_PAIRS]):
        a, b = many.broadphase.pairs[k, 0], many.broadphase.pairs[k, 1]
        if is_asleep(first_row + a, sleep) or (is_fixed(a, many.bodies) and is_asleep(first_row + b, sleep)):
            continue  # b sleeps, too, or is fixed: `wake_touched_groups` has woken all that a waking body may touch
        if not may_meet(a, b, h, many):
            continue
        margin = surface_motion_bound(a, h, many) + surface_motion_bound(b, h, many) + pair_slop(a, b, many)
        if not _collide_parts(a, b, margin, h, ellipsoids, hulls, many):
            _collide(a, b, margin, h, ellipsoids, hulls, many)
