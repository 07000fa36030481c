"""Result of a measurement of error against time: its points, and answers from them, such as the quickest setting."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from physics import validation
from physics.html_table import fields_table, parts_table
from physics.summary import counted, fields_repr, parts_repr
from physics.work_precision import analysis as frontier_analysis
from physics.work_precision.contender import OURS, setting_name
from physics.work_precision.frontier_plot import plot_frontier


@dataclass(frozen=True)
class FrontierPoint:
    """Measured errors and times of one engine at one setting and one step.

    Attributes
    ----------
    engine, setting : str
        Names of the engine and of the setting.
    dt : float
        Length of a step [s].
    errors : dict of float
        Error by name of the measure, in its unit (see `Frontier.units`); measures that could not be taken are missing.
    costs : tuple of float
        Wall-clock time per simulated second [s] of each repeat, without compilation.
    is_lost : bool
        Whether the simulation no longer follows the truth: a state or an error is not finite, or the error exceeds
        half of the scale of the truth (`run.LOST_SHARE`).
    note : str
        Message of the engine's reports if not all are OK, else "".
    """

    engine: str
    setting: str
    dt: float
    errors: Mapping[str, float]
    costs: tuple[float, ...]
    is_lost: bool = False
    note: str = ""

    __repr__ = fields_repr
    _repr_html_ = fields_table

    @property
    def cost(self) -> float:
        """Median of `costs`: wall-clock time per simulated second [s]."""
        ordered, half = sorted(self.costs), len(self.costs) // 2
        return ordered[half] if len(ordered) % 2 else 0.5 * (ordered[half - 1] + ordered[half])

    def __str__(self) -> str:
        name = self.setting if self.engine == OURS else f"{self.engine} {self.setting}"
        return f"{name} at {1e3 * self.dt:g} ms"


@dataclass(frozen=True)
class Frontier:
    """Error against time of one scene, measured for several settings and steps.

    In all methods `measure` names an error measure, and None stands for the attribute `measure`; `engine` None stands
    for all engines.

    Attributes
    ----------
    points : tuple of FrontierPoint
        Measured points.
    measure : str
        Default error measure: ``pose`` if the truth is the reference, ``error`` if it is a `Truth`.
    units : dict of str
        Unit of each measure.
    floors : dict of float
        The truth's own error in each measure; errors at or below it cannot be told apart.
    truth : str
        Description of the truth.
    duration : float
        Simulated time [s].
    is_complete : bool
        Whether all settings were measured; False after an interruption.
    skipped : tuple of str
        Contenders that were left out, with the reasons.
    """

    points: tuple[FrontierPoint, ...]
    measure: str
    units: Mapping[str, str]
    floors: Mapping[str, float]
    truth: str
    duration: float
    is_complete: bool = True
    skipped: tuple[str, ...] = ()

    # --- points ------------------------------------------------------------------------------------------------

    def error(self, point: FrontierPoint, measure: str | None = None) -> float:
        """Error of a point in a measure, in its unit; infinite if it is missing or NaN."""
        value = point.errors.get(self._measure(measure), math.inf)
        return value if not math.isnan(value) else math.inf

    def own_error(self, measure: str | None = None) -> float:
        """The truth's own error in a measure, in its unit; 0 if the measure needs no truth (energy, penetration)."""
        return float(self.floors.get(self._measure(measure), 0.0))

    def is_at_floor(self, point: FrontierPoint, measure: str | None = None) -> bool:
        """True if a point's error is at most the truth's own error, so that its real error is unknown."""
        return self.error(point, measure) <= self.own_error(measure)

    def of(self, setting: object = None, engine: str | None = None) -> tuple[FrontierPoint, ...]:
        """Points of a setting (a name or an `Accuracy`; None: all) and an engine (None: all), coarsest step first.

        Raises
        ------
        ValueError
            No point has this setting and engine.
        """
        given: Any = setting
        name = setting if setting is None or isinstance(setting, str) else setting_name(given)
        found = [p for p in self.points if name in (None, p.setting) and engine in (None, p.engine)]
        if not found and self.points:
            known = ", ".join(dict.fromkeys(f"{p.engine} {p.setting}" for p in self.points))
            raise ValueError(f"setting is {name!r} of engine {engine!r}; allowed are those measured: {known}")
        return tuple(sorted(found, key=lambda p: -p.dt))

    def front(self, measure: str | None = None, engine: str | None = None) -> tuple[FrontierPoint, ...]:
        """Points of the Pareto front, quickest first: each is more accurate than all quicker points."""
        some = [p for p in self.of(engine=engine) if not p.is_lost]
        errors = [self.error(p, measure) for p in some]
        found = frontier_analysis.front(errors, [p.cost for p in some], self.own_error(measure))
        return tuple(some[i] for i in found)

    # --- answers -----------------------------------------------------------------------------------------------

    def cheapest(self, error: float, measure: str | None = None, engine: str | None = None) -> FrontierPoint | None:
        """Quickest point whose error is at most `error`, there and at all finer steps of its setting; else None.

        A coarse step that is right by luck is not taken. None also if `error` is below the truth's own
        error. `advice` tells the reason.
        """
        error = float(validation.positive(error, (), "error"))
        good = [p for p in self._below(error, measure, engine) if not self._finer_above(p, error, measure)]
        return good[0] if good else None

    def advice(self, error: float, measure: str | None = None, engine: str | None = None) -> str:
        """Sentence about the quickest point with an error of at most `error`, or the reason why there is none.

        It names a quicker point that is not taken because a finer step of its setting is above that error.
        """
        point, unit = self.cheapest(error, measure, engine), self.units[self._measure(measure)]
        goal = f"{error:g} {unit}".rstrip()
        quickest = next(iter(self._below(error, measure, engine)), None)
        lucky = self._told_luck(quickest, error, measure) if quickest is not None and quickest is not point else ""
        if point is not None:
            told = f"below {goal}: {point}, error {self.error(point, measure):.2g}, {1e6 * point.cost:.0f} µs per s"
            return f"{told}; not {lucky}" if lucky else told
        if self.own_error(measure) > error:
            return f"below {goal}: cannot be shown, the truth itself is known to {self.own_error(measure):.2g} only"
        if lucky:
            return f"below {goal}: no setting that was measured at all its finer steps; not {lucky}"
        front = self.front(measure, engine)
        if not front:
            return f"below {goal}: no setting that was measured; all of them are lost"
        best = self.error(front[-1], measure)
        return f"below {goal}: no setting that was measured; the best is {front[-1]}, error {best:.2g}"

    def _below(self, error: float, measure: str | None, engine: str | None) -> list[FrontierPoint]:
        """Points whose error, and that of the truth, is at most `error`, the quickest first."""
        if self.own_error(measure) > error:
            return []
        some = (p for p in self.of(engine=engine) if not p.is_lost and self.error(p, measure) <= error)
        return sorted(some, key=lambda p: (p.cost, self.error(p, measure)))

    def _finer_above(self, point: FrontierPoint, error: float, measure: str | None) -> list[FrontierPoint]:
        """Points with finer steps of the same engine and setting that are lost or above `error`, coarsest first."""
        finer = (p for p in self.of(point.setting, point.engine) if p.dt < point.dt)
        return [p for p in finer if p.is_lost or self.error(p, measure) > error]

    def _told_luck(self, point: FrontierPoint, error: float, measure: str | None) -> str:
        """Words about a point below `error` that is not taken, with the error of the next finer step above it."""
        above = self._finer_above(point, error, measure)[0]
        there = "is lost" if above.is_lost else f"has {self.error(above, measure):.2g}"
        return (
            f"{point}, error {self.error(point, measure):.2g} by luck: the finer step of {1e3 * above.dt:g} ms {there}"
        )

    def order(self, setting: object, measure: str | None = None, engine: str = OURS) -> float | None:
        """Observed order of a setting: slope of log error over log step where the error falls; None if it has none."""
        some = [p for p in self.of(setting, engine) if not p.is_lost]
        errors = [self.error(p, measure) for p in some]
        return frontier_analysis.observed_order([p.dt for p in some], errors, self.own_error(measure))

    def plateau(self, setting: object, measure: str | None = None, engine: str = OURS) -> float | None:
        """Error of a setting that smaller steps do not improve; None if the error falls to the smallest step.

        The cause is rounding, or the tolerances of the setting, or a model that differs from that of the truth.
        """
        some = [p for p in self.of(setting, engine) if not p.is_lost]
        return frontier_analysis.plateau([p.dt for p in some], [self.error(p, measure) for p in some])

    def lost_from(self, setting: object, engine: str = OURS) -> float | None:
        """Smallest step [s] such that a setting is lost at it and at all larger steps; None if there is none."""
        some = self.of(setting, engine)
        return frontier_analysis.lost_from([p.dt for p in some], [p.is_lost for p in some])

    def families(self) -> tuple[tuple[str, str], ...]:
        """All measured pairs (engine, setting), each once, in the order of the points."""
        return tuple(dict.fromkeys((p.engine, p.setting) for p in self.points))

    __repr__ = parts_repr
    _repr_html_ = parts_table

    def _parts(self) -> tuple[str, ...]:
        return (
            f"{len(self.points)} points", f"settings: {counted(p.setting for p in self.points)}",
            f"measure={self.measure!r}", f"duration={self.duration:.6g} s", f"is_complete={self.is_complete}",
            f"{len(self.skipped)} skipped", f"truth: {self.truth}",
        )  # fmt: skip

    # --- showing -----------------------------------------------------------------------------------------------

    def plot(self, path: str | Path | None = None):
        """Draw error against time, with the front as stairs.

        Parameters
        ----------
        path : str or Path, optional
            Picture to write; its ending chooses a format of matplotlib. None: no file.

        Returns
        -------
        matplotlib.figure.Figure
            Error over microseconds per simulated second, on logarithmic axes. A notebook shows it.

        Raises
        ------
        ModuleNotFoundError
            matplotlib is missing.
        """
        return plot_frontier(self, path)

    def to_dict(self) -> dict:
        """Convert the frontier to a dictionary for JSON; numbers that are not finite become None."""
        front = self.front()
        rows = [
            {
                "engine": p.engine, "setting": p.setting, "dt": p.dt, "cost": p.cost, "costs": list(p.costs),
                "errors": {name: value if math.isfinite(value) else None for name, value in p.errors.items()},
                "is_front": p in front, "is_at_floor": self.is_at_floor(p), "is_lost": p.is_lost, "note": p.note,
            }
            for p in self.points
        ]  # fmt: skip
        own = {name: value if math.isfinite(value) else None for name, value in self.floors.items()}
        return {
            "measure": self.measure, "units": dict(self.units), "truth": self.truth, "own_error": own,
            "duration": self.duration, "is_complete": self.is_complete,
            "skipped": list(self.skipped), "points": rows,
        }  # fmt: skip

    def __str__(self) -> str:
        front = self.front()
        lines = [f"{self.measure} error against time, truth: {self.truth}, known to {self.own_error():.2g}"]
        if not self.is_complete:
            lines.append("interrupted: not all settings were measured")
        for p in sorted(self.points, key=lambda p: p.cost):
            flag = "*" if p in front else "!" if p.is_lost else " "
            error = f"{self.error(p):.2g} {self.units[self.measure]}"
            lines.append(f"{flag} {error:>14}  {1e6 * p.cost:10.0f} µs per s  {p}")
        return "\n".join(lines)

    def _measure(self, measure: str | None) -> str:
        name = self.measure if measure is None else measure
        if name not in self.units:
            raise ValueError(f"measure is {name!r}; allowed are {', '.join(self.units)}")
        return name
