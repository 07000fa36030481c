"""Outcomes of hard cases as tables: in a terminal and in Markdown."""

from __future__ import annotations

import math
from collections.abc import Sequence

from rich.text import Text

from rigid_env.lab.hard_cases.case import WITHIN, Check
from rigid_env.lab.hard_cases.run import Outcome, Status
from rigid_env.lab.measure.table import number
from rigid_env.terminal import Column, Table, number_columns

COLOURS = {Status.HOLDS: "green", Status.FAILS: "red", Status.UNSUPPORTED: "yellow", Status.MISSING: "yellow"}
MARKS = {Status.HOLDS: "✓", Status.FAILS: "✗", Status.UNSUPPORTED: "-", Status.MISSING: "·"}
LEGEND = "✓ holds   ✗ fails   - not supported   · not built"


def came_out(outcome: Outcome) -> str:
    """Describe the check with the least margin; else the reason why there is none."""
    check = outcome.tightest
    if check is None:
        return outcome.reason
    unit = f" {check.unit}" if check.unit else ""
    return f"{check.what}: {_held(check)}{unit}"


def _held(check: Check) -> str:
    if check.kind == WITHIN:
        return f"{check.value:.7g} for {check.expected:.7g} ± {check.limit:.1e}"
    sign = "≤" if check.kind == "at most" else "≥"
    return f"{check.value:.2g} ({sign} {check.limit:.2g})"


def margin(outcome: Outcome) -> str:
    """Share of the tightest limit that is left."""
    check = outcome.tightest
    if check is None:
        return "-"
    if not math.isfinite(check.margin):
        return "none"
    return f"{100 * check.margin:.0f} %" if check.margin > -10 else f"{1 - check.margin:.1g} times"


def detail_table(outcomes: Sequence[Outcome], title: str) -> Table:
    """Number, name, what came out, what must, margin, time, status; a row per outcome."""
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


def grid_table(outcomes: Sequence[Outcome], title: str) -> Table:
    """A row per case, a column per accuracy and step."""
    settings = list(dict.fromkeys((one.accuracy, one.dt) for one in outcomes))
    names = [f"{accuracy}\n{1e3 * dt:g} ms" for accuracy, dt in settings]
    columns = [Column("#", is_number=True), Column("case", is_whole=True), *number_columns(*names)]
    table = Table(columns, title, LEGEND)
    for row in _rows(outcomes):
        found = {(one.accuracy, one.dt): one.status for one in row}
        marks = [Text(MARKS[found[key]], style=COLOURS[found[key]]) if key in found else "" for key in settings]
        table.add_row(str(row[0].case.number), row[0].case.name, *marks)
    return table


def _rows(outcomes: Sequence[Outcome]) -> list[list[Outcome]]:
    """Outcomes by case, in the order of the first of each."""
    rows: dict[int, list[Outcome]] = {}
    for one in outcomes:
        rows.setdefault(one.case.number, []).append(one)
    return list(rows.values())


def summary(outcomes: Sequence[Outcome]) -> str:
    """Count those that hold, fail, and so on."""
    counts = {status: sum(one.status is status for one in outcomes) for status in Status}
    return ", ".join(f"{count} {status.value}" for status, count in counts.items() if count)


# --- Markdown ------------------------------------------------------------------------------------------------------


def markdown_table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """A table; bars in cells are escaped."""
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join("| " + " | ".join(str(cell).replace("|", "\\|") for cell in line) + " |" for line in lines)


def markdown_detail(outcomes: Sequence[Outcome]) -> str:
    """Number, case, what must and what came out, margin, status."""
    rows = [
        (one.case.number, f"`{one.case.name}`: {one.case.title}", one.case.must, came_out(one), margin(one),
         f"**{one.status.value}**" if one.status is Status.FAILS else one.status.value)
        for one in outcomes
    ]  # fmt: skip
    return markdown_table(("#", "case", "what must come out", "what came out, tightest check", "margin", ""), rows)


def markdown_grid(outcomes: Sequence[Outcome]) -> str:
    """A row per case, a column per accuracy and step."""
    columns = list(dict.fromkeys((one.accuracy, one.dt) for one in outcomes))
    rows = []
    for row in _rows(outcomes):
        found = {(one.accuracy, one.dt): MARKS[one.status] for one in row}
        rows.append((row[0].case.number, row[0].case.name, *(found.get(key, "") for key in columns)))
    return markdown_table(("#", "case", *(f"{accuracy}, {1e3 * dt:g} ms" for accuracy, dt in columns)), rows)
