"""Classes of hard cases: a case with a known outcome, the setting that it is run at, and the checks of its result."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal

import physics
from physics.accuracy import resolve
from physics.annotations import Preset


class UnsupportedError(Exception):
    """Error of a case that cannot run at a setting; the message gives the reason. It never counts as a pass."""


@dataclass(frozen=True)
class Check:
    """Measured number of a hard case, and the condition that it must satisfy.

    Parameters
    ----------
    what : str
        Description of the number, such as "drift of the apex, 10,000 bounces".
    value : float
        Measured value. For a condition of yes or no it is the number of violations, which must be `at most` 0.
    limit : float
        ``at most``: value <= limit. ``at least``: value >= limit. ``within``: |value - expected| <= limit.
    unit : str
        Unit of `value`, `limit` and `expected`; empty for a pure number.
    kind : str
        ``at most``; the functions `at_least` and `within` make checks of the other kinds.
    expected : float
        Known outcome, for ``within``.
    """

    what: str
    value: float
    limit: float
    unit: str = ""
    kind: Literal["at most", "at least", "within"] = "at most"
    expected: float = 0.0

    def __post_init__(self):
        for name in ("value", "limit", "expected"):
            object.__setattr__(self, name, float(getattr(self, name)))

    @property
    def margin(self) -> float:
        """Unused share of the limit: 1 without an error, 0 at the limit, negative beyond it, -inf for NaN or infinity.

        For ``at least``: excess of the value over the limit, as a share of the limit, 1 at most. A limit of 0 gives 1
        if it is met, else -inf.
        """
        size = abs(self.value - self.expected) if self.kind == "within" else self.value
        room = size - self.limit if self.kind == "at least" else self.limit - size
        if not math.isfinite(room) or (self.limit == 0.0 and room < 0.0):
            return -math.inf
        return min(1.0, room / self.limit) if self.limit else 1.0

    @property
    def passes(self) -> bool:
        """True if the value satisfies its condition; NaN and infinity never do."""
        return self.margin >= 0.0

    def __str__(self) -> str:
        """Value with its limit, such as "depth: 1.2e-09 (≤ 1e-08) m"."""
        unit = f" {self.unit}" if self.unit else ""
        if self.kind == "within":
            return f"{self.what}: {self.value:.7g} for {self.expected:.7g} ± {self.limit:.1e}{unit}"
        return f"{self.what}: {self.value:.2g} ({'≤' if self.kind == 'at most' else '≥'} {self.limit:.2g}){unit}"


def within(what: str, value: float, expected: float, limit: float, unit: str = "") -> Check:
    """Make the check |value - expected| <= limit."""
    return Check(what, value, limit, unit, "within", expected)


def at_least(what: str, value: float, limit: float, unit: str = "") -> Check:
    """Make the check value >= limit."""
    return Check(what, value, limit, unit, "at least")


def none_of(what: str, wrong: int | bool) -> Check:
    """Make the check that `wrong`, a number of violations or a flag, is 0."""
    return Check(what, float(wrong), 0.0)


@dataclass(frozen=True)
class Setting:
    """Accuracy, step and engine at which a hard case is run.

    Parameters
    ----------
    accuracy : str or physics.Accuracy
        Name of a preset, or all settings.
    dt : float
        Step [s].
    is_thorough : bool
        False: a shorter run of the same kind, for tests; a case derives its limits for the length of its run.
    maker : callable, optional
        Function (scene, dt) that makes a world of another engine. It behaves like a `physics.World` of one world: pos,
        quat, linvel, angvel, step, time. None: our engine.
    """

    accuracy: Preset | physics.Accuracy = "balanced"
    dt: float = 0.01
    is_thorough: bool = True
    maker: Callable[[physics.Scene, float], object] | None = None

    def world(self, scene: physics.Scene, worlds: int = 1) -> physics.World:
        """Make worlds of a scene at this setting.

        Raises
        ------
        UnsupportedError
            Our engine has no plan for this scene at this accuracy, or the other engine cannot express the scene.
        """
        if self.maker is not None:
            return self.maker(scene, self.dt)
        accuracy = resolve(self.accuracy)  # an unknown preset is an error, and no reason for "not supported"
        try:
            physics.make_plan(scene, accuracy)
        except ValueError as error:
            raise UnsupportedError(str(error)) from error
        return physics.World(scene, worlds=worlds, dt=self.dt, accuracy=self.accuracy)

    @property
    def is_event_driven(self) -> bool:
        """True if our engine locates events, so that outcomes do not depend on the length of the step.

        At such a setting, scenes whose bodies touch each other use error control, which takes long. Quick runs of these
        scenes are smaller.
        """
        return self.maker is None and resolve(self.accuracy).scheme == "events"

    @property
    def is_ours(self) -> bool:
        """True for our engine, which has reports, contact forces and parameters to check."""
        return self.maker is None

    @property
    def tolerance(self) -> float:
        """`Accuracy.tolerance`, relative to the free contact speed; the same for other engines."""
        return resolve(self.accuracy).tolerance

    @property
    def slop(self) -> float:
        """`Accuracy.slop`, the gap that counts as touching, in bounding radii; the same for other engines."""
        return resolve(self.accuracy).slop

    def steps(self, duration: float) -> int:
        """Smallest number of steps that take at least `duration` [s], up to rounding."""
        return max(1, math.ceil(duration / self.dt * (1 - 4 * math.ulp(1.0))))

    def pick(self, thorough, quick):
        """Return `thorough` in a thorough run, else `quick`."""
        return thorough if self.is_thorough else quick


@dataclass(frozen=True)
class Case:
    """Hard case: a scene with a known outcome, and the function that runs and checks it.

    Parameters
    ----------
    number : int
        Number in the list of hard cases.
    name : str
        Name for the command line: lower case, with hyphens.
    title : str
        Short description of the situation.
    must : str
        Known outcome in one line, with its closed form.
    run : callable
        Function from a `Setting` to checks. Its docstring derives outcome and tolerance and gives the source. It may
        raise `UnsupportedError`.
    peers : bool
        Whether `run` uses only state, time and `step`, so that other engines can run the case, too.
    faults : mapping of str to str
        Presets at which the case is known to fail at a step of 10 ms, with the reason. The case is run anyway and shown
        as failing. A test expects the failure, and fails itself once the case passes.
    """

    number: int
    name: str
    title: str
    must: str
    run: Callable[[Setting], Sequence[Check]]
    peers: bool = False
    faults: Mapping[str, str] = field(default_factory=dict)
