"""Print the outcomes of hard cases in a terminal."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

from rich.console import Console
from rich.text import Text

from rigid_env.hard_cases.case import Case
from rigid_env.lab.hard_cases.report import Report
from rigid_env.lab.hard_cases.run import Outcome, Status
from rigid_env.lab.measure.table import number
from rigid_env.terminal import Column, Table, number_columns

COLOURS = {Status.HOLDS: "green", Status.FAILS: "red", Status.UNSUPPORTED: "yellow"}
MARKS = {Status.HOLDS: "✓", Status.FAILS: "✗", Status.UNSUPPORTED: "-"}
LEGEND = "✓ holds   ✗ fails   - not supported"


def show(report: Report, console: Console) -> None:
    """Print a report: details for each accuracy, then the tables of further steps and of other engines, if any."""
    for accuracy in report.accuracies:
        if found := [one for one in report.details if one.accuracy == accuracy]:
            console.print(detail_table(found, f"{accuracy}, {1e3 * report.dt:g} ms"))
            console.print(f"{accuracy}: {summary(found)}")
    if report.steps and report.ours:
        console.print(grid_table(report.ours, "at which steps each holds"))
    if report.beside:
        console.print(detail_table(report.beside, "beside other engines", lambda one: f"{one.engine}, {one.accuracy}"))
    if not report.is_complete:
        console.print("interrupted: what is shown is what was done")


def margin(outcome: Outcome) -> str:
    """Smallest margin of the outcome's checks as text.

    A margin is the part of a limit that the checked value leaves unused, in percent. A value far over its limit
    (margin of -10 or less) is given as a multiple of the limit.
    """
    if not outcome.checks:
        return "-"
    least = outcome.tightest.margin
    if not math.isfinite(least):
        return "none"
    return f"{100 * least:.0f} %" if least > -10 else f"{1 - least:.1g} times"


def detail_table(
    outcomes: Sequence[Outcome], title: str, name: Callable[[Outcome], str] = lambda one: one.case.name
) -> Table:
    """Table with a row for each outcome: number, name, tightest check, required outcome, margin, time and status."""
    must = Column("what must", under="what came out, tightest check")
    columns = [
        Column("#", is_number=True), Column("case", is_whole=True), Column("what came out, tightest check"), must,
        *number_columns("margin", "time"), Column("status"),
    ]  # fmt: skip
    table = Table(columns, title)
    for one in outcomes:
        table.add_row(
            str(one.case.number), name(one), one.came_out, one.case.must, margin(one), f"{number(one.seconds)} s",
            Text(one.status.value, style=COLOURS[one.status]),
        )  # fmt: skip
    return table


def grid(outcomes: Sequence[Outcome]) -> tuple[list[tuple[str, float]], list[tuple[Case, list[Outcome | None]]]]:
    """Arrange outcomes by case and setting.

    Returns the settings as pairs of accuracy and step [s], and each case with its outcome at each setting, or None
    where it was not run.
    """
    settings = list(dict.fromkeys((one.accuracy, one.dt) for one in outcomes))
    found = {(one.case.number, one.accuracy, one.dt): one for one in outcomes}
    cases = {one.case.number: one.case for one in outcomes}
    return settings, [(case, [found.get((number, *on)) for on in settings]) for number, case in cases.items()]


def grid_table(outcomes: Sequence[Outcome], title: str) -> Table:
    """Table with a row for each case and a column for each pair of accuracy and step."""
    settings, rows = grid(outcomes)
    names = [f"{accuracy}\n{1e3 * dt:g} ms" for accuracy, dt in settings]
    table = Table([Column("#", is_number=True), Column("case", is_whole=True), *number_columns(*names)], title, LEGEND)
    for case, row in rows:
        marks = [Text(MARKS[one.status], style=COLOURS[one.status]) if one else "" for one in row]
        table.add_row(str(case.number), case.name, *marks)
    return table


def summary(outcomes: Sequence[Outcome]) -> str:
    """Text with the number of outcomes of each status."""
    counts = {status: sum(one.status is status for one in outcomes) for status in Status}
    return ", ".join(f"{count} {status.value}" for status, count in counts.items() if count)
