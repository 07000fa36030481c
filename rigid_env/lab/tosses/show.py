"""Print the report on tosses in a terminal."""

from __future__ import annotations

from rich.console import Console
from rich.text import Text

from rigid_env.lab.measure.table import VERDICTS
from rigid_env.lab.tosses.limits import Limits
from rigid_env.lab.tosses.metric import Summary
from rigid_env.lab.tosses.report import PEERS, TARGETS, Case, Report
from rigid_env.terminal import Column, Table, number_columns

ERRORS = "position\nmean", "position\nmedian", "rotation\nmean", "rotation\nmedian"


def show(report: Report, case: Case, console: Console) -> None:
    """Print a report; `case` is the fit to which its ladder and limits belong."""
    first = report.cases[0]
    console.print(
        f"{len(report.tosses)} tosses, {first.trained.tosses} of them fitted at {report.accuracy} (split seed "
        f"{report.seed}), errors over the other {first.rest.tosses} and over all"
    )
    if not report.is_complete:
        console.print(Text.assemble(("interrupted", "yellow"), ": the last fit is the best found until then"))
    console.print(case_table(report))
    for one in report.cases:
        console.print(f"{one.setup.name}: {_parameters(one)}")
    console.print(ladder_table(report, case))
    console.print(limits_table(report.limits))
    _show_flight(report, console)


def _pair(summary: Summary) -> tuple[str, ...]:
    """Text of mean and median of the position error, and of the rotation error."""
    return (
        f"{summary.position_mean:.4f}", f"{summary.position_median:.4f}", f"{summary.rotation_mean:.2f}",
        f"{summary.rotation_median:.2f}",
    )  # fmt: skip


def _table(title: str, *names: str) -> Table:
    return Table([Column(names[0]), *number_columns(*names[1:])], title)


def case_table(report: Report) -> Table:
    """Table of errors for each fit, over the fitted tosses, the rest and all, with those of other engines below."""
    title = "over tosses: position error [cube widths], rotation error [degrees]"
    table = _table(title, "fit", "tosses", *ERRORS, "target")
    for case in report.cases:
        for name, summary in (("fitted", case.trained), ("rest", case.rest), ("all", case.every)):
            is_good = summary.position_mean <= TARGETS["position_mean"]
            is_good = is_good and summary.rotation_mean <= TARGETS["rotation_mean"]
            verdict = VERDICTS[is_good] if name == "rest" else ""
            table.add_row(case.setup.name if name == "fitted" else "", name, *_pair(summary), verdict)
    for name, (position, rotation) in PEERS.items():
        table.add_row(name, "all", f"{position:.3f}", "", f"{rotation:.1f}", "", "", style="dim")
    return table


def _parameters(case: Case) -> str:
    values = ", ".join(f"{name} {getattr(case.fit.cube, name):.5g}" for name in case.fit.names)
    return f"{values}; {case.lifted} tosses lifted onto the table"


def ladder_table(report: Report, case: Case) -> Table:
    """Table of errors over the tosses that were not fitted, and of computing times, at each accuracy."""
    title = f"the parameters of {case.setup.name!r}, rest, at each accuracy"
    table = _table(title, "accuracy", *ERRORS, "µs per\nsimulated s")
    for rung in report.ladder:
        table.add_row(rung.accuracy, *_pair(rung.rest), f"{rung.us:.0f}")
    return table


def limits_table(limits: Limits) -> Table:
    """Table of errors from the noise of the start alone, and of the tosses that end on the measured or another face."""
    table = _table("what limits it", "rest", "tosses", *ERRORS)
    rows = (
        ("noise of the first frame alone", limits.noise), ("ends on the measured face", limits.landed),
        ("ends on another face", limits.missed),
    )  # fmt: skip
    for name, summary in rows:
        if summary is not None:
            table.add_row(name, str(summary.tosses), *_pair(summary))
    return table


def _show_flight(report: Report, console: Console) -> None:
    flight = report.flight
    center = ", ".join(f"{1e3 * value:.1f}" for value in flight.center_of_mass)
    console.print(
        f"free flight  gravity {flight.gravity:.3f} m/s² in recorded lengths; true per recorded length at rest "
        f"{report.scale:.4f}; centre of mass at ({center}) mm from the tracked centre, body frame"
    )
