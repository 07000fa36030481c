"""Simulation of one world of a scene, with samples of its states and contacts, and its events."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike

from physics import validation
from physics.accuracy import Accuracy
from physics.analysis.contact_samples import contact_samples, contacts_of
from physics.analysis.diagnostics import diagnose
from physics.analysis.events import Event, Pair, contact_events, fault_events, last_pushes, logged_events, named
from physics.analysis.trajectory import Trajectory
from physics.annotations import Preset
from physics.keywords import known_keywords
from physics.scene.scene import Scene
from physics.world.report import StepReport, add_report
from physics.world.world import World

# The end of the simulation gets a sample of its own if it is further than this share of sample_dt from the last sample.
LAST_SAMPLE = 1e-9

# Time between samples [s] if a caller gives neither `sample_dt` nor `dt`.
SAMPLE_DT = 0.01

# Largest number of samples; with one body so many take more than ten gigabytes.
MOST_SAMPLES = 100_000_000

# Events of a body for which a step has room at first; a step with more events is repeated with more room.
EVENT_ROOM = 16


@known_keywords
def simulate(
    scene: Scene,
    duration: float,
    accuracy: Preset | Accuracy = "balanced",
    sample_dt: float | None = None,
    wrench: ArrayLike | Callable[[float, World], ArrayLike] | None = None,
    dt: float | None = None,
) -> Trajectory:
    """Simulate one world of a scene, and keep samples of it and its events.

    Parameters
    ----------
    scene : Scene
        Scene to simulate.
    duration : float
        Length of the simulation [s].
    accuracy : str or Accuracy
        Name of a preset, or settings, as in `World`.
    sample_dt : float, optional
        Time between samples [s]: they are taken at 0, sample_dt, 2 sample_dt, ..., and at `duration`. None: `dt` if
        given, else 0.01.
    wrench : (bodies, 6) array_like or callable, optional
        Force [N] and torque about the centre of mass [N m], world frame, constant; with one body also (6,). Or a
        function (t, world) that returns such a wrench at each sample, which acts until the next one.
    dt : float, optional
        Length of a step of the engine [s]; `sample_dt` must be a whole multiple of it. None: `sample_dt`. If the last
        interval is shorter than `sample_dt`, it is cut into equal steps of at most `dt`.

    Returns
    -------
    Trajectory
        Samples, events, contacts and reports.

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
    samples, contacts, events, reports = [_sample(world)], [contacts_of(world)], [], []
    watch = _logged if world.plan.scheme.logs_all_events else _Touching()
    world.make_event_room(EVENT_ROOM)
    for start, end in pairwise(times):
        is_short = end == times[-1] and len(times) > whole + 1
        count = max(math.ceil((end - start) / dt * (1 - LAST_SAMPLE)), 1) if is_short else steps
        shorter = (end - start) / count if is_short else None
        found, report = _interval(world, watch, start, end, load(start), count, shorter)
        events += found
        samples.append(_sample(world))
        contacts.append(contacts_of(world))
        reports.append(report)
    pos, quat, linvel, angvel, energy = (np.array(column) for column in zip(*samples))
    touched = contact_samples(times, contacts)
    parts = (tuple(sorted(events, key=lambda event: event.t)), tuple(reports), scene, touched)
    return Trajectory(np.array(times), pos, quat, linvel, angvel, energy, *parts)


def _times(duration, sample_dt, dt) -> tuple[float, float, float]:
    """Check duration, time between samples and step [s]; return them with defaults in place of None."""
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
    """Make a function of the time [s] that returns the wrench (1, bodies, 6) at that time, or None for no wrench."""
    shape = (1, world.body_count, 6)
    if wrench is None:
        return lambda t: None
    if callable(wrench):
        return lambda t: validation.batch(wrench(t, world), shape, "wrench(t, world)")
    held = validation.finite(validation.batch(wrench, shape, "wrench"), shape, "wrench")
    return lambda t: held


def _interval(world: World, watch, start: float, end: float, load, steps: int, dt: float | None):
    """Make the `steps` steps of `dt` [s] between two samples; return their events and the report of all of them."""
    if steps == 1 or world.actuation is None or not world.actuation.actuator.remembers:
        events = watch(world, start, end, partial(world.step, load, steps, dt))
        return events, world.report
    events, total = [], np.zeros_like(world.report_table)  # a call of several steps logs the last one's events only
    edges = np.linspace(start, end, steps + 1).tolist()
    for begin, stop in pairwise(edges):
        events += watch(world, begin, stop, partial(world.step, load, 1, dt))
        add_report(total, world.report_table)
    return events, StepReport(total, world.names)


def _sample(world: World) -> tuple[np.ndarray, ...]:
    return (
        world.pos[0].copy(), world.quat[0].copy(), world.linvel[0].copy(), world.angvel[0].copy(),
        diagnose(world).energy[0],
    )  # fmt: skip


class _Touching:
    """Events of time-stepping schemes: impacts come from the log, other kinds from contacts and faults at samples."""

    def __init__(self):
        self._pushes: dict[Pair, float] = {}

    def __call__(self, world: World, start: float, end: float, step: Callable[[], StepReport]) -> list[Event]:
        """Make the steps from `start` to `end` [s] by calling `step`; return their events."""
        events = _logged(world, start, end, step)
        before, self._pushes = self._pushes, last_pushes(world, self._pushes, end)
        events += contact_events(before, self._pushes, end) + fault_events(world, end)
        return named(events, world.names)


def _logged(world: World, start: float, end: float, step: Callable[[], StepReport]) -> list[Event]:
    """Make steps from `start` [s] by calling `step`; return the logged events.

    If the log had no room for some event, the world is restored and steps again with more room.
    """
    before = world.snapshot()
    step()
    most = int(world.event_counts.max())
    if most > world.event_log.shape[1]:
        world.restore(before)
        world.make_event_room(2 * most)
        return _logged(world, start, end, step)
    return named(logged_events(world, start), world.names)
