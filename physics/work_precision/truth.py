"""Truth for a trajectory: one of the caller, or our own reference at two settings."""

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

# Units of what is measured of every scene; "error" is what a `Truth` returns, in its own unit.
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

# The looser of the two reference runs has its tolerances larger by this, and its step twice as long.
LOOSER = 10.0

# Two sample times are the same within this share of the time between two that are compared.
SAME_TIME = 1e-6


@known_keywords
@dataclass(frozen=True)
class Truth:
    """Outcome known to the caller.

    Parameters
    ----------
    error : callable
        `Trajectory` -> how far from the truth it is, in `unit`; infinite or not a number: it does not get there.
    unit : str
    own_error : float
        Of the truth itself, in `unit`: smaller errors tell nothing.
    scale : float, optional
        What makes an error as large as what happens (see `FrontierPoint.is_lost`), in `unit`; None: unknown.
    text : str
        What it is, for people.

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
        """The truth's own error."""
        return {"error": float(self.own_error)}

    @property
    def units(self) -> dict[str, str]:
        """Unit of each measure."""
        return {"error": self.unit}

    def errors(self, trajectory: Trajectory) -> dict[str, float]:
        """Errors of a trajectory."""
        return {"error": float(self.error(trajectory))}


class ReferenceTruth:
    """Truth by the preset ``reference``, and its agreement with itself.

    Two runs: one at half the finest step of the ladder, one at the finest step and with tolerances ten times as large.
    The first is the truth, the difference its own stated error: a setting that is better than that cannot be told
    apart.

    Parameters
    ----------
    scene : Scene
    duration : float
        [s], a whole multiple of `sample_dt`.
    sample_dt : float
        Trajectories are compared every `sample_dt` [s].
    dt : float
        Finest step of the ladder [s]; it divides `sample_dt`.
    accuracy : str or Accuracy
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
        """Run that counts as the truth."""
        return simulate(self.scene, self.duration, self.best, sample_dt=0.5 * self.dt)

    @cached_property
    def floors(self) -> dict[str, float]:
        """Difference of the two runs, per measure."""
        looser = replace(self.best, tolerance=LOOSER * self.best.tolerance, slop=LOOSER * self.best.slop)
        return self.errors(simulate(self.scene, self.duration, looser, sample_dt=self.dt))

    @cached_property
    def scale(self) -> float:
        """Largest distance of a point of a body from its start [m]."""
        pos, quat = self.true.pos, self.true.quat
        return float(distances(self.scene, pos, quat, pos[:1], quat[:1]).max())

    @property
    def units(self) -> dict[str, str]:
        """Unit of each measure."""
        return {name: UNITS[name] for name in ("pose", "position", "orientation", "linvel", "angvel", "event_time")}

    @property
    def text(self) -> str:
        """Describe the truth in words."""
        return f"reference at {500 * self.dt:g} ms, against itself at {1e3 * self.dt:g} ms with looser tolerances"

    def errors(self, trajectory: Trajectory) -> dict[str, float]:
        """Errors of a trajectory at the times of the comparison.

        Returns
        -------
        dict
            ``pose`` [m] (see `errors.distances`), ``position`` [m] and ``orientation`` [rad]: the largest over
            samples and bodies; ``linvel`` [m/s] and ``angvel`` [rad/s]: root mean square over the samples of the worst
            body; ``event_time`` [s] where events can be paired (see `errors.event_error`).
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
    """Indices of the samples `t` (n,) that lie at `times` (m,) [s].

    Raises
    ------
    ValueError
        There is none at one of them.
    """
    slack = SAME_TIME * (times[1] - times[0])
    rows = np.minimum(np.searchsorted(t, times - slack), len(t) - 1)
    off = np.abs(t[rows] - times)
    if not off.max() <= slack:
        raise ValueError(f"the trajectory has no sample at {times[off.argmax()]:g} s; allowed are those that have")
    return rows
