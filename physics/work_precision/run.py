"""Measure error against time: `frontier` for a scene of yours, `measure` for any contenders, peers too."""

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
COARSE_STEPS = (0.1, 0.05)  # of an event-driven scheme besides, which is as exact there and pays less [s]
REPEATS = 5

# An error larger than this share of what happens in the scene follows it no longer.
LOST_SHARE = 0.5

# A timed run takes at least this long, so that the clock's grain and a call's overhead do not show [s].
LEAST_TIME = 2e-3

# A peer whose run took this long needs no other one to warm up [s].
LONG_TIME = 1.0

# No further repeat of a contender whose repeats took this long together [s].
BUDGET = 5.0

# Steps are taken for fractions with denominators up to this, to find the times they have in common.
LARGEST_DENOMINATOR = 10**6

Progress = Callable[[int, int, str], None]


@known_keywords
def ladder(
    accuracies: Sequence[Preset | Accuracy] = SHOWN_PRESETS, steps: Sequence[float] | None = None
) -> list[tuple[Preset | Accuracy, float]]:
    """Every accuracy at every step [s]: the `settings` of `frontier`.

    Without `steps` the steps are `STEPS`, and for event-driven settings also `COARSE_STEPS`.
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
    """Measure error against time for one scene.

    Every setting is run, compared with the truth and timed on one thread, in turns with the others. An interruption
    (Ctrl-C) ends the measurement, not the program: the results until then are returned.

    Parameters
    ----------
    scene : Scene
    duration : float
        Simulated time [s]; of it, the largest whole multiple of the time that all steps have in common.
    settings : iterable of (str or Accuracy, float), optional
        Accuracy and step [s]; None: `ladder()`, without coarse steps if the duration is shorter than they are.
    truth : Truth, or callable, optional
        An outcome you know: `Trajectory` -> error. None: `ReferenceTruth`.
    repeats : int
        Timed runs of each setting; fewer where they take more than `BUDGET` together.
    progress : callable, optional
        (done, total, what): told before each run.

    Returns
    -------
    Frontier

    Raises
    ------
    ValueError
        A parameter out of range, or steps that have no common time within the duration.
    KeyboardInterrupt
        Interrupted before there was a truth to compare with.
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
    """As `frontier`, for contenders of any engine; without `truth`, at least one must be ours."""
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
    """Errors of one contender, and the times of its runs so far."""

    def __init__(self, contender: Contender, scene: Scene, truth: Truth | ReferenceTruth, duration: float):
        self.contender, self.steps = contender, round(duration / contender.dt)
        start = time.perf_counter()
        trajectory = contender.watch(self.steps)
        watched = time.perf_counter() - start
        with np.errstate(over="ignore", invalid="ignore"):  # what has blown up is lost, and no warning
            self.errors = {
                **truth.errors(trajectory),
                "energy": energy_error(scene, trajectory.energy),
                "penetration": deepest_penetration(scene, trajectory.pos, trajectory.quat),
            }
        self.is_lost = _is_lost(trajectory, self.errors[truth.measure], truth.scale)
        self.note = _note(trajectory)
        self.restart, self.run = contender.runner(self.steps)
        self.runs = 1
        self.first = watched  # compiles and warms up: counts only where nothing else does
        if watched < LONG_TIME or contender.engine == OURS:
            self.first = self._seconds(1)
            self.runs = 1 if self.first >= LEAST_TIME else math.ceil(LEAST_TIME / max(self._seconds(1), 1e-9))
        self.seconds: list[float] = []

    def _seconds(self, runs: int) -> float:
        """Wall-clock time of one run, mean of some [s]."""
        total = 0.0
        for _ in range(runs):
            self.restart()
            start = time.perf_counter()
            self.run()
            total += time.perf_counter() - start
        return total / runs

    def time(self) -> None:
        """Run once more, unless the runs so far took too long."""
        if sum(self.seconds) * self.runs < BUDGET:
            self.seconds.append(self._seconds(self.runs))

    def point(self) -> FrontierPoint:
        """Measured point; a contender without timed runs has its warm-up's time."""
        c, simulated = self.contender, self.steps * self.contender.dt
        costs = tuple(value / simulated for value in self.seconds or [self.first])
        return FrontierPoint(c.engine, c.setting, c.dt, self.errors, costs, self.is_lost, self.note)


def common_times(duration: float, steps: Sequence[float]) -> tuple[float, float]:
    """(duration, sample_dt) [s]: `sample_dt` is the shortest multiple of all steps, `duration` a multiple of it.

    Raises
    ------
    ValueError
        There is none within the duration, or no step.
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
    """Settings with their names in messages."""
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
    """Counter that tells a progress callback the number of finished runs."""

    def __init__(self, progress: Progress | None, total: int):
        self.progress, self.total, self.done = progress, total, 0

    def __call__(self, what: str) -> None:
        if self.progress is not None:
            self.progress(self.done, self.total, what)
        self.done += 1
