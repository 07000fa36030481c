"""Contacts of a batch of worlds, read through the contact memory of its scheme."""

from __future__ import annotations

import numpy as np

from physics.schemes.contacts import EVERY_BODY, ROWS_PER_BODY, Contacts, Strongest, no_contacts
from physics.world.batch import Batch


def contact_rows(world: Batch) -> int:
    """Rows that hold the contacts of a world: `ROWS_PER_BODY` for each body, at most as many as there is room for."""
    if not world.plan.contact:
        return 0
    return min(world.plan.scheme.memory.room(world), ROWS_PER_BODY * world.body_count)


def read_contacts(world: Batch, indices: np.ndarray, rows: int, body: int = EVERY_BODY) -> Contacts:
    """Read the contacts of the last physics step.

    Parameters
    ----------
    world : Batch
    indices : (n,) int64
        Of worlds.
    rows : int
        Contacts that are shown of each.
    body : int
        Contacts of this body only, with it as the first body.

    Returns
    -------
    Contacts
        New arrays.
    """
    out = no_contacts(len(indices), rows)
    if not world.plan.contact:
        return out
    strongest = Strongest(np.empty(rows, np.int64), np.empty(rows))
    world.plan.scheme.memory.read(world, np.ascontiguousarray(indices, np.int64), int(body), strongest, out)
    return out


def contacts_of_world(world: Batch, index: int) -> Contacts:
    """Read all contacts of one world: `Contacts` of n = 1 with as many rows as there are."""
    count = world.plan.scheme.memory.count(world, index) if world.plan.contact else 0
    return read_contacts(world, np.array([index]), count)


def write_contact_forces(world: Batch, indices: np.ndarray, out: np.ndarray) -> None:
    """Sums of the contact forces on bodies in the last step [N], world frame, into `out` (n, bodies, 3)."""
    out[...] = 0.0
    if world.plan.contact:
        world.plan.scheme.memory.add_forces(world, indices, out)


def write_contact_impulses(world: Batch, indices: np.ndarray, forces: np.ndarray, out: np.ndarray) -> None:
    """Sums of the contact impulses on bodies [N s] into `out` (n, bodies, 3), from those of the forces."""
    out[...] = forces
    if world.plan.contact:
        out *= world.plan.scheme.memory.durations(world, indices)
