"""Run of the command `rigid-env hard-cases`: its settings, and the outcomes."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import product
from pathlib import Path

from rich.console import Console

from physics.work_precision.contender import OURS
from rigid_env.hard_cases.case import Case, Setting
from rigid_env.lab.hard_cases.run import Outcome, Status, run_case, run_peer
from rigid_env.lab.measure.accuracy import load_peers
from rigid_env.lab.measure.machine import write_json
from rigid_env.lab.measure.peers import ENGINES, Engine
from rigid_env.launchers.job import Job, shell_line
from rigid_env.launchers.place import Place


@dataclass
class Report:
    """Settings of a run of hard cases, and its outcomes so far.

    Parameters
    ----------
    cases : sequence of Case
    accuracies : sequence of str
        Names of presets.
    dt : float
        Step for which details are shown [s].
    steps : sequence of float
        Further steps, for the table of cases and steps [s]; empty: only `dt`.
    is_thorough : bool
        False: shorter runs.
    outcomes : list of Outcome
        Outcomes of our engine, then those of other engines.
    is_complete : bool
        False until all cases have run.
    """

    cases: Sequence[Case]
    accuracies: Sequence[str] = ("balanced",)
    dt: float = 0.01
    steps: Sequence[float] = ()
    is_thorough: bool = True
    outcomes: list[Outcome] = field(default_factory=list)
    is_complete: bool = False

    @property
    def ours(self) -> list[Outcome]:
        """Outcomes of our engine."""
        return [one for one in self.outcomes if one.engine == OURS]

    @property
    def details(self) -> list[Outcome]:
        """Outcomes of our engine at the step for which details are shown."""
        return [one for one in self.ours if one.dt == self.dt]

    @property
    def beside(self) -> list[Outcome]:
        """Outcomes for the comparison of engines, sorted by case; empty without other engines.

        For each case, our outcome at the first accuracy stands before those of the other engines.
        """
        theirs = [one for one in self.outcomes if one.engine != OURS]
        first = [one for one in self.details if one.accuracy == self.accuracies[0] and one.case.peers]
        return sorted([*first, *theirs], key=lambda one: one.case.number) if theirs else []

    @property
    def has_failed(self) -> bool:
        """True if a case fails in our engine at the step `dt`; failures at the further steps only show the limits."""
        return any(one.status is Status.FAILS for one in self.details)

    def to_dict(self) -> dict:
        """Settings and outcomes as a dict for JSON."""
        settings = {name: getattr(self, name) for name in ("accuracies", "dt", "steps", "is_thorough")}
        rows = [one.to_dict() for one in self.outcomes]
        return {"name": "hard_cases", "is_complete": self.is_complete, "settings": settings, "rows": rows}


def measure(report: Report, console: Console, place: Place, has_peers: bool = False, keep: Path | None = None) -> None:
    """Run all cases of a report at a place, in other engines, too, if `has_peers`, and keep the outcomes in it.

    The file `keep` is updated after each run. Ctrl-C ends the runs; what was done by then is kept.
    """
    engines = load_peers(tuple(ENGINES) if has_peers else (), partial(console.print, soft_wrap=True))
    runs = list(_runs(report, engines.values(), place.folder))
    lost = {job.name: outcome for job, outcome in runs}
    found: dict[str, Outcome | None] = dict.fromkeys(lost)
    report.is_complete = place.is_printed
    try:
        for name, outcome, error, _ in place.watch([job for job, _ in runs], console):
            found[name] = outcome or replace(lost[name], reason=error)
            report.outcomes = [one for one in found.values() if one]
            report.is_complete = all(found.values())
            write_json(keep, report.to_dict())
    except KeyboardInterrupt:
        write_json(keep, report.to_dict())


def _runs(report: Report, engines: Collection[Engine], folder: Path) -> Iterator[tuple[Job, Outcome]]:
    """Yield all runs as jobs, ours and then other engines' of cases that check only the motion.

    Beside each job stands its outcome in case that its process is lost. Other engines make the shorter runs, because
    each case is tried at all of an engine's settings.
    """
    steps = sorted({report.dt, *report.steps})
    settings = [Setting(name, dt, report.is_thorough) for name in report.accuracies for dt in steps]
    for case, on in product(report.cases, settings):
        name = f"{case.number} {case.name}, {on.accuracy}, {1e3 * on.dt:g} ms"
        options = {"accuracy": on.accuracy, "dt": on.dt, "quick": not on.is_thorough}
        path = folder / f"{case.number}-{on.accuracy}-{on.dt}.json"
        line = shell_line("rigid-env", "hard-cases", case.number, **options, json=path)
        yield Job(name, partial(run_case, case, on), line), Outcome(case, OURS, on.accuracy, on.dt)
    short = Setting(dt=report.dt, is_thorough=False)
    for case, engine in product([case for case in report.cases if case.peers], engines):
        job = Job(f"{case.number} {case.name}, {engine.name}", partial(run_peer, case, engine, short), "")
        yield job, Outcome(case, engine.name, "default", short.dt)
