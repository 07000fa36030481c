"""Samples, events and contacts of a trajectory as tables, for CSV files and for pandas."""

from __future__ import annotations

import csv
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from physics import validation

if TYPE_CHECKING:
    from physics.analysis.contact_samples import ContactSamples
    from physics.analysis.events import Event
    from physics.analysis.trajectory import Trajectory

TABLES = ("samples", "events", "contacts")

# Names of the columns for the components of each vector of a sample.
VECTORS = {
    "pos": ("x", "y", "z"),
    "quat": ("qw", "qx", "qy", "qz"),
    "linvel": ("vx", "vy", "vz"),
    "angvel": ("wx", "wy", "wz"),
}

Columns = dict[str, np.ndarray | list]


def columns_of(trajectory: Trajectory, what: str) -> Columns:
    """Make a table of a trajectory: columns of equal length by name.

    Parameters
    ----------
    trajectory : Trajectory
        Trajectory to read.
    what : {"samples", "events", "contacts"}
        Contents of the table: a row for each sample of each body, for each event, or for each contact at each sample.

    Raises
    ------
    ValueError
        `what` is another word, or the trajectory does not know its contacts.
    """
    validation.one_of(what, TABLES, "what")
    if what == "samples":
        return _samples(trajectory)
    if what == "events":
        return _events(trajectory.events)
    if trajectory.contacts is None:
        raise ValueError(
            "what is 'contacts', which this trajectory does not hold; allowed are those of physics.simulate"
        )
    return _contacts(trajectory.contacts, trajectory.names)


def write_csv(path: str | Path, columns: Columns) -> None:
    """Write a table as a file of comma-separated values, floats with all digits."""
    lists = [column.tolist() if isinstance(column, np.ndarray) else column for column in columns.values()]
    with open(path, "w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(columns)
        writer.writerows(zip(*lists))


def _samples(trajectory: Trajectory) -> Columns:
    samples, bodies = trajectory.energy.shape
    found: Columns = {"t": np.repeat(trajectory.t, bodies), "body": np.tile(np.arange(bodies), samples)}
    found["name"] = list(trajectory.names) * samples
    for name, parts in VECTORS.items():
        found |= _parts(getattr(trajectory, name).reshape(-1, len(parts)), parts)
    return found | {"energy": trajectory.energy.ravel()}


def _events(events: Sequence[Event]) -> Columns:
    found: Columns = {
        name: [getattr(event, name) for event in events]
        for name in ("t", "kind", "body", "name", "wall", "other", "other_name")
    }
    for name, parts in (("impulse", "jx jy jz"), ("point", "x y z"), ("normal", "nx ny nz")):
        vectors = np.array([getattr(event, name) for event in events], dtype=np.float64).reshape(-1, 3)
        found |= _parts(vectors, parts.split())
    return found


def _contacts(contacts: ContactSamples, names: Sequence[str]) -> Columns:
    found: Columns = {
        "t": contacts.t,
        "body": contacts.body,
        "name": _named(contacts.body, names),
        "wall": contacts.wall,
        "other": contacts.other,
        "other_name": _named(contacts.other, names),
    }
    return found | _parts(contacts.point, "xyz") | _parts(contacts.force, ("fx", "fy", "fz"))


def _parts(vectors: np.ndarray, names: Iterable[str]) -> Columns:
    return {name: vectors[:, k] for k, name in enumerate(names)}


def _named(bodies: np.ndarray, names: Sequence[str]) -> list[str]:
    return [names[body] if body >= 0 else "" for body in bodies.tolist()]
