"""Narrow phase: find the contacts of every body with every wall, and of every near pair."""

from __future__ import annotations

from physics.compiler.decorators import shared_kernel
from physics.kernels.multibody.broadphase.sweep_and_prune import (
    find_pairs,
    may_meet,
    may_reach_wall,
    surface_motion_bound,
)
from physics.kernels.multibody.data.arrays import NUM_CONTACTS, NUM_PAIRS, NUM_STOPPING
from physics.kernels.multibody.data.contact_set import pair_slop
from physics.kernels.multibody.data.sleeping import wake_touched_groups
from physics.kernels.multibody.narrowphase.body_wall import collide_body_wall, collide_hull_wall
from physics.kernels.multibody.narrowphase.box_box import collide_blocks
from physics.kernels.multibody.narrowphase.capsule import collide_capsule
from physics.kernels.multibody.narrowphase.capsule_contacts import collide_capsule_wall
from physics.kernels.multibody.narrowphase.ellipsoid_distance import collide_ellipsoid
from physics.kernels.multibody.narrowphase.hull_ellipsoid import collide_ellipsoid_hull, collide_sphere_hull
from physics.kernels.multibody.narrowphase.hull_hull import collide_hulls
from physics.kernels.multibody.narrowphase.sphere_contacts import collide_sphere_block, collide_spheres
from physics.kernels.state.fixed_body import is_fixed
from physics.kernels.state.layout import BLOCK, ELLIPSOID, HULL, SPHERE
from physics.kernels.state.sleeping import is_asleep


@shared_kernel
def find_contacts(h, ellipsoids, hulls, world, sleep, many):
    """Find all contacts of a world in its bodies' present state, for a stage of length h [s].

    Writes the contact set `many.contacts` and the numbers of contacts and near pairs in `many.counts`. `ellipsoids` and
    `hulls` are None if the scene has none; `sleep` is None if it declares no sleep. Sleeping bodies that nothing
    approaches are left out. `world` is the index of the world.
    """
    many.counts[NUM_CONTACTS] = many.counts[NUM_PAIRS] = many.counts[NUM_STOPPING] = 0
    bodies = many.bodies.body
    first_row = world * bodies.shape[0]
    if many.settings[0].meet > 0:
        find_pairs(h, many)
    if sleep is not None:
        wake_touched_groups(world, sleep, many)
    for b in range(bodies.shape[0]):
        many.bodies.touched[b] = 0
        if is_asleep(first_row + b, sleep) or is_fixed(b, many.bodies):
            continue
        margin = surface_motion_bound(b, h, many) + bodies[b].slop
        for wall in range(many.walls.shape[0]):
            if not may_reach_wall(b, wall, h, many):
                continue
            if hulls is not None:  # noqa: SIM102 (a branch of its own is what the compiler prunes)
                if bodies[b].shape == HULL:
                    collide_hull_wall(b, wall, margin, h, many)
                    continue
            if not collide_capsule_wall(b, wall, margin, h, many):
                collide_body_wall(b, wall, margin, h, many)
    for k in range(many.counts[NUM_PAIRS]):
        a, b = many.broadphase.pairs[k, 0], many.broadphase.pairs[k, 1]
        if is_asleep(first_row + a, sleep) or (is_fixed(a, many.bodies) and is_asleep(first_row + b, sleep)):
            continue  # b sleeps, too, or is fixed: `wake_touched_groups` has woken all that a waking body may touch
        if not may_meet(a, b, h, many):
            continue
        margin = surface_motion_bound(a, h, many) + surface_motion_bound(b, h, many) + pair_slop(a, b, many)
        if collide_capsule(a, b, margin, h, ellipsoids, many):
            continue
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
