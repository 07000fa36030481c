"""Measurement of error against time: `frontier` for this engine on a scene, `measure` for contenders of any engine."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterable, Sequence
from fractions import Fraction
from itertools import product
from typing import Any

import numpy as np

from physics import validation
from physics.accuracy import Accuracy, resolve
from physics.analysis.trajectory import Trajectory
from physics.annotations import Preset
from physics.keywords import known_keywords
from physics.scene.scene import Scene
from physics.summary import shown
from physics.work_precision.contender import OURS, Contender, EngineContender, TooSlow
from physics.work_precision.errors import deepest_penetration, energy_error
from physics.work_precision.result import Frontier, FrontierPoint
from physics.work_precision.truth import UNITS, ReferenceTruth, Truth
from physics.world.report import Status

SHOWN_PRESETS: tuple[Preset, ...] = ("fast", "balanced", "precise")
STEPS = (0.02, 0.01, 0.005, 0.002, 0.001)  # [s]
COARSE_STEPS = (0.1, 0.05)  # further steps of event-driven schemes, which are as exact and quicker with them [s]
REPEATS = 5

# A simulation is lost if its error exceeds this share of the scale of the truth, the size of the motion in the scene.
LOST_SHARE = 0.5

# Least time of a timed measurement [s], so that the clock's resolution and the cost of a call do not matter.
LEAST_TIME = 2e-3

# A peer whose first run took at least this long [s] needs no second one to warm up.
LONG_TIME = 1.0

# A contender gets no further repeats once its repeats have taken this long together [s].
BUDGET = 5.0

# Steps are rounded to fractions with denominators up to this, to find the times that they have in common.
LARGEST_DENOMINATOR = 10**6

Progress = Callable[[int, int, str], None]


@known_keywords
def ladder(
    accuracies: Sequence[Preset | Accuracy] = SHOWN_PRESETS, steps: Sequence[float] | None = None
) -> list[tuple[Preset | Accuracy, float]]:
    """Combine every accuracy with every step [s]; the result is an argument `settings` of `frontier`.

    Without `steps` the steps are `STEPS`, and for event-driven accuracies also `COARSE_STEPS`.
    """
    if isinstance(accuracies, (str, Accuracy)) or not isinstance(accuracies, Iterable):
        raise ValueError(f"accuracies is {shown(accuracies)}; allowed is a list of presets and physics.Accuracy(...)")
    accuracies = list(accuracies)
    for k, accuracy in enumerate(accuracies):
        resolve(accuracy, f"accuracies[{k}]")
    if steps is not None:
        given = validation.floats(list(steps) if isinstance(steps, Iterable) else steps, "steps", "are steps in s")
        if given.ndim != 1:
            raise ValueError(f"steps is {shown(steps)}; allowed is a list of steps in s")
        return list(product(accuracies, validation.positive(given, given.shape, "steps").tolist()))
    return [
        (accuracy, dt)
        for accuracy in accuracies
        for dt in (*(COARSE_STEPS if resolve(accuracy).scheme == "events" else ()), *STEPS)
    ]


@known_keywords
def frontier(
    scene: Scene,
    duration: float,
    settings: Iterable[tuple[Preset | Accuracy, float]] | None = None,
    truth: Truth | Callable[[Trajectory], float] | None = None,
    repeats: int = REPEATS,
    progress: Progress | None = None,
) -> Frontier:
    """Measure error against time of this engine for one scene.

    Every setting is run, compared with the truth and timed on one thread; settings take turns. An interruption (Ctrl-C)
    ends the measurement but not the program: the results so far are returned.

    Parameters
    ----------
    scene : Scene
        Scene to simulate.
    duration : float
        Simulated time [s]; it is rounded down to a whole multiple of the shortest time that is a multiple of all steps.
    settings : iterable of (str or Accuracy, float), optional
        Pairs of an accuracy and a step [s]. None: `ladder()`; if the duration is shorter than the coarse steps, without
        them.
    truth : Truth, or callable, optional
        Known outcome; a callable takes a `Trajectory` and returns its error. None: `ReferenceTruth`.
    repeats : int
        Timed runs of each setting; fewer if they take more than `BUDGET` seconds together.
    progress : callable, optional
        Function (done, total, what) that is called before each run, with counts of runs and a description.

    Returns
    -------
    Frontier
        Errors and times of all settings.

    Raises
    ------
    ValueError
        A parameter out of range, or steps that have no common time within the duration.
    KeyboardInterrupt
        An interruption came before the truth was known.
    """
    validation.instance(scene, Scene, "scene", "a physics.Scene")
    if progress is not None and not callable(progress):
        raise ValueError(f"progress is {shown(progress)}; allowed are a function (done, total, what) and None")
    duration = float(validation.positive(duration, (), "duration"))
    if settings is None:
        settings = ladder() if duration >= max(COARSE_STEPS) else ladder(steps=STEPS)
    contenders: Any = [
        EngineContender(scene, resolve(accuracy, name), float(validation.positive(dt, (), f"{name} step")))
        for name, (accuracy, dt) in _pairs(settings).items()
    ]
    return measure(contenders, scene, duration, truth, repeats, progress)


def measure(
    contenders: Sequence[Contender],
    scene: Scene,
    duration: float,
    truth: Truth | Callable[[Trajectory], float] | None = None,
    repeats: int = REPEATS,
    progress: Progress | None = None,
) -> Frontier:
    """Measure error against time of contenders of any engine on one scene; other arguments are those of `frontier`.

    Without `truth`, at least one contender must be of this engine.
    """
    repeats = validation.count(repeats, "repeats")
    duration, sample_dt = common_times(duration, [c.dt for c in contenders])
    reference = _as_truth(truth, scene, duration, sample_dt, contenders)
    tell = _Counter(progress, 1 + len(contenders) * (1 + repeats))
    tell(f"truth: {reference.text}")
    floors = dict(reference.floors)
    turns, skipped, is_complete = [], [], True
    try:
        for contender in contenders:
            tell(f"error of {_name(contender)}")
            try:
                turns.append(_Turn(contender, scene, reference, duration))
            except TooSlow as error:
                skipped.append(f"{_name(contender)}: {error}")
        for _ in range(repeats):
            for turn in turns:
                tell(f"time of {_name(turn.contender)}")
                turn.time()
    except KeyboardInterrupt:
        is_complete = False
    points = tuple(turn.point() for turn in turns)
    return Frontier(
        points, reference.measure,
        {**reference.units, **{name: UNITS[name] for name in ("energy", "penetration")}}, floors,
        reference.text, duration, is_complete, tuple(skipped),
    )  # fmt: skip


class _Turn:
    """Measurement of one contender: its errors, and the times of its runs so far."""

    def __init__(self, contender: Contender, scene: Scene, truth: Truth | ReferenceTruth, duration: float):
        self.contender, self.steps = contender, round(duration / contender.dt)
        start = time.perf_counter()
        trajectory = contender.watch(self.steps)
        watched = time.perf_counter() - start
        with np.errstate(over="ignore", invalid="ignore"):  # a simulation that blew up is marked as lost below
            self.errors = {
                **truth.errors(trajectory),
                "energy": energy_error(scene, trajectory.energy),
                "penetration": deepest_penetration(scene, trajectory.pos, trajectory.quat),
            }
        self.is_lost = _is_lost(trajectory, self.errors[truth.measure], truth.scale)
        self.note = _note(trajectory)
        self.restart, self.run = contender.runner(self.steps)
        self.runs = 1
        self.first = watched  # it includes compilation, and is used only if no run is timed
        if watched < LONG_TIME or contender.engine == OURS:
            self.first = self._seconds(1)
            self.runs = 1 if self.first >= LEAST_TIME else math.ceil(LEAST_TIME / max(self._seconds(1), 1e-9))
        self.seconds: list[float] = []

    def _seconds(self, runs: int) -> float:
        """Wall-clock time of one run [s], as a mean of `runs` runs."""
        total = 0.0
        for _ in range(runs):
            self.restart()
            start = time.perf_counter()
            self.run()
            total += time.perf_counter() - start
        return total / runs

    def time(self) -> None:
        """Make one more timed repeat, unless the repeats so far took `BUDGET` seconds."""
        if sum(self.seconds) * self.runs < BUDGET:
            self.seconds.append(self._seconds(self.runs))

    def point(self) -> FrontierPoint:
        """Make the measured point; a contender without timed repeats gets the time of its first run."""
        c, simulated = self.contender, self.steps * self.contender.dt
        costs = tuple(value / simulated for value in self.seconds or [self.first])
        return FrontierPoint(c.engine, c.setting, c.dt, self.errors, costs, self.is_lost, self.note)


def common_times(duration: float, steps: Sequence[float]) -> tuple[float, float]:
    """Find the times at which all steps [s] can be compared; return (duration, sample_dt) [s].

    `sample_dt` is the shortest time that is a whole multiple of every step. The duration is rounded down to a whole
    multiple of it.

    Raises
    ------
    ValueError
        There are no steps, or `sample_dt` would exceed the duration.
    """
    duration = float(validation.positive(duration, (), "duration"))
    if not steps:
        raise ValueError("settings is empty; allowed is at least one (accuracy, step)")
    parts = [Fraction(step).limit_denominator(LARGEST_DENOMINATOR) for step in steps]
    if not all(part > 0 for part in parts):
        raise ValueError(f"settings hold the step {min(steps):g} s; allowed are steps from 1e-6 s up")
    scale = math.lcm(*(part.denominator for part in parts))
    sample = Fraction(math.lcm(*(int(part * scale) for part in parts)), scale)
    whole = math.floor(duration / float(sample) * (1 + 1e-9))
    if whole < 1:
        raise ValueError(
            f"duration is {duration:g} s; allowed are at least {float(sample):g} s, the first time that the steps "
            f"{', '.join(f'{step:g}' for step in dict.fromkeys(steps))} s have in common"
        )
    return float(whole * sample), float(sample)


def _pairs(settings: Iterable) -> dict[str, tuple]:
    """Check the form of `settings`; return the pairs (accuracy, step) by their names in messages."""
    if isinstance(settings, (str, Accuracy)) or not isinstance(settings, Iterable):
        raise ValueError(f"settings is {shown(settings)}; allowed is a list of (preset or physics.Accuracy, step in s)")
    pairs = list(settings)
    for k, pair in enumerate(pairs):
        if not isinstance(pair, (tuple, list)) or len(pair) != 2:
            raise ValueError(f"settings[{k}] is {shown(pair)}; allowed is (preset or physics.Accuracy, step in s)")
    return {f"settings[{k}]": pair for k, pair in enumerate(pairs)}


def _as_truth(truth, scene, duration, sample_dt, contenders) -> Truth | ReferenceTruth:
    if truth is None:
        steps = [c.dt for c in contenders if c.engine == OURS]
        if not steps:
            raise ValueError("truth is None, and no contender is of our engine; allowed is a Truth then")
        return ReferenceTruth(scene, duration, sample_dt, min(steps))
    if isinstance(truth, Truth):
        return truth
    if not callable(truth):
        raise ValueError(f"truth is {shown(truth)}; allowed are a physics.Truth, a function of a Trajectory, or None")
    return Truth(truth)


def _is_lost(trajectory: Trajectory, error: float, scale: float | None) -> bool:
    if any((report.status == Status.FAULT).any() for report in trajectory.reports):
        return True
    return not math.isfinite(error) or (scale is not None and error > LOST_SHARE * scale)


def _note(trajectory: Trajectory) -> str:
    bad = [report for report in trajectory.reports if not report.ok]
    if not bad:
        return ""
    worst = max(bad, key=lambda report: report.status.max())
    return f"{len(bad)} of {len(trajectory.reports)} samples: {next(iter(worst.messages().values()))}"


def _name(contender: Contender) -> str:
    return f"{contender.engine} {contender.setting}, {1e3 * contender.dt:g} ms"


class _Counter:
    """Counter of finished runs, which calls the callback `progress` before each of `total` runs."""

    def __init__(self, progress: Progress | None, total: int):
        self.progress, self.total, self.done = progress, total, 0

    def __call__(self, what: str) -> None:
        if self.progress is not None:
            self.progress(self.done, self.total, what)
        self.done += 1
