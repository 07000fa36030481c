"""Samples of a run of one world, and their files."""

from __future__ import annotations

import csv
import zipfile
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from physics import validation
from physics.analysis.events import Event
from physics.analysis.trajectory_arrays import event_arrays, events_of, scene_arrays, scene_of
from physics.html_table import parts_table
from physics.scene.scene import Scene
from physics.summary import counted, parts_repr
from physics.world.report import Status, StepReport

COLUMNS = (
    "x", "y", "z", "qw", "qx", "qy", "qz", "vx", "vy", "vz", "wx", "wy", "wz",
)  # fmt: skip

# Numbers of a sample of one body.
TAILS: dict[str, tuple[int, ...]] = {"pos": (3,), "quat": (4,), "linvel": (3,), "angvel": (3,), "energy": ()}
SAMPLES = ("t", *TAILS)


@dataclass(frozen=True)
class Trajectory:
    """Samples of one world.

    Attributes
    ----------
    t : (samples,) float64
        [s].
    pos, quat, linvel, angvel : (samples, bodies, 3|4|3|3) float64
        World frame; see `World`.
    energy : (samples, bodies) float64
        Kinetic and potential [J].
    events : tuple of Event
    reports : tuple of StepReport
        One per sample interval.
    scene : Scene or None
        The scene, if it is known; read from a file its bodies and walls, without effects.
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

    __repr__ = parts_repr

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
        """The gravest status, and when it was met first: for the `repr`; `messages` of the reports tell more."""
        met = [int(report.status[0]) for report in self.reports]
        worst = max(met, key=Status.severity, default=int(Status.OK))
        if worst == Status.OK:
            return ""
        name, first = Status(worst).name.lower(), met.index(worst)
        return f": {name} in {met.count(worst)} of {len(met)} reports, first in reports[{first}].messages()"

    @property
    def ok(self) -> bool:
        """True if every interval's report was."""
        return all(report.ok for report in self.reports)

    def to_npz(self, path: str | Path) -> None:
        """Write samples, events, and the bodies and walls of the scene as a NumPy archive; `from_npz` reads it."""
        arrays: Any = {name: getattr(self, name) for name in SAMPLES}
        arrays |= {**event_arrays(self.events), **scene_arrays(self.scene)}
        np.savez(path, **arrays)

    @classmethod
    def from_npz(cls, path: str | Path) -> Trajectory:
        """Read what `to_npz` has written, the reports apart; nothing in a file is run.

        Parameters
        ----------
        path : str or Path
            An archive without events or a scene, of an earlier version, has none.

        Raises
        ------
        ValueError
            It is no trajectory, or a damaged one.
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
                return cls(**samples, events=events_of(parts), reports=(), scene=_matching(scene_of(parts), samples))
            except Exception as error:  # whatever is wrong with it, it is none
                told = f"there is no {error}" if isinstance(error, KeyError) else error
                raise ValueError(f"{path} is no trajectory ({told}); {allowed}") from None

    def to_csv(self, path: str | Path) -> None:
        """Write the samples as comma-separated values, one row per sample and body."""
        with open(path, "w", newline="", encoding="utf-8") as file:
            writer = csv.writer(file)
            writer.writerow(("t", "body", *COLUMNS, "energy"))
            for k, t in enumerate(self.t):
                for b in range(self.pos.shape[1]):
                    row = np.concatenate((self.pos[k, b], self.quat[k, b], self.linvel[k, b], self.angvel[k, b]))
                    writer.writerow((repr(float(t)), b, *map(repr, row.tolist()), repr(float(self.energy[k, b]))))


def _checked(samples: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Arrays of a file, if their shapes fit each other, their times rise, and their numbers are finite."""
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
    """The scene, if it has as many bodies as the samples."""
    bodies = samples["pos"].shape[1]
    if scene is not None and len(scene.bodies) != bodies:
        raise ValueError(f"its scene has {len(scene.bodies)} bodies, its samples have {bodies}")
    return scene
