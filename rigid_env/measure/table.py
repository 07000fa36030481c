"""Rows of measurements as a table in a terminal."""

from __future__ import annotations

from rich.table import Table

from rigid_env.measure.timing import Row, Spread


def make_table(rows: list[Row], title: str) -> Table:
    """What, ours, peer, ratio (median and range), target, and whether it is reached."""
    table = Table(title=title, title_justify="left")
    table.add_column("what")
    table.add_column("accuracy")
    for name in ("ours", "peer", "ratio", "target"):
        table.add_column(name, justify="right")
    table.add_column("pass")
    for row in rows:
        table.add_row(*cells(row))
    return table


def cells(row: Row) -> tuple[str, ...]:
    """The columns of `make_table` as text."""
    ratio = row.ratio
    return (
        row.what,
        row.accuracy or "-",
        f"{number(row.ours.median)} {row.unit}\n{extent(row.ours)}",
        f"{number(row.peer.median)} {row.peer_name}\n{extent(row.peer)}" if row.peer else "-",
        f"{ratio.median:.1f}\n{extent(ratio)}" if ratio else "-",
        _target(row),
        {None: "-", True: "[green]yes[/green]", False: "[red]no[/red]"}[row.is_passed],
    )


def number(value: float) -> str:
    """Three or four digits, with k and M for large numbers."""
    for size, letter in ((1e6, " M"), (1e3, " k")):
        if abs(value) >= size:
            return f"{value / size:.3g}{letter}"
    return f"{value:.3g}"


def extent(spread: Spread) -> str:
    """Lowest to highest sample."""
    return f"({number(spread.lowest)} .. {number(spread.highest)})"


def _target(row: Row) -> str:
    if row.target is None:
        return "-"
    return f"≥ {row.target:g}" if row.is_ratio else f"≤ {row.target:g} {row.unit}"
