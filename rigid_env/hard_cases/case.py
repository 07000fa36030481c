"""Hard cases: each has a known outcome, and a run that compares the engine with it."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

import physics
from physics.accuracy import resolve
from physics.annotations import Preset
from physics.plan.plan import make_plan

AT_MOST, AT_LEAST, WITHIN = "at most", "at least", "within"


class UnsupportedError(Exception):
    """Error of a case that cannot be expressed at a setting; the message says why. It never counts as a pass."""


@dataclass(frozen=True)
class Check:
    """One number of an outcome, and the condition that it must obey.

    Parameters
    ----------
    what : str
        What was measured: "drift of the apex, 10,000 bounces".
    value : float
        What came out. Where a yes or no is asked: a count of those that went wrong, `at most` 0.
    limit : float
        ``at most``: value <= limit. ``at least``: value >= limit. ``within``: |value - expected| <= limit.
    unit : str
        Of `value` and `limit`; empty for a pure number.
    kind : str
        `AT_MOST`, `AT_LEAST` or `WITHIN`.
    expected : float
        For ``within``.
    """

    what: str
    value: float
    limit: float
    unit: str = ""
    kind: str = AT_MOST
    expected: float = 0.0

    def __post_init__(self):
        if self.kind not in (AT_MOST, AT_LEAST, WITHIN):
            raise ValueError(f"Check.kind is {self.kind!r}; allowed are {AT_MOST!r}, {AT_LEAST!r}, {WITHIN!r}")
        for name in ("value", "limit", "expected"):
            object.__setattr__(self, name, float(getattr(self, name)))

    @property
    def passes(self) -> bool:
        """True if the value obeys its condition; NaN never does."""
        if self.kind == AT_LEAST:
            return self.value >= self.limit
        return self.distance <= self.limit

    @property
    def distance(self) -> float:
        """Number that is compared with the limit: the distance from the expected value, or the value itself."""
        return abs(self.value - self.expected) if self.kind == WITHIN else self.value

    @property
    def margin(self) -> float:
        """Unused share of the limit: 1 for no error, 0 at the limit, negative beyond it; -inf if not finite.

        For ``at least``: by how much of the limit the value is above it. A limit of 0 leaves 1 (met) or -inf.
        """
        if not math.isfinite(self.distance):
            return -math.inf
        if self.limit == 0.0:
            return 1.0 if self.passes else -math.inf
        share = self.distance / self.limit
        return share - 1.0 if self.kind == AT_LEAST else min(1.0, 1.0 - share)


def within(what: str, value: float, expected: float, limit: float, unit: str = "") -> Check:
    """|value - expected| <= limit."""
    return Check(what, value, limit, unit, WITHIN, expected)


def at_least(what: str, value: float, limit: float, unit: str = "") -> Check:
    """Value >= limit."""
    return Check(what, value, limit, unit, AT_LEAST)


def none_of(what: str, wrong: int | bool) -> Check:
    """Check that a count of faults, `wrong`, is 0."""
    return Check(what, float(wrong), 0.0)


@dataclass(frozen=True)
class Setting:
    """Accuracy, step and engine with which a case is run.

    Parameters
    ----------
    accuracy : str or physics.Accuracy
        A preset's name, or knobs of one's own.
    dt : float
        Step [s].
    is_thorough : bool
        False: a shorter run of the same kind (for tests); the limits are derived for the length that is run.
    maker : callable, optional
        (scene, dt) -> what looks like a `physics.World` of one world (pos, quat, linvel, angvel, step, time): another
        engine's. None: ours.
    """

    accuracy: Preset | physics.Accuracy = "balanced"
    dt: float = 0.01
    is_thorough: bool = True
    maker: Callable[[physics.Scene, float], object] | None = None

    def world(self, scene: physics.Scene, worlds: int = 1) -> physics.World:
        """A world of the scene at this setting.

        Raises
        ------
        UnsupportedError
            There is no plan for this scene at this accuracy, or the other engine cannot express it.
        """
        if self.maker is not None:
            return self.maker(scene, self.dt)
        try:
            make_plan(scene, resolve(self.accuracy))
        except ValueError as error:
            raise UnsupportedError(str(error)) from error
        return physics.World(scene, worlds=worlds, dt=self.dt, accuracy=self.accuracy)

    @property
    def is_event_driven(self) -> bool:
        """True if events are located, so that outcomes do not depend on the step.

        Bodies that touch each other are stepped to an error then, which is dear: quick runs are smaller.
        """
        return self.maker is None and resolve(self.accuracy).scheme == "events"

    @property
    def is_ours(self) -> bool:
        """True for our own engine, which has reports, contact forces and parameters to check."""
        return self.maker is None

    @property
    def tolerance(self) -> float:
        """`Accuracy.tolerance`, relative to the free contact speed; the same for other engines."""
        return resolve(self.accuracy).tolerance

    @property
    def slop(self) -> float:
        """`Accuracy.slop`, the gap that counts as none, in bounding radii; the same for other engines."""
        return resolve(self.accuracy).slop

    def steps(self, duration: float) -> int:
        """Whole steps that take at least `duration` [s], to rounding."""
        return max(1, math.ceil(duration / self.dt * (1 - 4 * np.finfo(float).eps)))

    def pick(self, thorough, quick):
        """Return the first value in a thorough run, else the second."""
        return thorough if self.is_thorough else quick


@dataclass(frozen=True)
class Case:
    """A hard case.

    Parameters
    ----------
    number : int
        In the list of hard cases.
    name : str
        For the command line: lower case, with hyphens.
    title : str
        What it is, a few words.
    must : str
        What must come out, one line with the closed form.
    run : callable
        Setting -> checks. Its docstring derives outcome and tolerance and gives the source. It may raise
        `UnsupportedError`.
    peers : bool
        Whether `run` looks at nothing but state, time and `step`, so that other engines can be held against it.
    faults : mapping
        Name of a preset -> why the case does not hold there at a step of 10 ms, as found. It is run all the same, and
        shown as failing; a test expects that it fails, and fails itself when it does not any more.
    """

    number: int
    name: str
    title: str
    must: str
    run: Callable[[Setting], Sequence[Check]]
    peers: bool = False
    faults: Mapping[str, str] = field(default_factory=dict)
