"""Contact points and forces at the samples of a trajectory."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from physics.html_table import parts_table
from physics.summary import parts_repr
from physics.world.world import World


@dataclass(frozen=True, eq=False)
class ContactSamples:
    """Contacts at all samples of a trajectory, a row for each contact, in the order of time.

    Attributes
    ----------
    t : (n,) float64
        Time of the sample [s].
    body, wall, other : (n,) int64
        Index of the body on which `force` acts, and of the wall or the other body that exerts it; -1: none.
    point, force : (n, 3) float64
        Contact point [m] and force [N], world frame. The force is the mean over the last step before the sample,
        without collisions.
    """

    t: np.ndarray
    body: np.ndarray
    wall: np.ndarray
    other: np.ndarray
    point: np.ndarray
    force: np.ndarray

    __repr__ = parts_repr
    _repr_html_ = parts_table

    def _parts(self) -> tuple[str, ...]:
        return f"{len(self.t)} contacts at {len(np.unique(self.t))} samples", *self._span()

    def _span(self) -> tuple[str, ...]:
        return (f"t = {self.t[0]:.6g} to {self.t[-1]:.6g} s",) if len(self.t) else ()


NAMES = ("t", "body", "wall", "other", "point", "force")
"""Names of the arrays of `ContactSamples`."""


def contacts_of(world: World) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Contacts of the last step of world 0: ends (n, 2), points (n, 3) [m] and forces (n, 3) [N].

    See `World.contact_ends` and `World.contacts`.
    """
    return world.contact_ends(), *world.contacts()


def contact_samples(
    times: Sequence[float], found: Sequence[tuple[np.ndarray, np.ndarray, np.ndarray]]
) -> ContactSamples:
    """Join results `found` of `contacts_of` at several times [s] into one object."""
    ends, points, forces = (np.concatenate(parts) for parts in zip(*found))
    t = np.repeat(np.asarray(times, dtype=np.float64), [len(each) for each, _, _ in found])
    body, end = ends[:, 0], ends[:, 1]
    return ContactSamples(t, body, np.maximum(-1, -1 - end), np.maximum(-1, end), points, forces)
