"""Trajectory: samples and events of a simulation of one world, their files, tables and pictures."""

from __future__ import annotations

import zipfile
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from physics import validation
from physics.analysis import trajectory_plot
from physics.analysis.contact_samples import ContactSamples
from physics.analysis.events import Event, named
from physics.analysis.tables import columns_of, write_csv
from physics.analysis.trajectory_arrays import (
    contact_arrays,
    contacts_of_file,
    event_arrays,
    events_of,
    scene_arrays,
    scene_of,
)
from physics.html_table import parts_table
from physics.optional import load_optional
from physics.scene.body_names import body_index, body_names
from physics.scene.scene import Scene
from physics.summary import counted, parts_repr
from physics.world.report import Status, StepReport

# Shape of each number or vector of one body at one sample.
TAILS: dict[str, tuple[int, ...]] = {"pos": (3,), "quat": (4,), "linvel": (3,), "angvel": (3,), "energy": ()}
SAMPLES = ("t", *TAILS)


@dataclass(frozen=True)
class Trajectory:
    """Samples and events of a simulation of one world; ``trajectory["crate"]`` selects one body.

    Attributes
    ----------
    t : (samples,) float64
        Times of the samples [s].
    pos, quat, linvel, angvel : (samples, bodies, 3|4|3|3) float64
        States of the bodies in the world frame [m, 1, m/s, rad/s].
    energy : (samples, bodies) float64
        Sum of kinetic and potential energy [J].
    events : tuple of Event
        Events in the order of time.
    reports : tuple of StepReport
        A report for each interval between samples.
    scene : Scene or None
        The scene; None: unknown. In a trajectory read from a file it has bodies and walls, but no effects save
        `Contact`.
    contacts : ContactSamples or None
        Contact points and forces at the samples; None: unknown.
    """

    t: NDArray[np.float64]
    pos: NDArray[np.float64]
    quat: NDArray[np.float64]
    linvel: NDArray[np.float64]
    angvel: NDArray[np.float64]
    energy: NDArray[np.float64]
    events: tuple[Event, ...]
    reports: tuple[StepReport, ...]
    scene: Scene | None = field(default=None, compare=False)
    contacts: ContactSamples | None = field(default=None, compare=False)

    __repr__ = parts_repr
    __iter__ = None  # Python would else iterate by `trajectory[0]`, `trajectory[1]`, ...

    def _repr_html_(self) -> str:
        energy = self.energy.sum(axis=1)
        return parts_table(self, ("energy", f"{energy[0]:.6g} to {energy[-1]:.6g} J"))

    def _parts(self) -> tuple[str, ...]:
        samples, bodies = self.pos.shape[:2]
        return (
            f"{samples} samples of {bodies} bodies", f"t = {self.t[0]:.6g} to {self.t[-1]:.6g} s",
            f"events: {counted(event.kind for event in self.events)}", f"ok={self.ok}{self._why()}",
        )  # fmt: skip

    def _why(self) -> str:
        """Words for the `repr` about the gravest status of all reports; "" if all are OK.

        The words count the reports with this status, and name the first such report, whose `messages` explain it.
        """
        met = [int(report.status[0]) for report in self.reports]
        worst = max(met, key=Status.severity, default=int(Status.OK))
        if worst == Status.OK:
            return ""
        name, first = Status(worst).name.lower(), met.index(worst)
        return f": {name} in {met.count(worst)} of {len(met)} reports, first in reports[{first}].messages()"

    @property
    def ok(self) -> bool:
        """True if the reports of all intervals between samples are OK (`StepReport.ok`)."""
        return all(report.ok for report in self.reports)

    # --- bodies ------------------------------------------------------------------------------------------------

    def __getitem__(self, body: str | int) -> BodyTrajectory:
        """Select the samples and events of one body, by its name or its index.

        Raises
        ------
        ValueError
            No such body exists. The message lists the names of the bodies, the nearest first.
        """
        b = self._index(body)
        samples = {name: getattr(self, name)[:, b] for name in TAILS}
        events = tuple(event for event in self.events if b in (event.body, event.other))
        return BodyTrajectory(b, self.names[b], self.t, **samples, events=events)

    def _index(self, body: str | int) -> int:
        if self.scene is not None:
            return body_index(body, "body", self.scene)
        if isinstance(body, str):
            raise ValueError(
                f"body is {body!r} of a trajectory without a scene, which has no names; allowed is an index"
            )
        return validation.index(body, self.pos.shape[1], "body")

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the bodies; "" for a body without a name, or without a scene."""
        return ("",) * self.pos.shape[1] if self.scene is None else body_names(self.scene)

    def label(self, body: int) -> str:
        """Name of the body with index `body`, or ``body`` and the index if it has none."""
        return self.names[body] or f"body {body}"

    # --- tables and pictures -----------------------------------------------------------------------------------

    def to_csv(self, path: str | Path, what: str = "samples") -> None:
        """Write a table as comma-separated values; docs/recordings.md lists the columns.

        Parameters
        ----------
        path : str or Path
            Path of the file to write.
        what : {"samples", "events", "contacts"}
            Contents: a row for each sample of each body, for each event, or for each contact at each sample.
        """
        validation.path(path)
        write_csv(path, columns_of(self, what))

    def to_pandas(self, what: str = "samples"):
        """Make a `pandas.DataFrame` with the same table that `to_csv` writes.

        Parameters
        ----------
        what : {"samples", "events", "contacts"}
            Contents of the table, as in `to_csv`.

        Raises
        ------
        ModuleNotFoundError
            pandas is missing.
        """
        columns = columns_of(self, what)
        return load_optional("pandas", "Trajectory.to_pandas").DataFrame(columns)

    def plot(self, path: str | Path | None = None):
        """Draw the motion over time: of a single body its vectors; of several their heights, speeds and spins.

        Parameters
        ----------
        path : str or Path, optional
            Picture to write; its ending chooses a format of matplotlib. None: no file.

        Returns
        -------
        matplotlib.figure.Figure
            The picture, which a notebook shows.

        Raises
        ------
        ModuleNotFoundError
            matplotlib is missing.
        """
        if self.pos.shape[1] == 1:
            return self[0].plot(path)
        return trajectory_plot.plot_bodies(self, path)

    # --- files -------------------------------------------------------------------------------------------------

    def to_npz(self, path: str | Path) -> None:
        """Write samples, events, contacts, and the scene's bodies and walls to an ``.npz`` file for `from_npz`."""
        samples: Any = {name: getattr(self, name) for name in SAMPLES}
        rest: Any = {**event_arrays(self.events), **contact_arrays(self.contacts), **scene_arrays(self.scene)}
        np.savez(path, **samples, **rest)

    @classmethod
    def from_npz(cls, path: str | Path) -> Trajectory:
        """Read a trajectory that `to_npz` has written, without running code from the file.

        The result has no reports. Files of earlier versions may lack events, contacts or a scene.

        Parameters
        ----------
        path : str or Path
            Path of the file.

        Raises
        ------
        ValueError
            The file is no trajectory, or is damaged.
        OSError
            The file cannot be read.
        """
        allowed = "allowed is what Trajectory.to_npz writes (.npz)"
        with open(validation.path(path), "rb") as file:
            if not zipfile.is_zipfile(file):
                raise ValueError(f"{path} is no trajectory; {allowed}")
            file.seek(0)
            try:
                with np.load(file, allow_pickle=False) as content:
                    parts = dict(content)
                samples = _checked({name: parts[name] for name in SAMPLES})
                scene = _matching(scene_of(parts), samples)
                events = tuple(named(list(events_of(parts)), () if scene is None else body_names(scene)))
                contacts = contacts_of_file(parts)
                return cls(**samples, events=events, reports=(), scene=scene, contacts=contacts)
            except Exception as error:  # any fault means that the file is no trajectory
                told = f"there is no {error}" if isinstance(error, KeyError) else error
                raise ValueError(f"{path} is no trajectory ({told}); {allowed}") from None


@dataclass(frozen=True, eq=False)
class BodyTrajectory:
    """Samples and events of one body of a trajectory, as ``trajectory["crate"]`` returns them.

    Attributes
    ----------
    body : int
        Index of the body in the scene.
    name : str
        Name of the body; "" if it has none.
    t : (samples,) float64
        Times of the samples [s].
    pos, quat, linvel, angvel : (samples, 3|4|3|3) float64
        States of the body in the world frame [m, 1, m/s, rad/s].
    energy : (samples,) float64
        Sum of kinetic and potential energy [J].
    events : tuple of Event
        Events in which the body is `Event.body` or `Event.other`.
    """

    body: int
    name: str
    t: np.ndarray
    pos: np.ndarray
    quat: np.ndarray
    linvel: np.ndarray
    angvel: np.ndarray
    energy: np.ndarray
    events: tuple[Event, ...]

    __repr__ = parts_repr
    _repr_html_ = parts_table

    def _parts(self) -> tuple[str, ...]:
        return (
            self.label, f"{len(self.t)} samples", f"t = {self.t[0]:.6g} to {self.t[-1]:.6g} s",
            f"events: {counted(event.kind for event in self.events)}",
        )  # fmt: skip

    @property
    def label(self) -> str:
        """Name of the body, or ``body`` and its index if it has none."""
        return self.name or f"body {self.body}"

    def plot(self, path: str | Path | None = None):
        """Draw position, velocity, angular velocity and energy of the body over time, as `Trajectory.plot` does."""
        return trajectory_plot.plot_body(self, path)


def _checked(samples: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Check and return the sample arrays of a file: shapes must match, times increase, and numbers be finite."""
    shape = samples["energy"].shape
    if len(shape) != 2 or 0 in shape:
        raise ValueError(f"energy has shape {shape}")
    wanted = {name: (*shape, *tail) for name, tail in TAILS.items()} | {"t": shape[:1]}
    for name, array in samples.items():
        if array.shape != wanted[name] or array.dtype != np.float64 or not np.isfinite(array).all():
            raise ValueError(f"{name} of shape {array.shape} should be {wanted[name]} finite 64-bit floats")
    if not (np.diff(samples["t"]) > 0.0).all():
        raise ValueError("its times do not rise")
    return samples


def _matching(scene: Scene | None, samples: dict[str, np.ndarray]) -> Scene | None:
    """Return the scene of a file, which may be None; ValueError if it has another number of bodies than the samples."""
    bodies = samples["pos"].shape[1]
    if scene is not None and len(scene.bodies) != bodies:
        raise ValueError(f"its scene has {len(scene.bodies)} bodies, its samples have {bodies}")
    return scene
