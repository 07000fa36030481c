"""Rows of measurements as a table in a terminal."""

from __future__ import annotations

from rich import box
from rich.console import Console
from rich.table import Table

from rigid_env.measure.timing import Row, Spread

LEAST_WIDTH = 112  # of the table where no terminal sets it [characters]


def make_console() -> Console:
    """A console on standard output, wide enough for `make_table` when it is a file or a pipe."""
    console = Console()
    return console if console.is_terminal else Console(width=max(LEAST_WIDTH, console.width))


def make_table(rows: list[Row], title: str) -> Table:
    """What, ours, peer, ratio (each the median over the range), target, and whether it is reached."""
    table = Table(title=title, title_justify="left", box=box.SIMPLE_HEAD)
    table.add_column("what", min_width=22)
    table.add_column("accuracy")
    for name in ("ours", "peer", "ratio", "target"):
        table.add_column(name, justify="right", no_wrap=True)
    table.add_column("pass")
    for row in rows:
        table.add_row(*cells(row))
    return table


def cells(row: Row) -> tuple[str, ...]:
    """The columns of `make_table` as text."""
    ratio = row.ratio
    versus = f"\n[dim]{row.unit}, against {row.peer_name}[/dim]" if row.peer else f"\n[dim]{row.unit}[/dim]"
    return (
        row.what + versus,
        row.accuracy or "-",
        two_lines(row.ours),
        two_lines(row.peer) if row.peer else "-",
        two_lines(ratio) if ratio else "-",
        "-" if row.target is None else f"{'≥' if row.is_ratio else '≤'} {row.target:g}",
        {None: "-", True: "[green]yes[/green]", False: "[red]no[/red]"}[row.is_passed],
    )


def number(value: float) -> str:
    """Three digits, with k and M for large numbers."""
    for size, letter in ((1e6, " M"), (1e3, " k")):
        if abs(value) >= size:
            return f"{value / size:.3g}{letter}"
    return f"{value:.3g}"


def two_lines(spread: Spread) -> str:
    """The median, and below it lowest and highest sample."""
    if len(spread.samples) == 1:
        return number(spread.median)
    return f"{number(spread.median)}\n[dim]{number(spread.lowest)} .. {number(spread.highest)}[/dim]"
