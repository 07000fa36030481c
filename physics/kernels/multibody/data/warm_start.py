"""Warm start of a world's contacts: impulses of the last stage, from which the next solve starts.

Contacts are found again by their ids. Impulses are stored in the world frame, so that the force stays the same if a
contact's frame has turned. `memory` (worlds, columns) has the layout of `arrays.WARM_CONTACT_ID` and its neighbours.
The table is `many.contacts.id_table`, a hash table with open addressing from ids to stored contacts.
"""

from __future__ import annotations

from physics.compiler.decorators import inlined, kernel
from physics.kernels.math import quaternion as qt
from physics.kernels.math.vector import row_vector
from physics.kernels.multibody.data.arrays import (
    WARM_BODY_A,
    WARM_BODY_B,
    WARM_CONTACT_COUNT,
    WARM_CONTACT_ID,
    WARM_CONTACT_SIZE,
    WARM_HEADER_SIZE,
    WARM_IMPULSE,
    WARM_POINT,
    WARM_STAGE_LENGTH,
)
from physics.kernels.multibody.data.clipped_points import copy_follow
from physics.kernels.multibody.data.contact_set import add_scaled, put_vector, row_matrix
from physics.kernels.multibody.data.driven_bodies import copy_driven_velocity
from physics.kernels.multibody.data.fixed_bodies import shown_end
from physics.kernels.multibody.data.grain import less_stretch
from physics.kernels.multibody.data.parts import copy_parts
from physics.kernels.multibody.data.warm_depths import move_warm_depth, store_warm_depth
from physics.kernels.multibody.data.warm_torques import load_warm_torque, move_warm_torque, store_warm_torque
from physics.kernels.state.sleeping import is_asleep


@inlined
def _contact_column(k):
    """First column of stored contact k in a row of `memory`."""
    return WARM_HEADER_SIZE + WARM_CONTACT_SIZE * k


@inlined
def _hash_slot(contact_id, table):
    """Slot of the hash table `table` at which the search for an id begins (Knuth's multiplicative method)."""
    return ((contact_id * 2654435761) >> 16) & (table.shape[0] - 1)


@inlined
def _find_remembered(contact_id, world, memory, table):
    """Index of the contact with this id among the stored contacts of a world; -1: none.

    It is looked up in the hash table `table`.
    """
    at = _hash_slot(contact_id, table)
    while table[at] >= 0:
        if memory[world, _contact_column(table[at]) + WARM_CONTACT_ID] == contact_id:
            return table[at]
        at = (at + 1) & (table.shape[0] - 1)
    return -1


@inlined
def _index_ids(world, memory, table):
    """Enter the contacts of a world that are stored in `memory` into the empty hash table `table`."""
    for k in range(int(memory[world, WARM_CONTACT_COUNT])):
        at = _hash_slot(int(memory[world, _contact_column(k) + WARM_CONTACT_ID]), table)
        while table[at] >= 0:
            at = (at + 1) & (table.shape[0] - 1)
        table[at] = k


@inlined
def _clear_ids(world, memory, table):
    """Empty the hash table `table` again, by removing the contacts of a world that are stored in `memory`.

    This is faster than to clear every slot, since most slots are free.
    """
    for k in range(int(memory[world, WARM_CONTACT_COUNT])):
        at = _hash_slot(int(memory[world, _contact_column(k) + WARM_CONTACT_ID]), table)
        while table[at] >= 0:
            table[at] = -1
            at = (at + 1) & (table.shape[0] - 1)


@kernel
def load_warm_impulses(n, world, h, friction, memory, many):
    """Write the warm start: impulses of the n contacts of the set, from those stored in `memory` at the last stage.

    Impulses are scaled from the last stage's length to h [s], the length of this one. A contact that was not stored
    starts from zero. Without friction (`friction` is None) only normal impulses are taken. `world` is the index of the
    world.
    """
    length, table = memory[world, WARM_STAGE_LENGTH], many.contacts.id_table
    scale = h / length if length > 0.0 else 0.0
    _index_ids(world, memory, table)
    for k in range(n):
        p = (0.0, 0.0, 0.0)
        found = _find_remembered(many.contacts.id[k], world, memory, table)
        if found >= 0:
            p = row_vector(memory, world, _contact_column(found) + WARM_IMPULSE)
            x, y, z = less_stretch(k, qt.matvec(row_matrix(many.contacts.frame, k), p), many)
            p = (scale * max(x, 0.0), 0.0, 0.0)
            if friction is not None:
                p = (p[0], scale * y, scale * z)
        put_vector(many.contacts.impulse, k, 0, p)
        load_warm_torque(k, found, scale, world, memory, many)
    _clear_ids(world, memory, table)


@inlined
def _keep_sleeping(world, h, sleep, memory, many):
    """Move the stored contacts of sleeping bodies to the front of a world's row of `memory`; return their number.

    Their impulses are scaled to a stage of length h [s]. All other stored contacts are lost.
    """
    if sleep is None:
        return 0
    first, count, length = world * many.bodies.state.shape[0], 0, memory[world, WARM_STAGE_LENGTH]
    for k in range(int(memory[world, WARM_CONTACT_COUNT])):
        row, to = _contact_column(k), _contact_column(count)
        if is_asleep(first + int(memory[world, row + WARM_BODY_A]), sleep):
            for c in range(WARM_CONTACT_SIZE):
                memory[world, to + c] = memory[world, row + c]
            for c in range(3):
                memory[world, to + WARM_IMPULSE + c] *= h / length
            move_warm_torque(k, count, h / length, world, memory, many)
            move_warm_depth(k, count, world, memory, many)
            count += 1
    return count


@kernel
def store_warm_impulses(n, world, h, sleep, memory, many):
    """Store the impulses of the n contacts in `memory` after a stage of length h [s], as the next warm start.

    Stored contacts of sleeping bodies come first and stay; contacts beyond the room in `memory` are left out.
    """
    before = _keep_sleeping(world, h, sleep, memory, many)
    n = min(n, many.contacts.gap.shape[0] - before)
    memory[world, WARM_STAGE_LENGTH], memory[world, WARM_CONTACT_COUNT] = h, before + n
    for k in range(n):
        row, a = _contact_column(before + k), many.contacts.bodies[k, 0]
        memory[world, row + WARM_CONTACT_ID] = many.contacts.id[k]
        memory[world, row + WARM_BODY_A], memory[world, row + WARM_BODY_B] = (
            many.contacts.bodies[k, 0],
            shown_end(many.contacts.bodies[k, 1], many),
        )
        p = qt.transposed_matvec(row_matrix(many.contacts.frame, k), row_vector(many.contacts.impulse, k, 0))
        put_vector(memory, world, row + WARM_IMPULSE, p)
        store_warm_torque(k, before + k, world, memory, many)
        store_warm_depth(k, before + k, world, memory, many)
        put_vector(
            memory,
            world,
            row + WARM_POINT,
            add_scaled(row_vector(many.bodies.state, a, 0), 1.0, row_vector(many.contacts.arm, k, 0)),
        )


@inlined
def clear_warm_start(world, memory):
    """Forget all stored contacts of a world, as after a user has moved its bodies."""
    memory[world, WARM_STAGE_LENGTH] = memory[world, WARM_CONTACT_COUNT] = 0.0


@inlined
def clear_awake_warm_start(world, h, sleep, memory, many):
    """Forget all stored contacts of a world except those of sleeping bodies, after a stage of length h [s]."""
    if sleep is None:
        memory[world, WARM_STAGE_LENGTH], memory[world, WARM_CONTACT_COUNT] = h, 0.0
    else:
        store_warm_impulses(0, world, h, sleep, memory, many)


@inlined
def copy_contact(k, to, many):
    """Copy row k of the contact set to row `to`, except columns that later parts of a stage fill."""
    many.contacts.id[to], many.contacts.owner[to], many.contacts.gap[to], many.contacts.speed[to] = (
        many.contacts.id[k],
        many.contacts.owner[k],
        many.contacts.gap[k],
        many.contacts.speed[k],
    )
    many.contacts.mu[to], many.contacts.restitution[to] = many.contacts.mu[k], many.contacts.restitution[k]
    copy_driven_velocity(k, to, many)
    copy_follow(k, to, many)
    copy_parts(k, to, many)
    for c in range(2):
        many.contacts.bodies[to, c] = many.contacts.bodies[k, c]
    for c in range(3):
        many.contacts.normal[to, c], many.contacts.target[to, c], many.contacts.impulse[to, c] = (
            many.contacts.normal[k, c], many.contacts.target[k, c], many.contacts.impulse[k, c],
        )  # fmt: skip
    for c in range(6):
        many.contacts.anchor[to, c], many.contacts.arm[to, c] = many.contacts.anchor[k, c], many.contacts.arm[k, c]
    for c in range(9):
        many.contacts.frame[to, c] = many.contacts.frame[k, c]
