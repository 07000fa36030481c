"""Run of the command `rigid-env hard-cases`: its settings, the outcomes, tables and the result file."""

from __future__ import annotations

import shlex
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

from rich.console import Console

from physics import validation
from physics.accuracy import PRESETS
from rigid_env.hard_cases.case import Case, Setting
from rigid_env.lab.hard_cases import show
from rigid_env.lab.hard_cases.peers import run_peer
from rigid_env.lab.hard_cases.run import OURS, Outcome, Status, run_case
from rigid_env.lab.measure.accuracy import load_peers
from rigid_env.lab.measure.machine import write_json
from rigid_env.lab.measure.peers import ENGINES, Engine
from rigid_env.launchers.job import Job
from rigid_env.launchers.place import Place
from rigid_env.terminal import progress_bar


@dataclass(frozen=True)
class Plan:
    """Settings of a run of hard cases.

    Attributes
    ----------
    cases : tuple of Case
    accuracies : tuple of str
        Names of presets.
    dt : float
        Step for which details are shown [s].
    steps : tuple of float
        Further steps, for the table of cases and steps [s]; empty: only `dt`.
    is_thorough : bool
        False: shorter runs.
    has_peers : bool
        Whether other engines run the cases, too.
    """

    cases: tuple[Case, ...]
    accuracies: tuple[str, ...]
    dt: float
    steps: tuple[float, ...]
    is_thorough: bool
    has_peers: bool

    @property
    def settings(self) -> list[Setting]:
        """Settings for our engine: every accuracy at every step, `dt` among them."""
        steps = sorted({self.dt, *self.steps})
        return [Setting(name, dt, self.is_thorough) for name in self.accuracies for dt in steps]


def make_plan(
    cases: tuple[Case, ...], accuracy: str, dt: float, steps: str, is_thorough: bool, has_peers: bool
) -> Plan:
    """Make a plan from a user's input; `accuracy` and `steps` are lists with commas.

    Raises
    ------
    ValueError
        No such preset, or a step that is not a positive number.
    """
    accuracies = tuple(name.strip() for name in accuracy.split(",") if name.strip())
    for name in accuracies:
        validation.one_of(name, PRESETS, "accuracy")
    if not accuracies:
        raise ValueError(f"accuracy is {accuracy!r}; allowed are {', '.join(PRESETS)}, with commas")
    validation.positive(dt, (), "dt")
    try:
        grid = tuple(float(text) for text in steps.split(",") if text.strip())
    except ValueError:
        raise ValueError(f"steps is {steps!r}; allowed are numbers [s] with commas between them") from None
    for step in grid:
        validation.positive(step, (), "steps")
    return Plan(cases, accuracies, dt, grid, is_thorough, has_peers)


@dataclass(frozen=True)
class Report:
    """Outcomes of a run of hard cases.

    Attributes
    ----------
    plan : Plan
    outcomes : tuple of Outcome
        Outcomes of our engine, then those of other engines.
    is_complete : bool
        False if the run was interrupted.
    """

    plan: Plan
    outcomes: tuple[Outcome, ...] = ()
    is_complete: bool = False

    @property
    def ours(self) -> list[Outcome]:
        """Outcomes of our engine."""
        return [one for one in self.outcomes if one.engine == OURS]

    @property
    def details(self) -> list[Outcome]:
        """Outcomes of our engine at the step for which details are shown."""
        return [one for one in self.ours if one.dt == self.plan.dt]

    @property
    def beside(self) -> list[Outcome]:
        """Outcomes for the comparison of engines, sorted by case; empty without other engines.

        For each case, our outcome at the first accuracy stands before those of the other engines.
        """
        theirs = [one for one in self.outcomes if one.engine != OURS]
        first = [one for one in self.details if one.accuracy == self.plan.accuracies[0] and one.case.peers]
        return sorted([*first, *theirs], key=lambda one: one.case.number) if theirs else []

    @property
    def has_failed(self) -> bool:
        """True if a case fails in our engine at the plan's `dt`; failures at the further steps only show the limits."""
        return any(one.status is Status.FAILS for one in self.details)

    def to_dict(self) -> dict:
        """Settings and outcomes as a dict for JSON."""
        plan = self.plan
        settings = {"accuracies": plan.accuracies, "dt": plan.dt, "steps": plan.steps, "is_thorough": plan.is_thorough}
        rows = [one.to_dict() for one in self.outcomes]
        return {"name": "hard_cases", "is_complete": self.is_complete, "settings": settings, "rows": rows}


def run_and_show(console: Console, plan: Plan, keep: Path | None = None, place: Place | None = None) -> Report:
    """Run all cases of a plan with a progress bar, and print tables of the outcomes.

    `keep` is a file that is updated with all outcomes after each run. Ctrl-C ends the runs; the tables are still
    printed. With a `place`, the cases of our engine run as its jobs, one for each case and setting. A place that prints
    its jobs runs none of them.

    Raises
    ------
    ValueError
        Other engines are requested together with a place.
    """
    if place is not None and plan.has_peers:
        raise ValueError("peers is True with a launcher; allowed is one of the two: other engines run in this process")
    engines, missing = load_peers(tuple(ENGINES) if plan.has_peers else ())
    for message in missing:
        console.print(f"skipped: {message}", soft_wrap=True)
    runs, report = _runs(plan, tuple(engines.values())), Report(plan)
    if place is not None and place.is_printed:
        list(place.run([run.job(place.folder) for run in runs]))
        return Report(plan, (), is_complete=True)
    with progress_bar(console) as progress:
        task = progress.add_task("hard cases", total=len(runs))
        found: dict[str, Outcome] = {}
        try:
            ends = _here(runs, partial(progress.update, task)) if place is None else _there(runs, place)
            for name, outcome in ends:
                found[name] = outcome
                ordered = tuple(found[run.name] for run in runs if run.name in found)
                report = Report(plan, ordered, len(found) == len(runs))
                progress.update(task, completed=len(found), description=name)
                _keep(keep, report)
        except KeyboardInterrupt:
            _keep(keep, report)
    _print(console, report)
    return report


def _here(runs: Sequence[Run], tell: Callable) -> Iterator[tuple[str, Outcome]]:
    """Run cases one after the other in this process; `tell` takes the name of each run before it starts."""
    for run in runs:
        tell(description=run.name)
        yield run.name, run.call()


def _there(runs: Sequence[Run], place: Place) -> Iterator[tuple[str, Outcome]]:
    """Run cases as jobs of a launcher; a run whose worker is lost counts as failed."""
    by_name = {run.name: run for run in runs}
    for name, outcome, error, _ in place.run([run.job(place.folder) for run in runs]):
        yield name, by_name[name].lost(error) if outcome is None else outcome


def _keep(path: Path | None, report: Report) -> None:
    if path is not None:
        write_json(path, report.to_dict())


@dataclass(frozen=True)
class Run:
    """One case at one setting, in one engine: its name, and the call that returns its outcome."""

    name: str
    case: Case
    setting: Setting
    call: Callable[[], Outcome]

    def job(self, folder: Path) -> Job:
        """Make a job that does the same run in another process; its command writes a file into `folder`."""
        on = self.setting
        words = ["rigid-env", "hard-cases", str(self.case.number), "--accuracy", str(on.accuracy), "--dt", repr(on.dt)]
        words += [] if on.is_thorough else ["--quick"]
        path = folder / f"{self.case.number}-{on.accuracy}-{on.dt!r}.json"
        return Job(self.name, self.call, shlex.join([*words, "--json", str(path)]))

    def lost(self, error: str) -> Outcome:
        """Outcome of a run whose worker was lost."""
        return Outcome(self.case, OURS, str(self.setting.accuracy), self.setting.dt, Status.FAILS, (), error, 0.0)


def _runs(plan: Plan, engines: Sequence[Engine]) -> list[Run]:
    """List all runs: ours case by case, then other engines on cases that check only the motion.

    Other engines make the shorter runs, because each case is tried at all of an engine's settings.
    """
    short = Setting(dt=plan.dt, is_thorough=False)
    ours = [
        Run(f"{case.number} {case.name}, {on.accuracy}, {1e3 * on.dt:g} ms", case, on, partial(run_case, case, on))
        for case in plan.cases
        for on in plan.settings
    ]
    theirs = [
        Run(f"{case.number} {case.name}, {engine.name}", case, short, partial(run_peer, case, engine, short))
        for case in plan.cases
        for engine in engines
        if case.peers
    ]
    return ours + theirs


def _print(console: Console, report: Report) -> None:
    for accuracy in report.plan.accuracies:
        if found := [one for one in report.details if one.accuracy == accuracy]:
            console.print(show.detail_table(found, f"{accuracy}, {1e3 * report.plan.dt:g} ms"))
            console.print(f"{accuracy}: {show.summary(found)}")
    if report.plan.steps:
        console.print(show.grid_table(report.ours, "at which steps each holds"))
    if report.beside:  # this table shows the engine in place of the name of the case
        named = [replace(one, case=replace(one.case, name=f"{one.engine}, {one.accuracy}")) for one in report.beside]
        console.print(show.detail_table(named, "beside other engines"))
    if not report.is_complete:
        console.print("interrupted: what is shown is what was done")
