"""Tables of the outcomes of hard cases for a terminal, and their picture."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

from rich.console import Console
from rich.text import Text

from rigid_env.hard_cases.case import Case
from rigid_env.lab.hard_cases.report import Report
from rigid_env.lab.hard_cases.run import Outcome, Status
from rigid_env.lab.measure.plotting import make_figure
from rigid_env.lab.measure.table import number
from rigid_env.terminal import Column, Table, number_columns

COLOURS = {Status.HOLDS: "green", Status.FAILS: "red", Status.UNSUPPORTED: "yellow"}
MARKS = {Status.HOLDS: "✓", Status.FAILS: "✗", Status.UNSUPPORTED: "-"}
RED, GREY, NOTHING = (0.75, 0.22, 0.17, 1.0), (0.85, 0.85, 0.85, 1.0), (1.0, 1.0, 1.0, 0.0)
LEGEND = "✓ holds   ✗ fails   - not supported"
NUMBER_AND_NAME = Column("#", is_number=True), Column("case", is_whole=True)


def show(report: Report, console: Console) -> None:
    """Print a report: details for each accuracy, then the tables of further steps and of other engines, if any."""
    for accuracy in report.accuracies:
        if found := [one for one in report.details if one.accuracy == accuracy]:
            console.print(detail_table(found, f"{accuracy}, {1e3 * report.dt:g} ms"))
            console.print(f"{accuracy}: {summary(found)}")
    if report.steps and report.ours:
        console.print(grid_table(report.ours, "at which steps each holds"))
    if report.beside:
        console.print(detail_table(report.beside, "beside other engines", has_engines=True))
    if not report.is_complete:
        console.print("interrupted: what is shown is what was done")


def margin(outcome: Outcome) -> str:
    """Smallest margin of the outcome's checks in percent, or as a multiple of the limit if a value is far over it."""
    if not outcome.checks:
        return "-"
    least = outcome.tightest.margin
    if not math.isfinite(least):
        return "none"
    return f"{100 * least:.0f} %" if least > -10 else f"{1 - least:.1g} times"


def detail_table(outcomes: Sequence[Outcome], title: str, has_engines: bool = False) -> Table:
    """Table with a row for each outcome: number, name, tightest check, required outcome, margin, time and status.

    With `has_engines`, the engine and its setting stand in place of the name of the case.
    """
    what = "what came out, tightest check"
    columns = [*NUMBER_AND_NAME, what, Column("what must", under=what), *number_columns("margin", "time"), "status"]
    table = Table(columns, title)
    for one in outcomes:
        name = f"{one.engine}, {one.accuracy}" if has_engines else one.case.name
        table.add_row(
            str(one.case.number), name, one.came_out, one.case.must, margin(one), f"{number(one.seconds)} s",
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
    table = Table([*NUMBER_AND_NAME, *number_columns(*names)], title, LEGEND)
    for case, row in rows:
        marks = [Text(MARKS[one.status], style=COLOURS[one.status]) if one else "" for one in row]
        table.add_row(str(case.number), case.name, *marks)
    return table


def summary(outcomes: Sequence[Outcome]) -> str:
    """Text with the number of outcomes of each status."""
    counts = {status: sum(one.status is status for one in outcomes) for status in Status}
    return ", ".join(f"{count} {status.value}" for status, count in counts.items() if count)


def write_picture(path: Path, outcomes: Sequence[Outcome]) -> None:
    """Draw a square for each case and setting: green by its margin if the case holds, red if it fails.

    Raises
    ------
    gymnasium.error.DependencyNotInstalled
        matplotlib is missing.
    """
    settings, rows = grid(outcomes)
    figure = make_figure(3.2 + 0.42 * len(settings), 1.6 + 0.22 * len(rows))
    axes = figure.subplots()
    axes.pcolormesh([[_colour(one) for one in row] for _, row in rows], edgecolors="white", linewidth=4)
    axes.invert_yaxis()
    middles = [k + 0.5 for k in range(max(len(rows), len(settings)))]
    axes.set_yticks(middles[: len(rows)], [f"{case.number} {case.name}" for case, _ in rows], fontsize=7)
    axes.set_xticks(middles[: len(settings)], [f"{a} {1e3 * dt:g} ms" for a, dt in settings], fontsize=7, rotation=90)
    axes.set_title("green: holds (pale: little margin)   red: fails   grey: not supported", fontsize=8)
    axes.tick_params(length=0)
    axes.set_frame_on(False)
    figure.savefig(path, dpi=130)


def _colour(outcome: Outcome | None) -> tuple[float, ...]:
    """Colour of an outcome (red, green, blue, opacity)."""
    if outcome is None:
        return NOTHING
    if outcome.status is Status.HOLDS:
        return (0.0, 0.5, 0.3, 0.25 + 0.75 * outcome.tightest.margin)
    return RED if outcome.status is Status.FAILS else GREY
