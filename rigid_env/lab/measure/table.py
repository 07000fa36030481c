"""Table of measurements for a terminal, and the format of its numbers."""

from __future__ import annotations

from rich.text import Text

from rigid_env.lab.measure.timing import Row, Spread
from rigid_env.terminal import Column, Table, number_columns

SCALES = ((1e6, " M"), (1e3, " k"))  # factors of large numbers, with their letters
VERDICTS = {None: Text("-"), True: Text("yes", style="green"), False: Text("no", style="red")}


def make_table(rows: list[Row], title: str, sides: tuple[str, str] = ("ours", "peer")) -> Table:
    """Table of measurements: both `sides` and their ratio as median and range, target, and whether it is reached."""
    columns = [Column("what"), Column("accuracy", is_whole=True, under="what")]
    columns += [*number_columns(*sides, "ratio", "target"), Column("pass", is_whole=True)]
    table = Table(columns, title)
    for row in rows:
        table.add_row(*cells(row))
    return table


def cells(row: Row) -> tuple[Text, ...]:
    """Cells of one row of `make_table`."""
    ratio = row.ratio
    versus = f"{row.unit}, against {row.peer_name}" if row.peer else row.unit
    return (
        _over(row.what, versus),
        Text(row.accuracy or "-"),
        two_lines(row.ours),
        two_lines(row.peer) if row.peer else Text("-"),
        two_lines(ratio, digits=4) if ratio else Text("-"),
        Text("-" if row.target is None else f"{'≥' if row.is_ratio else '≤'} {row.target:g}"),
        VERDICTS[row.is_passed],
    )


def number(value: float, digits: int = 3) -> str:
    """Text of a number with `digits` significant digits, and k for thousands or M for millions."""
    return number_range(value, value, digits)


def number_range(lowest: float, highest: float, digits: int = 3) -> str:
    """Text of a range in the format of `number`, with one letter at the end (k, M); one number if both are equal."""
    size, letter = next(((size, letter) for size, letter in SCALES if abs(highest) >= size), (1.0, ""))
    ends = dict.fromkeys(f"{value / size:.{digits}g}" for value in (lowest, highest))
    return "..".join(ends) + letter


def two_lines(spread: Spread, digits: int = 3) -> Text:
    """Text of two lines: the median, and below it the lowest and highest sample."""
    if len(spread.samples) == 1:
        return Text(number(spread.median, digits))
    return _over(number(spread.median, digits), number_range(spread.lowest, spread.highest, digits))


def _over(first: str, second: str) -> Text:
    return Text.assemble(first, "\n", (second, "dim"))
