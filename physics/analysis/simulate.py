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
from numpy.typing import ArrayLike

from physics import validation
from physics.analysis.diagnostics import diagnose
from physics.kernels.time_stepping import event_log
from physics.keywords import known_keywords
from physics.plan.accuracy import Accuracy
from physics.scene.scene import Scene
from physics.summary import counted, lines_repr
from physics.world.report import Status, StepReport, add_report
from physics.world.world import World

# Samples further apart than this share of sample_dt from the last one are a sample of their own at the end.
LAST_SAMPLE = 1e-9

# Time between samples where neither it nor the step is given [s].
SAMPLE_DT = 0.01

# Samples at most: of one body they take more than ten gigabytes.
MOST_SAMPLES = 100_000_000

# Events per body that a step has room for at first; one with more is taken again with more room.
EVENT_ROOM = 16

COLUMNS = (
    "x", "y", "z", "qw", "qx", "qy", "qz", "vx", "vy", "vz", "wx", "wy", "wz",
)  # fmt: skip


@dataclass(frozen=True)
class Event:
    """Something that happened to a body, at a wall, with another body or alone.

    An ``impact`` is one event for each pair of bodies, or body and wall, however many contacts they have: `impulse` is
    the sum over these. The change of a body's momentum by impacts is the sum of `impulse` over the events of which it
    is the `body`, less that over those of which it is the `other`.

    Attributes
    ----------
    t : float
        When [s]. The event-driven scheme knows it to rounding; where it has left out the end of a sequence of ever
        smaller bounces, the contact's ``touch`` and the body's ``rest`` come when that would have ended. Time
        stepping knows the moment of an ``impact``; of the other kinds the sample interval: `t` is its end.
    kind : str
        ``impact`` (velocities jumped), ``touch`` (a resting contact began), ``release`` (one ended), ``fault``; of
        the event-driven scheme also ``stick`` and ``slip`` (a resting contact ceased or began to slide) and
        ``rest`` (the body came to rest). What time stepping meets so slowly that loads could have made it as fast
        within a step is a ``touch`` without an ``impact``.
    body : int
    wall : int
        -1 where the kind has none, and where bodies meet.
    impulse : (3,) tuple of float
        Of an ``impact``, on the `body`, world frame [N s]; zero for the other kinds.
    other : int
        The other body where two meet, which gets the opposite impulse; -1: none.
    point : (3,) tuple of float
        Of an ``impact``: the point of `body` where the impulse acts, of several contacts the mean weighted by their
        normal impulses, world frame [m]. On a face the impulse acts there with the moment of all contacts but for
        what friction exerts about the normal. Zero for the other kinds.
    normal : (3,) tuple of float
        Of an ``impact``: unit normal out of the wall or of the other body towards `body`, of several contacts the
        weighted mean, world frame. Zero for the other kinds.
    """

    t: float
    kind: str
    body: int
    wall: int = -1
    impulse: tuple[float, float, float] = (0.0, 0.0, 0.0)
    other: int = -1
    point: tuple[float, float, float] = (0.0, 0.0, 0.0)
    normal: tuple[float, float, float] = (0.0, 0.0, 0.0)


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

    def __repr__(self) -> str:
        samples, bodies = self.pos.shape[:2]
        return lines_repr(
            "Trajectory", f"{samples} samples of {bodies} bodies", f"t = {self.t[0]:.6g} to {self.t[-1]:.6g} s",
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
    sample_dt: float | None = None,
    wrench: ArrayLike | Callable[[float, World], ArrayLike] | None = None,
    dt: float | None = None,
) -> Trajectory:
    """Advance one world of a scene and sample it.

    Parameters
    ----------
    scene : Scene
    duration : float
        [s].
    accuracy : str or Accuracy
        See `World`.
    sample_dt : float, optional
        Samples are taken at 0, sample_dt, 2 sample_dt, ... up to and with `duration` [s]. None: `dt`, or 0.01.
    wrench : (bodies, 6) array_like or callable, optional
        Force [N] and torque about the centre of mass [N m], world frame, all the time; of a scene of one body also
        (6,). Or (t, world) -> such a wrench, held until the next sample.
    dt : float, optional
        The engine's step, of which `sample_dt` is a whole multiple [s]. None: `sample_dt`. A last interval that is
        shorter than `sample_dt` is cut into equal steps of at most this.

    Returns
    -------
    Trajectory

    Raises
    ------
    ValueError
        A parameter out of range, a `sample_dt` that is no multiple of `dt`, or a wrench of another shape.
    """
    duration, sample_dt, dt = _times(duration, sample_dt, dt)
    steps = round(sample_dt / dt)
    world = World(scene, dt=dt, accuracy=accuracy)
    load = _loads(wrench, world)
    whole = math.floor(duration / sample_dt * (1 + LAST_SAMPLE))
    times = [k * sample_dt for k in range(whole + 1)]
    if duration - times[-1] > LAST_SAMPLE * sample_dt:
        times.append(duration)
    else:
        times[-1] = min(times[-1], duration) if whole else times[-1]
    samples, events, reports = [_sample(world)], [], []
    watch = _logged if world.plan.events else _Touching()
    world.make_event_room(EVENT_ROOM)
    for start, end in pairwise(times):
        is_short = end == times[-1] and len(times) > whole + 1
        count = max(math.ceil((end - start) / dt * (1 - LAST_SAMPLE)), 1) if is_short else steps
        shorter = (end - start) / count if is_short else None
        found, report = _interval(world, watch, start, end, load(start), count, shorter)
        events += found
        samples.append(_sample(world))
        reports.append(report)
    columns = [np.array(column) for column in zip(*samples)]
    return Trajectory(np.array(times), *columns, events=tuple(events), reports=tuple(reports))


def _times(duration, sample_dt, dt) -> tuple[float, float, float]:
    """Duration, sample interval and step [s], checked; defaults in place of None."""
    duration = float(validation.non_negative(duration, (), "duration"))
    if dt is not None:
        dt = float(validation.positive(dt, (), "dt"))
    if sample_dt is None:
        sample_dt = SAMPLE_DT if dt is None else dt
    sample_dt = float(validation.positive(sample_dt, (), "sample_dt"))
    dt = sample_dt if dt is None else dt
    ratio = sample_dt / dt
    if ratio > validation.MOST or round(ratio) < 1 or abs(ratio - round(ratio)) > LAST_SAMPLE * ratio:
        raise ValueError(f"sample_dt is {sample_dt!r} with dt={dt!r}; allowed are whole multiples of dt")
    if duration / sample_dt > MOST_SAMPLES:
        raise ValueError(
            f"duration is {duration!r} with sample_dt={sample_dt!r}; allowed are at most {MOST_SAMPLES} samples"
        )
    return duration, sample_dt, dt


def _loads(wrench, world: World) -> Callable[[float], np.ndarray | None]:
    """Return a function of the time [s] that gives the wrench (1, bodies, 6), or None."""
    shape = (1, world.body_count, 6)
    if wrench is None:
        return lambda t: None
    if callable(wrench):
        return lambda t: validation.batch(wrench(t, world), shape, "wrench(t, world)")
    held = validation.finite(validation.batch(wrench, shape, "wrench"), shape, "wrench")
    return lambda t: held


def _interval(world: World, watch, start: float, end: float, load, steps: int, dt: float | None):
    """Take the steps between two samples: events, and the report of all of them."""
    if steps == 1 or world.actuation is None or not world.actuation.actuator.remembers:
        events = watch(world, start, end, partial(world.step, load, steps, dt))
        return events, world.report
    events, total = [], np.zeros_like(world.report_table)  # a call of several steps logs the last one's events only
    edges = np.linspace(start, end, steps + 1).tolist()
    for begin, stop in pairwise(edges):
        events += watch(world, begin, stop, partial(world.step, load, 1, dt))
        add_report(total, world.report_table)
    return events, StepReport(total)


def _sample(world: World) -> tuple[np.ndarray, ...]:
    return (
        world.pos[0].copy(), world.quat[0].copy(), world.linvel[0].copy(), world.angvel[0].copy(),
        diagnose(world).energy[0],
    )  # fmt: skip


class _Touching:
    """Events of time stepping: impacts from its log, the rest from contacts and faults at the samples."""

    def __init__(self):
        self._before: set[tuple[int, int]] = set()

    def __call__(self, world: World, start: float, end: float, step: Callable[[], StepReport]) -> list[Event]:
        """Take a step; the events of it."""
        events = _logged(world, start, end, step)
        before, now = self._before, {(int(body), int(other)) for body, other in world.contact_ends()}
        self._before = now
        for kind, pairs in (("touch", now - before), ("release", before - now)):
            for body, end_of in sorted(pairs, key=lambda pair: (pair[0], abs(pair[1]), pair[1])):
                events.append(Event(end, kind, body, max(-1, -1 - end_of), other=max(-1, end_of)))
        if world.report.faults[0]:
            events.append(Event(end, "fault", int(world.report.fault_body[0])))
        return events


def _logged(world: World, start: float, end: float, step: Callable[[], StepReport]) -> list[Event]:
    """Take a step; its log, for which room is made and the step repeated if need be."""
    before = world.snapshot()
    step()
    most = int(world.event_counts.max())
    if most > world.event_log.shape[1]:
        world.restore(before)
        world.make_event_room(2 * most)
        return _logged(world, start, end, step)
    events = []
    for body, (count, rows) in enumerate(zip(world.event_counts.tolist(), world.event_log)):
        for row in rows[:count].tolist():
            impulse, point, normal = (
                tuple(row[k : k + 3]) for k in (event_log.EVENT_IMPULSE, event_log.EVENT_POINT, event_log.EVENT_NORMAL)
            )
            t, kind, wall, other = row[: event_log.EVENT_IMPULSE]
            events.append(
                Event(start + t, event_log.KIND_NAMES[int(kind)], body, int(wall), impulse, int(other), point, normal)
            )
    return sorted(events, key=lambda event: event.t)
