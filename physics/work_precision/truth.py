"""Truths against which trajectories are measured: an outcome known to the caller, or runs at preset ``reference``."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from physics import validation
from physics.accuracy import Accuracy, resolve
from physics.analysis.simulate import simulate
from physics.analysis.trajectory import Trajectory
from physics.annotations import Preset
from physics.html_table import fields_table
from physics.keywords import known_keywords
from physics.scene.scene import Scene
from physics.summary import shown
from physics.work_precision.errors import angles_between, distances, event_error, root_mean_square

# Unit of each error measure; "error", which a `Truth` returns, has its own unit.
UNITS = {
    "pose": "m",
    "position": "m",
    "orientation": "rad",
    "linvel": "m/s",
    "angvel": "rad/s",
    "event_time": "s",
    "energy": "J",
    "penetration": "m",
}

# The looser of two reference runs has tolerances larger by this factor, and steps twice as long.
LOOSER = 10.0

# Two sample times count as equal within this share of the time between two compared samples.
SAME_TIME = 1e-6


@known_keywords
@dataclass(frozen=True)
class Truth:
    """Outcome of a simulation that is known to the caller, such as a closed form.

    Parameters
    ----------
    error : callable
        Takes a `Trajectory` and returns its distance from the known outcome, in `unit`; infinity or NaN if the
        trajectory never comes near it.
    unit : str
        Unit of the error.
    own_error : float
        Error of the known outcome itself, in `unit`; smaller errors tell nothing.
    scale : float, optional
        Size of the motion in the scene, in `unit`: a trajectory with an error of half of it is lost (see
        `FrontierPoint.is_lost`). None: unknown.
    text : str
        Description of the truth for people.

    Raises
    ------
    ValueError
        `own_error` is negative, `scale` not positive, or `error` cannot be called.
    """

    error: Callable[[Trajectory], float]
    unit: str = ""
    own_error: float = 0.0
    scale: float | None = None
    text: str = "given by the caller"

    _repr_html_ = fields_table

    def __post_init__(self):
        if not callable(self.error):
            raise ValueError(f"Truth.error is {shown(self.error)}; allowed is a function of a Trajectory")
        validation.non_negative(self.own_error, (), "Truth.own_error")
        if self.scale is not None:
            validation.positive(self.scale, (), "Truth.scale")

    measure = "error"

    @property
    def floors(self) -> dict[str, float]:
        """The truth's own error, by name of the measure."""
        return {"error": float(self.own_error)}

    @property
    def units(self) -> dict[str, str]:
        """Unit of the error, by name of the measure."""
        return {"error": self.unit}

    def errors(self, trajectory: Trajectory) -> dict[str, float]:
        """Error of a trajectory, by name of the measure."""
        return {"error": float(self.error(trajectory))}


class ReferenceTruth:
    """Truth from runs of this engine at the preset ``reference``, with an estimate of its own error.

    There are two runs: one at half the finest step of the ladder, and one at the finest step with tolerances ten times
    as large. The first run is the truth, and the difference of the two is its own error. Errors below it cannot be told
    apart.

    Parameters
    ----------
    scene : Scene
        Scene to simulate.
    duration : float
        Simulated time [s], a whole multiple of `sample_dt`.
    sample_dt : float
        Time between the samples that are compared [s].
    dt : float
        Finest step of the ladder [s]; it divides `sample_dt`.
    accuracy : str or Accuracy
        Accuracy of the first run.
    """

    measure = "pose"

    def __init__(
        self, scene: Scene, duration: float, sample_dt: float, dt: float, accuracy: Preset | Accuracy = "reference"
    ):
        self.scene, self.duration, self.dt = scene, duration, dt
        self.times = sample_dt * np.arange(round(duration / sample_dt) + 1)
        self.best = resolve(accuracy)

    @cached_property
    def true(self) -> Trajectory:
        """Trajectory of the first run, which counts as the truth."""
        return simulate(self.scene, self.duration, self.best, sample_dt=0.5 * self.dt)

    @cached_property
    def floors(self) -> dict[str, float]:
        """The truth's own error in each measure: the difference of the two runs."""
        looser = replace(self.best, tolerance=LOOSER * self.best.tolerance, slop=LOOSER * self.best.slop)
        return self.errors(simulate(self.scene, self.duration, looser, sample_dt=self.dt))

    @cached_property
    def scale(self) -> float:
        """Size of the motion: largest distance of a point of a body from its place at the start [m]."""
        pos, quat = self.true.pos, self.true.quat
        return float(distances(self.scene, pos, quat, pos[:1], quat[:1]).max())

    @property
    def units(self) -> dict[str, str]:
        """Unit of each error measure, by its name."""
        return {name: UNITS[name] for name in ("pose", "position", "orientation", "linvel", "angvel", "event_time")}

    @property
    def text(self) -> str:
        """Description of the truth for people: the steps of the two runs."""
        return f"reference at {500 * self.dt:g} ms, against itself at {1e3 * self.dt:g} ms with looser tolerances"

    def errors(self, trajectory: Trajectory) -> dict[str, float]:
        """Errors of a trajectory, which must have samples at the times of the comparison.

        Returns
        -------
        dict
            ``pose`` [m] (see `errors.distances`), ``position`` [m] and ``orientation`` [rad]: the largest over
            samples and bodies. ``linvel`` [m/s] and ``angvel`` [rad/s]: `errors.root_mean_square`. ``event_time`` [s]:
            `errors.event_error`, missing if no events correspond.
        """
        mine, theirs = rows_at(trajectory.t, self.times), rows_at(self.true.t, self.times)
        pos, true_pos = trajectory.pos[mine], self.true.pos[theirs]
        quat, true_quat = trajectory.quat[mine], self.true.quat[theirs]
        found = {
            "pose": float(distances(self.scene, pos, quat, true_pos, true_quat).max()),
            "position": float(np.linalg.norm(pos - true_pos, axis=-1).max()),
            "orientation": float(angles_between(quat, true_quat).max()),
            "linvel": root_mean_square(trajectory.linvel[mine] - self.true.linvel[theirs]),
            "angvel": root_mean_square(trajectory.angvel[mine] - self.true.angvel[theirs]),
        }
        late = event_error(trajectory.events, self.true.events)
        return found if late is None else {**found, "event_time": late}


def rows_at(t: np.ndarray, times: np.ndarray) -> np.ndarray:
    """Indices (m,) of the samples with times `t` (n,) [s] that lie at `times` (m,) [s].

    Raises
    ------
    ValueError
        No sample lies at one of these times.
    """
    slack = SAME_TIME * (times[1] - times[0])
    rows = np.minimum(np.searchsorted(t, times - slack), len(t) - 1)
    off = np.abs(t[rows] - times)
    if not off.max() <= slack:
        raise ValueError(f"the trajectory has no sample at {times[off.argmax()]:g} s; allowed are those that have")
    return rows
