"""Contacts of many worlds as arrays with a fixed number of rows for each world: what every scheme's reader fills."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from physics.compiler.decorators import kernel
from physics.html_table import parts_table
from physics.summary import parts_repr

ROWS_PER_BODY = 12
"""Rows that contacts are shown in, for each body: a block in a corner touches three walls with four vertices each."""

EVERY_BODY = -1
"""In place of a body: the contacts of all of them."""


class Contacts(NamedTuple):
    """Contacts of n worlds in the last physics step, in the order of `physics.World.contacts`.

    A world with more contacts than there are rows shows those with the largest forces; of equal forces, the first.
    Rows are in the order in which the scheme keeps contacts: by body, where bodies meet walls only. Rows without a
    contact are zero.

    Force and impulse are those of the last resting stage, as the contact solver worked them out. A stage is the whole
    physics step where the accuracy has one substep and nothing collides in the step. Otherwise it is the end of the
    step: the last substep, or what is left of it after the last collision. Impulses of impacts are not among them:
    `physics.World.read_impacts` tells those. A meeting so slow that a resting stage stops it is part of that stage.

    Event-driven accuracies have no stages where bodies meet walls only. The force is then the last one that was worked
    out in the step, and the impulse is this force times the physics step.

    A body that sleeps keeps the contacts with which it fell asleep. Between a reset and the first step there are none.

    Attributes
    ----------
    count : (n,) int64
        Contacts that there are; more than the rows, where some are left out.
    point : (n, rows, 3) float64
        World frame [m].
    force : (n, rows, 3) float64
        Mean over the stage, on the first body, world frame [N].
    impulse : (n, rows, 3) float64
        Of the stage, on the first body: the force times the length of the stage, world frame [N s].
    ends : (n, rows, 2) int64
        First body; other body, or -1 - k for wall k.
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
    """Contacts of one world that are to be shown, in their order."""

    place: np.ndarray  # (rows,) int, place of the contact in its memory
    size: np.ndarray  # (rows,) square of its force [N²]


def no_contacts(worlds: int, rows: int) -> Contacts:
    """Arrays of `Contacts` for so many worlds and rows, all zero."""
    vectors = worlds, rows, 3
    return Contacts(
        np.zeros(worlds, np.int64), np.zeros(vectors), np.zeros(vectors), np.zeros(vectors),
        np.zeros((worlds, rows, 2), np.int64),
    )  # fmt: skip


@kernel
def keep_strongest(kept, place, size, strongest):
    """Append a contact to those that are kept, where these are full in place of the weakest: how many are kept then."""
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
    """Write force and impulse of a contact from its impulse in a stage of this length [s]."""
    for c in range(3):
        out.force[n, row, c] = impulse[c] / length
        out.impulse[n, row, c] = impulse[c] * duration
