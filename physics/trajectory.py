"""Simulate a scene for a while and keep samples and events."""

from __future__ import annotations

import csv
import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from itertools import pairwise
from pathlib import Path

import numpy as np

from physics import checks
from physics.accuracy import Accuracy
from physics.diagnostics import diagnose
from physics.kernels.events.log import KINDS
from physics.keywords import known_keywords
from physics.report import StepReport
from physics.scene import Scene
from physics.world import World

# Samples further apart than this share of sample_dt from the last one are a sample of their own at the end.
LAST_SAMPLE = 1e-9

COLUMNS = (
    "x", "y", "z", "qw", "qx", "qy", "qz", "vx", "vy", "vz", "wx", "wy", "wz",
)  # fmt: skip


@dataclass(frozen=True)
class Event:
    """Something that happened to a body.

    Attributes
    ----------
    t : float
        When [s]. The event-driven scheme knows it to rounding; where it has left out the end of a sequence of ever
        smaller bounces, the contact's ``touch`` and the body's ``rest`` come when that would have ended. Time
        stepping knows the sample interval: `t` is its end.
    kind : str
        ``impact`` (velocities jumped), ``touch`` (a resting contact began), ``release`` (one ended), ``fault``; of
        the event-driven scheme also ``stick`` and ``slip`` (a resting contact ceased or began to slide) and
        ``rest`` (the body came to rest).
    body : int
    wall : int
        -1 where the kind has none, and for the impacts of time stepping.
    impulse : (3,) tuple of float
        Of an ``impact`` on the body, all contacts of the wall together, world frame [N s]; zero where it is not
        known (time stepping) or the kind has none.
    """

    t: float
    kind: str
    body: int
    wall: int = -1
    impulse: tuple[float, float, float] = (0.0, 0.0, 0.0)


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
    """

    t: np.ndarray
    pos: np.ndarray
    quat: np.ndarray
    linvel: np.ndarray
    angvel: np.ndarray
    energy: np.ndarray
    events: tuple[Event, ...]
    reports: tuple[StepReport, ...]

    @property
    def ok(self) -> bool:
        """Whether every interval's report was."""
        return all(report.ok for report in self.reports)

    def to_npz(self, path: str | Path) -> None:
        """Write the samples as a NumPy archive."""
        np.savez(
            path,
            t=self.t,
            pos=self.pos,
            quat=self.quat,
            linvel=self.linvel,
            angvel=self.angvel,
            energy=self.energy,
        )

    def to_csv(self, path: str | Path) -> None:
        """Write the samples as comma-separated values, one row per sample and body."""
        with open(path, "w", newline="", encoding="utf-8") as file:
            writer = csv.writer(file)
            writer.writerow(("t", "body", *COLUMNS, "energy"))
            for k, t in enumerate(self.t):
                for b in range(self.pos.shape[1]):
                    row = np.concatenate((self.pos[k, b], self.quat[k, b], self.linvel[k, b], self.angvel[k, b]))
                    writer.writerow((repr(float(t)), b, *map(repr, row.tolist()), repr(float(self.energy[k, b]))))


@known_keywords
def simulate(
    scene: Scene,
    duration: float,
    accuracy: str | Accuracy = "balanced",
    sample_dt: float = 0.01,
    wrench: Callable[[float, World], np.ndarray] | None = None,
) -> Trajectory:
    """Advance one world of a scene and sample it.

    Parameters
    ----------
    scene : Scene
    duration : float
        [s].
    accuracy : str or Accuracy
        See `World`; the step is `sample_dt`.
    sample_dt : float
        Samples are taken at 0, sample_dt, 2 sample_dt, ... up to and with `duration` [s].
    wrench : callable, optional
        (t, world) -> (bodies, 6), force [N] and torque [N m] held until the next sample.

    Returns
    -------
    Trajectory

    Raises
    ------
    ValueError
        A parameter out of range.
    """
    duration = float(checks.non_negative(duration, (), "duration"))
    sample_dt = float(checks.positive(sample_dt, (), "sample_dt"))
    world = World(scene, dt=sample_dt, accuracy=accuracy)
    whole = math.floor(duration / sample_dt * (1 + LAST_SAMPLE))
    times = [k * sample_dt for k in range(whole + 1)]
    if duration - times[-1] > LAST_SAMPLE * sample_dt:
        times.append(duration)
    else:
        times[-1] = min(times[-1], duration) if whole else times[-1]
    samples, events, reports = [_sample(world)], [], []
    watch = _logged if world.plan.events else _Touching()
    for start, end in pairwise(times):
        is_short = end == times[-1] and len(times) > whole + 1
        load = None if wrench is None else np.asarray(wrench(start, world), dtype=float)[None]
        dt = end - start if is_short else None
        events += watch(world, start, end, partial(world.step, load, dt=dt))
        samples.append(_sample(world))
        reports.append(world.report)
    columns = [np.array(column) for column in zip(*samples)]
    return Trajectory(np.array(times), *columns, events=tuple(events), reports=tuple(reports))


def _sample(world: World) -> tuple[np.ndarray, ...]:
    return (
        world.pos[0].copy(), world.quat[0].copy(), world.linvel[0].copy(), world.angvel[0].copy(),
        diagnose(world).energy[0],
    )  # fmt: skip


class _Touching:
    """Events of time stepping: what its reports and resting contacts tell apart from one sample to the next."""

    def __init__(self):
        self._before: set[tuple[int, int]] = set()

    def __call__(self, world: World, start: float, end: float, step: Callable[[], StepReport]) -> list[Event]:
        """Take a step; the events of it."""
        report = step()
        before, now = self._before, world.touching()
        self._before = now
        events = [Event(end, "impact", -1)] * int(report.impacts[0])
        events += [Event(end, "touch", *pair) for pair in sorted(now - before)]
        events += [Event(end, "release", *pair) for pair in sorted(before - now)]
        if report.faults[0]:
            events.append(Event(end, "fault", -1))
        return events


def _logged(world: World, start: float, end: float, step: Callable[[], StepReport]) -> list[Event]:
    """Take a step of the event-driven scheme; its log, for which room is made and the step repeated if need be."""
    before = world.snapshot()
    step()
    most = int(world.event_counts.max())
    if most > world.event_log.shape[1]:
        world.restore(before)
        world.make_event_room(2 * most)
        return _logged(world, start, end, step)
    events = []
    for body, (count, rows) in enumerate(zip(world.event_counts.tolist(), world.event_log)):
        for t, kind, wall, *impulse in rows[:count].tolist():
            events.append(Event(start + t, KINDS[int(kind)], body, int(wall), tuple(impulse)))
    return sorted(events, key=lambda event: event.t)
