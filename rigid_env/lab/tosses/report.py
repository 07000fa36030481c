"""Measurements of ``rigid-env tosses``: fits, errors at each accuracy, and the sources of these errors."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import asdict, dataclass, field

import numpy as np

from physics.accuracy import PRESETS
from rigid_env.lab.tosses import data
from rigid_env.lab.tosses.data import Tosses
from rigid_env.lab.tosses.fit import NOMINAL, Effort, Fit, Objective, check_names, fit
from rigid_env.lab.tosses.flight import Flight, disturb, measure_flight, rest_scale
from rigid_env.lab.tosses.limits import Limits, find_limits
from rigid_env.lab.tosses.metric import Errors, Summary, compare
from rigid_env.lab.tosses.replay import Cube, Recording, replay, starts, sunken

CONTACT = ("friction", "restitution")
BODY = (*CONTACT, "inertia", "side")
HEAVY = ("heavy_x", "heavy_y", "heavy_z")
MASS = (*CONTACT, "inertia", *HEAVY)
HEADLINE = "contact and mass"

REPEATS = 3  # repeats of a timed replay; fewer if they take longer than `PATIENCE`
PATIENCE = 2.0  # [s]
NOISE_REPEATS = 5  # disturbed starts per toss

TARGETS = {"position_mean": 0.125, "rotation_mean": 16.0}  # [cube widths, deg]
# Other engines, with friction and contact parameters fitted in the same way on the 400 tosses: mean position error
# [cube widths] and mean rotation error [deg] over all 400.
PEERS = {"MuJoCo": (0.133, 19.5), "Drake": (0.135, 17.5), "PyBullet": (0.145, 16.8)}


@dataclass(frozen=True)
class Setup:
    """Description of one fit: its parameters, the model of the recording, and the values of the other parameters."""

    name: str
    parameters: tuple[str, ...]
    recording: Recording
    nominal: Cube = NOMINAL


@dataclass(frozen=True)
class Case:
    """Result of one fit: its parameters, and its errors at the accuracy of the fit.

    Attributes
    ----------
    setup : Setup
    fit : Fit
    trained, rest, every : Summary
        Errors of the fitted tosses, of the others, and of all.
    lifted : int
        Number of tosses that would have started below the table, of all.
    """

    setup: Setup
    fit: Fit
    trained: Summary
    rest: Summary
    every: Summary
    lifted: int

    def to_dict(self) -> dict:
        """Result as a dict for JSON."""
        return {
            "name": self.setup.name, "recording": vars(self.setup.recording), "fit": self.fit.to_dict(),
            "trained": asdict(self.trained), "rest": asdict(self.rest), "all": asdict(self.every),
            "lifted": self.lifted,
        }  # fmt: skip


@dataclass(frozen=True)
class Rung:
    """Errors of the main fit's parameters at one accuracy.

    Attributes
    ----------
    accuracy : str
        Preset.
    rest, every : Summary
        Errors of the tosses that were not fitted, and of all.
    us : float
        Wall-clock time per simulated second [µs], in batches.
    """

    accuracy: str
    rest: Summary
    every: Summary
    us: float

    def to_dict(self) -> dict:
        """Errors as a dict for JSON."""
        return {
            "accuracy": self.accuracy, "rest": asdict(self.rest), "all": asdict(self.every),
            "us_per_simulated_second": self.us,
        }  # fmt: skip


@dataclass
class Report:
    """All measurements of a run; `cases` and `ladder` grow while it runs."""

    tosses: Tosses
    accuracy: str
    seed: int
    flight: Flight
    scale: float
    cases: list[Case] = field(default_factory=list)
    ladder: list[Rung] = field(default_factory=list)
    limits: Limits | None = None

    @property
    def is_complete(self) -> bool:
        """True if no fit was interrupted."""
        return all(case.fit.is_complete for case in self.cases)

    def to_dict(self) -> dict:
        """Measurements as a dict for JSON."""
        return {
            "tosses": len(self.tosses), "frames": len(self.tosses.states), "fit_accuracy": self.accuracy,
            "split_seed": self.seed, "training_share": data.TRAINING_SHARE, "is_complete": self.is_complete,
            "flight": asdict(self.flight), "length_scale": self.scale,
            "cases": [case.to_dict() for case in self.cases], "ladder": [rung.to_dict() for rung in self.ladder],
            "limits": self.limits and self.limits.to_dict(), "targets": TARGETS,
            "peers_at_all": {name: {"position_mean": p, "rotation_mean": r} for name, (p, r) in PEERS.items()},
        }  # fmt: skip


def setups(scale: float, flight: Flight, names: tuple[str, ...] | None = None) -> list[Setup]:
    """List the fits: the main one, two variants of it, and simpler ones; or a single fit of the parameters `names`.

    The fit "flights' centre of mass" takes the centre of mass from the free flights, so that it is not fitted to any
    error. `scale` is the ratio of true to recorded lengths.
    """
    if names is not None:
        return [Setup(", ".join(check_names(names)), tuple(names), Recording())]
    return [
        Setup("contact", CONTACT, Recording()),
        Setup("flights' centre of mass", CONTACT, Recording(), Cube(**dict(zip(HEAVY, flight.center_of_mass)))),
        Setup("contact and cube", BODY, Recording()),
        Setup(HEADLINE, MASS, Recording()),
        Setup("lengths corrected", MASS, Recording(length_scale=scale)),
        Setup("start half a frame on", MASS, Recording(is_midframe=True)),
    ]


class Measurement:
    """Measurement of a `Report`, step by step.

    Parameters
    ----------
    tosses : Tosses
    accuracy : str
        Preset at which parameters are fitted.
    effort : Effort
    seed : int
        Seed of the split into fitted tosses and the rest.
    threads : int
    names : tuple of str, optional
        Fit only these parameters, once.
    """

    def __init__(self, tosses: Tosses, accuracy: str = "balanced", effort: Effort | None = None,
                 seed: int = data.SPLIT_SEED, threads: int = 1, names: tuple[str, ...] | None = None):  # fmt: skip
        self.effort, self.threads = effort or Effort(), threads
        self.fitted, self.others = data.split(len(tosses), seed)
        self.training = tosses.subset(self.fitted)
        scale = rest_scale(self.training)
        flight = measure_flight(self.training)
        self.report = Report(tosses, accuracy, seed, flight, scale)
        self.setups = setups(scale, flight, names)

    def evaluations(self) -> int:
        """Largest number of evaluations of all fits together."""
        return sum(self.effort.evaluations(len(setup.parameters)) for setup in self.setups)

    def run(self, tick: Callable[[str, int], None] = lambda what, done: None) -> Report:
        """Fit each setup, then measure errors at each accuracy and their sources; returns the report.

        ``tick`` is called with the name of the finished part and a number of evaluations. After Ctrl-C no other setup
        is fitted, and errors are measured only at the accuracy of the fit, so that the run ends soon.
        """
        for setup in self.setups:
            case = self._case(setup, lambda best, what=setup.name: tick(f"{what}: {best:.4f}", 1))
            self.report.cases.append(case)
            if not case.fit.is_complete:
                break
        self._measure_ladder(tick)
        self._measure_limits()
        return self.report

    def headline(self) -> Case:
        """Result of the main fit, or of the last one if the main fit was not made."""
        cases = self.report.cases
        return next((case for case in cases if case.setup.name == HEADLINE), cases[-1])

    def errors(self, cube: Cube, recording: Recording, accuracy: str) -> tuple[Errors, np.ndarray, float]:
        """Errors of all tosses, poses of their replay, and wall-clock time per simulated second [µs]."""
        tosses = self.report.tosses
        poses, us = replay(tosses.lengths, starts(tosses, cube, recording), cube, accuracy, self.threads)
        return compare(recording.lengths(tosses.states), poses, tosses.offsets), poses, us

    def _case(self, setup: Setup, tick: Callable[[float], None]) -> Case:
        report = self.report
        objective = Objective(
            self.training, setup.recording, report.flight, self.effort, report.accuracy, self.threads
        )  # fmt: skip
        found = fit(objective, setup.parameters, self.effort, tick, setup.nominal)
        errors, _, _ = self.errors(found.cube, setup.recording, report.accuracy)
        lifted = int((sunken(starts(report.tosses, found.cube, setup.recording), found.cube) > 0.0).sum())
        return Case(
            setup, found, errors.summary(self.fitted), errors.summary(self.others), errors.summary(), lifted
        )  # fmt: skip

    def _measure_ladder(self, tick: Callable[[str, int], None]) -> None:
        case = self.headline()
        for accuracy in PRESETS if self.report.is_complete else (self.report.accuracy,):
            tick(f"accuracy {accuracy}", 0)
            self._compile(accuracy)
            runs, begin = [], time.perf_counter()
            while not runs or (len(runs) < REPEATS and time.perf_counter() - begin < PATIENCE):
                runs.append(self.errors(case.fit.cube, case.setup.recording, accuracy))
            us = float(np.median([run[2] for run in runs]))
            errors = runs[0][0]
            self.report.ladder.append(Rung(accuracy, errors.summary(self.others), errors.summary(), us))

    def _compile(self, accuracy: str) -> None:
        """Simulate one step of one toss, so that timed runs contain no compilation."""
        begin = starts(self.training.subset([0]), self.headline().fit.cube, Recording())
        replay(np.array([2]), begin, self.headline().fit.cube, accuracy, self.threads)

    def _measure_limits(self) -> None:
        case, report = self.headline(), self.report
        cube, recording = case.fit.cube, case.setup.recording
        errors, poses, _ = self.errors(cube, recording, report.accuracy)
        begin = starts(report.tosses, cube, recording)
        disturbed = []
        rng = np.random.default_rng(self.effort.seed)
        for _ in range(NOISE_REPEATS):
            other, _ = replay(
                report.tosses.lengths, disturb(begin, report.flight, rng), cube, report.accuracy, self.threads
            )
            disturbed.append(compare(poses, other, report.tosses.offsets))
        report.limits = find_limits(report.tosses, self.others, errors, poses, disturbed)
