"""The command `rigid-env hard-cases`: run, show, and keep what came out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from rich.console import Console

from physics import validation
from physics.plan import accuracy as knobs
from rigid_env.extras import install_line
from rigid_env.lab.hard_cases import peers as others
from rigid_env.lab.hard_cases import show
from rigid_env.lab.hard_cases.case import Case, Setting
from rigid_env.lab.hard_cases.run import OURS, Outcome, Status, run_all
from rigid_env.lab.measure.machine import write_json
from rigid_env.terminal import progress_bar


@dataclass(frozen=True)
class Plan:
    """Settings of a run of hard cases.

    Attributes
    ----------
    cases : tuple of Case
    accuracies : tuple of str
        Presets.
    dt : float
        The step at which details are shown [s].
    steps : tuple of float
        Further steps, for the table of which hold where [s]; empty: `dt` alone.
    is_thorough : bool
    has_peers : bool
    """

    cases: tuple[Case, ...]
    accuracies: tuple[str, ...]
    dt: float
    steps: tuple[float, ...]
    is_thorough: bool
    has_peers: bool

    @property
    def settings(self) -> list[Setting]:
        """Every accuracy at every step, `dt` among them."""
        steps = sorted({self.dt, *self.steps})
        return [Setting(name, dt, self.is_thorough) for name in self.accuracies for dt in steps]


def make_plan(
    cases: tuple[Case, ...], accuracy: str, dt: float, steps: str, is_thorough: bool, has_peers: bool
) -> Plan:
    """From what a user types: names and numbers with commas between them.

    Raises
    ------
    ValueError
        No such preset, or a step that is not a positive number.
    """
    accuracies = tuple(name.strip() for name in accuracy.split(",") if name.strip())
    for name in accuracies:
        validation.one_of(name, knobs.PRESETS, "accuracy")
    if not accuracies:
        raise ValueError(f"accuracy is {accuracy!r}; allowed are {', '.join(knobs.PRESETS)}, with commas")
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
    outcomes, peers : tuple of Outcome
        Ours, and those of other engines.
    is_complete : bool
        False: interrupted.
    """

    plan: Plan
    outcomes: tuple[Outcome, ...]
    peers: tuple[Outcome, ...]
    is_complete: bool

    @property
    def details(self) -> list[Outcome]:
        """Ours at the step at which details are shown."""
        return [one for one in self.outcomes if one.dt == self.plan.dt]

    @property
    def has_failed(self) -> bool:
        """True if a case of ours fails at that step; coarser and finer ones are there to show where it ends."""
        return any(one.status is Status.FAILS for one in self.details)

    def to_dict(self) -> dict:
        """JSON-able."""
        plan = self.plan
        settings = {"accuracies": plan.accuracies, "dt": plan.dt, "steps": plan.steps, "is_thorough": plan.is_thorough}
        rows = [one.to_dict() for one in (*self.outcomes, *self.peers)]
        return {"name": "hard_cases", "is_complete": self.is_complete, "settings": settings, "rows": rows}


def run_and_show(console: Console, plan: Plan, keep: Path | None = None) -> Report:
    """Run all of it with a progress bar; print tables; after every outcome of ours `keep` holds all so far.

    Other engines make the shorter runs: all their settings are tried.
    """
    engines, missing = others.load_engines() if plan.has_peers else ({}, [])
    if missing:
        console.print(f"without {', '.join(missing)}, not installed: {install_line('peers')}", soft_wrap=True)
    peer_runs = len(engines) * sum(case.peers for case in plan.cases)
    done, theirs = [], []
    total = len(plan.cases) * len(plan.settings)
    with progress_bar(console) as progress:
        task = progress.add_task("hard cases", total=total + peer_runs)

        def tick(what: str) -> None:
            progress.update(task, description=what)

        for outcome in run_all(plan.cases, plan.settings, tick):
            done.append(outcome)
            progress.advance(task)
            if keep is not None:
                write_json(keep, Report(plan, tuple(done), (), False).to_dict())
        if len(done) == total:
            setting = Setting(dt=plan.dt, is_thorough=False)
            for outcome in others.run_peers(plan.cases, list(engines.values()), setting, tick):
                theirs.append(outcome)
                progress.advance(task)
    is_complete = len(done) == total and len(theirs) == peer_runs
    report = Report(plan, tuple(done), tuple(theirs), is_complete)
    if keep is not None:
        write_json(keep, report.to_dict())
    _print(console, report)
    return report


def _print(console: Console, report: Report) -> None:
    for accuracy in report.plan.accuracies:
        found = [one for one in report.details if one.accuracy == accuracy]
        if found:
            console.print(show.detail_table(found, f"{accuracy}, {1e3 * report.plan.dt:g} ms"))
            console.print(f"{accuracy}: {show.summary(found)}")
    if report.plan.steps:
        console.print(show.grid_table(report.outcomes, "at which steps each holds"))
    if report.peers:
        console.print(show.detail_table(_beside(report), "beside other engines"))
    if not report.is_complete:
        console.print("interrupted: what is shown is what was done")


def _beside(report: Report) -> Sequence[Outcome]:
    """Ours at the first accuracy and theirs, case by case; the engine stands for the name of the case."""
    first = report.plan.accuracies[0]
    ours = [one for one in report.details if one.accuracy == first and one.case.peers]
    rows = sorted([*ours, *report.peers], key=lambda one: (one.case.number, one.engine != OURS))
    return [replace(one, case=replace(one.case, name=f"{one.engine}, {one.accuracy}")) for one in rows]
