"""The report in a terminal."""

from __future__ import annotations

from rich import box
from rich.console import Console
from rich.table import Table

from rigid_env.tosses.metric import Summary
from rigid_env.tosses.report import PEERS, TARGETS, Case, Report


def show(report: Report, case: Case, console: Console) -> None:
    """Print a report; `case` is the one that its ladder and limits are about."""
    first = report.cases[0]
    console.print(
        f"{len(report.tosses)} tosses, {first.trained.tosses} of them fitted at {report.accuracy} (split seed "
        f"{report.seed}), errors over the other {first.rest.tosses} and over all"
    )
    if not report.is_complete:
        console.print("[yellow]interrupted[/yellow]: the last fit is the best found until then")
    console.print(_case_table(report))
    for one in report.cases:
        console.print(f"{one.setup.name}: {_parameters(one)}", highlight=False)
    console.print(_ladder_table(report, case))
    _show_limits(report, console)


def _pair(summary: Summary) -> tuple[str, ...]:
    """Mean and median of position and rotation, as text."""
    return (
        f"{summary.position_mean:.4f}", f"{summary.position_median:.4f}", f"{summary.rotation_mean:.2f}",
        f"{summary.rotation_median:.2f}",
    )  # fmt: skip


def _table(title: str, *names: str) -> Table:
    table = Table(title=title, title_justify="left", box=box.SIMPLE_HEAD)
    table.add_column(names[0])
    for name in names[1:]:
        table.add_column(name, justify="right")
    return table


def _case_table(report: Report) -> Table:
    title = "mean and median over tosses of position error (cube widths) and rotation error (degrees)"
    table = _table(title, "what was fitted", "tosses", "position", "median", "rotation", "median", "target")
    for case in report.cases:
        for name, summary in (("fitted", case.trained), ("rest", case.rest), ("all", case.every)):
            is_good = summary.position_mean <= TARGETS["position_mean"]
            is_good = is_good and summary.rotation_mean <= TARGETS["rotation_mean"]
            verdict = {True: "[green]yes[/green]", False: "[red]no[/red]"}[is_good] if name == "rest" else ""
            table.add_row(case.setup.name if name == "fitted" else "", name, *_pair(summary), verdict)
    for name, (position, rotation) in PEERS.items():
        table.add_row(f"[dim]{name}[/dim]", "all", f"{position:.3f}", "", f"{rotation:.1f}", "", "")
    return table


def _parameters(case: Case) -> str:
    values = ", ".join(f"{name} {getattr(case.fit.cube, name):.5g}" for name in case.fit.names)
    return f"{values}; {case.lifted} tosses lifted onto the table"


def _ladder_table(report: Report, case: Case) -> Table:
    table = _table(
        f"the parameters of {case.setup.name!r}, rest, at each accuracy", "accuracy", "position", "median",
        "rotation", "median", "µs per simulated s",
    )  # fmt: skip
    for rung in report.ladder:
        table.add_row(rung.accuracy, *_pair(rung.rest), f"{rung.us:.0f}")
    return table


def _show_limits(report: Report, console: Console) -> None:
    limits, flight = report.limits, report.flight
    table = _table("what limits it", "rest", "tosses", "position", "median", "rotation", "median")
    rows = (
        ("noise of the first frame alone", limits.noise), ("ends on the measured face", limits.landed),
        ("ends on another face", limits.missed),
    )  # fmt: skip
    for name, summary in rows:
        if summary is not None:
            table.add_row(name, str(summary.tosses), *_pair(summary))
    console.print(table)
    center = ", ".join(f"{1e3 * value:.1f}" for value in flight.center_of_mass)
    console.print(
        f"free flight  gravity {flight.gravity:.3f} m/s² in recorded lengths; true per recorded length at rest "
        f"{report.scale:.4f}; centre of mass at ({center}) mm from the tracked centre, body frame",
        highlight=False,
    )
