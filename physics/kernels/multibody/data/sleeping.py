"""Sleep in worlds whose bodies touch each other: touching bodies fall asleep and wake together.

A group consists of bodies that pairs of the broad phase (overlapping swept boxes) or springs connect. All bodies in
contact belong to one group, so that a sleeping group has no contact with an awake body. The broad phase finds a body
that comes near, and the group wakes before contacts are searched.

`world` is the index of the world, `count` the number of its bodies, `sleep` the `state.sleeping.Sleep` of all worlds.
"""

from __future__ import annotations

from physics.compiler.decorators import inlined, kernel
from physics.kernels.forces.two_body_spring import unite_linked_bodies
from physics.kernels.math.union_find import find_root, unite_sets
from physics.kernels.multibody.data.arrays import NUM_PAIRS
from physics.kernels.multibody.data.equilibrium import keep_unbalanced_awake
from physics.kernels.multibody.data.parts import acting_bodies
from physics.kernels.state.body import read_state, write_state
from physics.kernels.state.fixed_body import is_fixed
from physics.kernels.state.sleeping import (
    EARLIER_DISPLACEMENT,
    LAST_DISPLACEMENT,
    QUIET_WINDOWS,
    SLEEP_GROUP,
    WINDOWS_BEFORE_SLEEP,
    has_new_wrench,
    is_asleep,
    is_motion_growing,
    update_sleep_window,
    wake_body,
    without_velocities,
)


@inlined
def wake_group(world, count, group, sleep):
    """Wake all bodies of a group in a world of `count` bodies.

    `group` is the number of the group, stored in `sleep.rows[:, SLEEP_GROUP]` for each of its bodies.
    """
    for i in range(world * count, (world + 1) * count):
        if sleep.rows[i, SLEEP_GROUP] == group:
            wake_body(i, sleep)


@inlined
def wake_world(world, count, sleep):
    """Wake all `count` bodies of a world; does nothing if the scene declares no sleep (`sleep` is None)."""
    if sleep is None:
        return
    for i in range(world * count, (world + 1) * count):
        wake_body(i, sleep)


@inlined
def is_world_asleep(world, sleep, many):
    """True if every body of a world that is not fixed sleeps."""
    first = world * many.bodies.state.shape[0]
    for b in range(many.bodies.state.shape[0]):
        if not (is_fixed(b, many.bodies) or is_asleep(first + b, sleep)):
            return False
    return True


@inlined
def is_staying_asleep(world, wrench, sleep, many):
    """True if every body of a world sleeps and none has a new wrench; fixed bodies do not count.

    `wrench` (rows, 6) holds the wrenches on the bodies of all worlds. A body whose wrench has changed wakes with its
    group.
    """
    count = many.bodies.state.shape[0]
    for b in range(count):
        i = world * count + b
        if is_fixed(b, many.bodies):
            continue
        if has_new_wrench(i, wrench, sleep):
            if is_asleep(i, sleep):
                wake_group(world, count, sleep.rows[i, SLEEP_GROUP], sleep)
            wake_body(i, sleep)
    return is_world_asleep(world, sleep, many)


@inlined
def _has_fixed_body(k, many):
    """True if near pair k has a fixed body; fixed bodies join no group, and wake no other body."""
    return is_fixed(many.broadphase.pairs[k, 0], many.bodies) or is_fixed(many.broadphase.pairs[k, 1], many.bodies)


@kernel
def wake_touched_groups(world, sleep, many):
    """Wake every sleeping group of a world that forms a near pair with an awake body.

    A group that wakes may wake others, so that this repeats until no near pair has one sleeping and one awake body.
    """
    first, is_waking = world * many.bodies.state.shape[0], True
    while is_waking:
        is_waking = False
        for k in range(many.counts[NUM_PAIRS]):
            if _has_fixed_body(k, many):
                continue
            a, b = first + many.broadphase.pairs[k, 0], first + many.broadphase.pairs[k, 1]
            if is_asleep(a, sleep) != is_asleep(b, sleep):
                group = max(sleep.rows[a, SLEEP_GROUP], sleep.rows[b, SLEEP_GROUP])
                wake_group(world, many.bodies.state.shape[0], group, sleep)
                is_waking = True


@inlined
def _union_near_pairs(many):
    """Join bodies that near pairs or springs connect into groups, as a union-find forest in `many.islands.parent`."""
    for b in range(many.islands.parent.shape[0]):
        many.islands.parent[b] = b
    for k in range(many.counts[NUM_PAIRS]):
        if not _has_fixed_body(k, many):
            unite_sets(many.broadphase.pairs[k, 0], many.broadphase.pairs[k, 1], many.islands.parent)
    unite_linked_bodies(many.islands.parent, acting_bodies(many))


@kernel
def put_quiet_groups_to_sleep(world, sleep, many):
    """Put each group of a world to sleep if all its bodies are quiet and its motion does not grow.

    A body is quiet after `WINDOWS_BEFORE_SLEEP` quiet windows in a row. `many.islands.group_motion` gathers, at the
    root of each group in the union-find forest, the largest displacements of its bodies in the last two windows. A flag
    there says whether a body of the group is not quiet.
    """
    count, found = many.bodies.state.shape[0], many.islands.group_motion
    first = world * count
    _union_near_pairs(many)
    for b in range(count):
        found[b, 0] = found[b, 1] = found[b, 2] = 0.0
    for b in range(count):
        if is_fixed(b, many.bodies):
            continue
        root, i = find_root(b, many.islands.parent), first + b
        found[root, 0] = max(found[root, 0], sleep.rows[i, LAST_DISPLACEMENT])
        found[root, 1] = max(found[root, 1], sleep.rows[i, EARLIER_DISPLACEMENT])
        if sleep.rows[i, QUIET_WINDOWS] < WINDOWS_BEFORE_SLEEP:
            found[root, 2] = 1.0
    for b in range(count):
        root = find_root(b, many.islands.parent)
        if is_asleep(first + b, sleep) or is_fixed(b, many.bodies):
            continue
        if found[root, 2] == 1.0 or is_motion_growing(found[root, 0], found[root, 1]):
            continue
        sleep.rows[first + b, SLEEP_GROUP] = root + 1.0
        write_state(many.bodies.state, b, without_velocities(read_state(many.bodies.state, b)))


@kernel
def update_sleep(world, h, kept, sleep, memory, many):
    """Update the sleep windows of all awake bodies of a world after a substep of h [s]; put quiet groups to sleep.

    `kept` is None without error control (`equilibrium`). `memory` has the contacts of the last stage.
    """
    first, is_time = world * many.bodies.state.shape[0], False
    for b in range(many.bodies.state.shape[0]):
        if is_fixed(b, many.bodies):
            continue
        if not is_asleep(first + b, sleep) and update_sleep_window(
            first + b, read_state(many.bodies.state, b), h, many.bodies.body[b], sleep
        ):
            is_time = True
    if is_time:
        keep_unbalanced_awake(world, h, kept, sleep, memory, many)
        put_quiet_groups_to_sleep(world, sleep, many)
