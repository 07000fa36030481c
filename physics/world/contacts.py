"""Contacts of a batch of worlds in the last step, read from the contact memory of its scheme."""

from __future__ import annotations

import numpy as np

from physics.schemes.contacts import EVERY_BODY, ROWS_PER_BODY, Contacts, Strongest, no_contacts
from physics.world.batch import Batch


def contact_rows(world: Batch) -> int:
    """Default number of rows for a world's contacts: `ROWS_PER_BODY` for each body, limited by the contact memory."""
    if not world.plan.contact:
        return 0
    return min(world.plan.scheme.memory.room(world), ROWS_PER_BODY * world.body_count)


def read_contacts(world: Batch, indices: np.ndarray, rows: int, body: int = EVERY_BODY) -> Contacts:
    """Read the contacts of the last physics step.

    Parameters
    ----------
    world : Batch
        Batch of worlds.
    indices : (n,) int64
        Indices of the worlds to read.
    rows : int
        Rows for each world; a world with more contacts shows the strongest.
    body : int
        Index of a body: only its contacts are read, with it as the first body. `EVERY_BODY`: all contacts.

    Returns
    -------
    Contacts
        Contacts in new arrays.
    """
    out = no_contacts(len(indices), rows)
    if not world.plan.contact:
        return out
    strongest = Strongest(np.empty(rows, np.int64), np.empty(rows))
    world.plan.scheme.memory.read(world, np.ascontiguousarray(indices, np.int64), int(body), strongest, out)
    return out


def contacts_of_world(world: Batch, index: int) -> Contacts:
    """Read all contacts of the world `index`: `Contacts` of n = 1 world, with a row for each contact."""
    count = world.plan.scheme.memory.count(world, index) if world.plan.contact else 0
    return read_contacts(world, np.array([index]), count)


def write_contact_forces(world: Batch, indices: np.ndarray, out: np.ndarray) -> None:
    """Write the sum of the contact forces on each body in the last step [N], world frame, into `out` (n, bodies, 3).

    The n worlds are `indices`.
    """
    out[...] = 0.0
    if world.plan.contact:
        world.plan.scheme.memory.add_forces(world, indices, out)


def write_contact_impulses(world: Batch, indices: np.ndarray, forces: np.ndarray, out: np.ndarray) -> None:
    """Write the sum of the contact impulses on each body [N s], world frame, into `out` (n, bodies, 3).

    They are the contact `forces` (n, bodies, 3) [N] times the durations of the stages in which these acted. The n
    worlds are `indices`.
    """
    out[...] = forces
    if world.plan.contact:
        out *= world.plan.scheme.memory.durations(world, indices)
