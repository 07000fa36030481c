"""Tables of the outcomes of hard cases for a terminal."""

from __future__ import annotations

import math
from collections.abc import Sequence

from rich.text import Text

from rigid_env.hard_cases.case import AT_MOST, WITHIN
from rigid_env.lab.hard_cases.run import Outcome, Status
from rigid_env.lab.measure.table import number
from rigid_env.terminal import Column, Table, number_columns

COLOURS = {Status.HOLDS: "green", Status.FAILS: "red", Status.UNSUPPORTED: "yellow"}
MARKS = {Status.HOLDS: "✓", Status.FAILS: "✗", Status.UNSUPPORTED: "-"}
LEGEND = "✓ holds   ✗ fails   - not supported"


def came_out(outcome: Outcome) -> str:
    """Describe the check with the smallest margin: its value and limit. Without checks: the reason for having none."""
    check = outcome.tightest
    if check is None:
        return outcome.reason
    unit = f" {check.unit}" if check.unit else ""
    if check.kind == WITHIN:
        return f"{check.what}: {check.value:.7g} for {check.expected:.7g} ± {check.limit:.1e}{unit}"
    return f"{check.what}: {check.value:.2g} ({'≤' if check.kind == AT_MOST else '≥'} {check.limit:.2g}){unit}"


def margin(outcome: Outcome) -> str:
    """Smallest margin of the outcome's checks as text.

    A margin is the part of a limit that the checked value leaves unused, in percent. A value far over its limit
    (margin of -10 or less) is given as a multiple of the limit.
    """
    check = outcome.tightest
    if check is None:
        return "-"
    if not math.isfinite(check.margin):
        return "none"
    return f"{100 * check.margin:.0f} %" if check.margin > -10 else f"{1 - check.margin:.1g} times"


def detail_table(outcomes: Sequence[Outcome], title: str) -> Table:
    """Table with a row for each outcome: number, name, tightest check, required outcome, margin, time and status."""
    must = Column("what must", under="what came out, tightest check")
    columns = [
        Column("#", is_number=True), Column("case", is_whole=True), Column("what came out, tightest check"), must,
        *number_columns("margin", "time"), Column("status"),
    ]  # fmt: skip
    table = Table(columns, title)
    for one in outcomes:
        table.add_row(
            str(one.case.number), one.case.name, came_out(one), one.case.must, margin(one),
            f"{number(one.seconds)} s", Text(one.status.value, style=COLOURS[one.status]),
        )  # fmt: skip
    return table


def grid(outcomes: Sequence[Outcome]) -> tuple[list[tuple[str, float]], list[list[Outcome | None]]]:
    """Arrange outcomes by case and setting.

    Returns the settings as pairs of accuracy and step [s], and a row for each case with its outcome at each setting, or
    None where it was not run.
    """
    settings = list(dict.fromkeys((one.accuracy, one.dt) for one in outcomes))
    found: dict[int, dict] = {}
    for one in outcomes:
        found.setdefault(one.case.number, {})[one.accuracy, one.dt] = one
    return settings, [[row.get(setting) for setting in settings] for row in found.values()]


def grid_table(outcomes: Sequence[Outcome], title: str) -> Table:
    """Table with a row for each case and a column for each pair of accuracy and step."""
    settings, rows = grid(outcomes)
    names = [f"{accuracy}\n{1e3 * dt:g} ms" for accuracy, dt in settings]
    table = Table([Column("#", is_number=True), Column("case", is_whole=True), *number_columns(*names)], title, LEGEND)
    for row in rows:
        case = next(one.case for one in row if one is not None)
        marks = ["" if one is None else Text(MARKS[one.status], style=COLOURS[one.status]) for one in row]
        table.add_row(str(case.number), case.name, *marks)
    return table


def summary(outcomes: Sequence[Outcome]) -> str:
    """Text with the number of outcomes of each status."""
    counts = {status: sum(one.status is status for one in outcomes) for status in Status}
    return ", ".join(f"{count} {status.value}" for status, count in counts.items() if count)
