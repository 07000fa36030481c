"""Contacts of many worlds, as arrays with a fixed number of rows for each world; all schemes fill the same arrays."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from physics.compiler.decorators import kernel
from physics.html_table import parts_table
from physics.summary import parts_repr

ROWS_PER_BODY = 12
"""Default number of contact rows for each body: a block in a corner touches three walls with four vertices each."""

EVERY_BODY = -1
"""Value of an argument `body` that means the contacts of all bodies."""


class Contacts(NamedTuple):
    """Contacts of n worlds in the last physics step, in the order of `physics.World.contacts`.

    A world with more contacts than rows shows the contacts with the largest forces; of equal forces, the first. Rows
    are in the order in which the scheme keeps contacts: by body, where bodies meet walls only. Rows without a contact
    are zero.

    Force and impulse are those that the contact solver found for the last resting stage. This stage is the whole
    physics step if the accuracy has one substep and nothing collides in the step. Otherwise it is the end of the step:
    the last substep, or the part of it after the last collision. Impulses of impacts are left out:
    `physics.World.read_impacts` has them. An approach so slow that a resting stage stops it counts as resting.

    Event-driven accuracies have no stages where bodies meet walls only. The force is then the last one that was
    computed in the step, and the impulse is this force times the length of the physics step.

    A body that sleeps keeps the contacts with which it fell asleep. Between a reset and the first step there are none.

    Attributes
    ----------
    count : (n,) int64
        Number of contacts; it exceeds the number of rows where some contacts have no row.
    point : (n, rows, 3) float64
        Contact point, world frame [m].
    force : (n, rows, 3) float64
        Mean force on the first body over the stage, world frame [N].
    impulse : (n, rows, 3) float64
        Impulse on the first body in the stage, the force times the length of the stage, world frame [N s].
    ends : (n, rows, 2) int64
        Index of the first body; index of the other body, or -1 - k for wall k.
    """

    count: np.ndarray
    point: np.ndarray
    force: np.ndarray
    impulse: np.ndarray
    ends: np.ndarray

    __repr__ = parts_repr
    _repr_html_ = parts_table

    def _parts(self) -> tuple[str, ...]:
        return f"worlds={len(self.count)}", f"rows={self.ends.shape[1]}", f"contacts={self.count.sum()}"


class Strongest(NamedTuple):
    """Workspace with the strongest contacts of one world, which get rows, in the order of the contact memory."""

    place: np.ndarray  # (rows,) int, index of the contact in its memory
    size: np.ndarray  # (rows,) square of the contact's force [N²], or of an impulse


def no_contacts(worlds: int, rows: int) -> Contacts:
    """Make `Contacts` of zeros for `worlds` worlds, with `rows` rows for each."""
    vectors = worlds, rows, 3
    return Contacts(
        np.zeros(worlds, np.int64), np.zeros(vectors), np.zeros(vectors), np.zeros(vectors),
        np.zeros((worlds, rows, 2), np.int64),
    )  # fmt: skip


@kernel
def keep_strongest(kept, place, size, strongest):
    """Append the contact `place` of strength `size` to the `kept` contacts in `strongest`; return their new number.

    If `strongest` is full the weakest contact is dropped, which may be the new one.
    """
    rows = strongest.size.shape[0]
    if rows == 0:
        return 0
    if kept == rows:
        weakest = 0
        for k in range(1, rows):
            if strongest.size[k] <= strongest.size[weakest]:
                weakest = k
        if not size > strongest.size[weakest]:
            return kept
        for k in range(weakest, rows - 1):
            strongest.place[k], strongest.size[k] = strongest.place[k + 1], strongest.size[k + 1]
        kept -= 1
    strongest.place[kept], strongest.size[kept] = place, size
    return kept + 1


@kernel
def put_force_and_impulse(n, row, impulse, length, duration, out):
    """Write force and impulse of a contact into row `row` of world `n` of `out`, a `Contacts`.

    The force is `impulse` / `length`, the impulse is `impulse` * `duration`.
    """
    for c in range(3):
        out.force[n, row, c] = impulse[c] / length
        out.impulse[n, row, c] = impulse[c] * duration
