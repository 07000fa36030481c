"""Tables that stay readable at any width of the terminal.

A number is never broken or cut. If a table is too wide, columns with `Column.under` move below other columns. If it is
still too wide, every row becomes a list of lines "name  value".
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

from rich import box
from rich.console import Console, ConsoleOptions, RenderResult
from rich.table import Table as RichTable
from rich.text import Text

READABLE = 16  # least width of a column whose text is broken into lines [characters]
GAP = 2  # space between columns [characters]

Cell = str | Text


@dataclass(frozen=True)
class Column:
    """Column of a `Table`: its header, and how its cells may be laid out.

    Attributes
    ----------
    name : str
        Header. Line breaks in it are kept.
    is_number : bool
        True: cells are aligned right, and never broken.
    is_whole : bool
        True: cells are never broken.
    under : str, optional
        Name of another column; in a table that is too wide, the cells of this column go below those of the other one.
    """

    name: str
    is_number: bool = False
    is_whole: bool = False
    under: str | None = None

    @property
    def may_break(self) -> bool:
        """True if a cell of the column may be broken into several lines."""
        return not (self.is_number or self.is_whole)


def number_columns(*names: str) -> list[Column]:
    """Make columns of numbers with these names."""
    return [Column(name, is_number=True) for name in names]


class Table:
    """Rows of cells under named columns, laid out for the width of the console that prints it.

    Parameters
    ----------
    columns : sequence of Column or str
        A name alone is a column of text.
    title, caption : str
        Lines above and below the table; "": none.
    """

    def __init__(self, columns: Sequence[Column | str], title: str = "", caption: str = ""):
        self.columns = [Column(column) if isinstance(column, str) else column for column in columns]
        self.title, self.caption = title, caption
        self.rows: list[list[Text]] = []

    @property
    def row_count(self) -> int:
        """Number of rows."""
        return len(self.rows)

    def add_row(self, *cells: Cell, style: str = "") -> None:
        """Add a row with one cell for each column, as plain text or as styled `rich.text.Text`.

        Raises
        ------
        ValueError
            The number of cells is not the number of columns.
        """
        if len(cells) != len(self.columns):
            raise ValueError(f"cells are {len(cells)}; allowed are {len(self.columns)}, one for each column")
        row = [cell.copy() if isinstance(cell, Text) else Text(cell) for cell in cells]
        for cell in row:
            cell.stylize_before(style)
        self.rows.append(row)

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> RenderResult:
        """Yield title, rows and caption for rich, in the widest layout that fits."""
        if self.title:
            yield Text(self.title, style="italic")
        for columns, rows in ((self.columns, self.rows), _stacked(self.columns, self.rows)):
            widths = _widths(columns, rows, options.max_width)
            if widths is not None:
                yield _grid(columns, rows, widths)
                break
        else:
            yield from _listed(self.columns, self.rows)
        if self.caption:
            yield Text(self.caption, style="dim")


def _widths(columns: Sequence[Column], rows: Sequence[Sequence[Text]], available: int) -> list[int] | None:
    """Widths of the columns for a line of `available` characters, or None if a number or a word would be broken."""
    naturals = [max(map(_line_width, texts)) for texts in _by_column(columns, rows)]
    widths = [
        max(_word_width(texts), min(natural, READABLE)) if column.may_break else natural
        for column, texts, natural in zip(columns, _by_column(columns, rows), naturals)
    ]
    spare = available - sum(widths) - GAP * (len(columns) - 1)
    if spare < 0:
        return None
    for _ in range(min(spare, sum(naturals) - sum(widths))):  # widen the column with the most lines
        k = max(range(len(widths)), key=lambda k: naturals[k] / max(widths[k], 1))
        widths[k] += 1
    return widths


def _by_column(columns: Sequence[Column], rows: Sequence[Sequence[Text]]) -> list[list[Text]]:
    return [[Text(column.name), *(row[k] for row in rows)] for k, column in enumerate(columns)]


def _word_width(texts: Iterable[Text]) -> int:
    return max((Text(word).cell_len for text in texts for word in text.plain.split()), default=0)


def _line_width(text: Text) -> int:
    return max((line.cell_len for line in text.split("\n")), default=0)


def _stacked(columns: Sequence[Column], rows: Sequence[Sequence[Text]]) -> tuple[list[Column], list[list[Text]]]:
    """Columns and rows after each column with an `under` has become further lines of the other column."""
    kept = [k for k, column in enumerate(columns) if column.under is None]
    names = [column.name for column in columns]

    def merged(cells: Sequence[Text]) -> list[Text]:
        lines = {k: [cells[k]] for k in kept}
        for column, cell in zip(columns, cells):
            if column.under is not None and cell.plain:
                lines[names.index(column.under)].append(cell)
        return [Text("\n").join(parts) for parts in lines.values()]

    heads = merged([Text(name) for name in names])
    renamed = [replace(columns[k], name=head.plain) for k, head in zip(kept, heads)]
    return renamed, [merged(row) for row in rows]


def _grid(columns: Sequence[Column], rows: Sequence[Sequence[Text]], widths: Sequence[int]) -> RichTable:
    grid = RichTable(box=box.SIMPLE_HEAD, show_edge=False, pad_edge=False, padding=(0, GAP - 1, 0, 0))
    for column, width in zip(columns, widths):
        side = "right" if column.is_number else "left"
        grid.add_column(Text(column.name), justify=side, no_wrap=not column.may_break, width=width)
    for row in rows:
        grid.add_row(*row)
    return grid


def _listed(columns: Sequence[Column], rows: Iterable[Sequence[Text]]) -> Iterator[RichTable | Text]:
    """Yield the rows as lists of lines "name  value", one line for each cell."""
    names = [Text(" ".join(column.name.split()), style="bold") for column in columns]
    for row in rows:
        lines = RichTable.grid(padding=(0, GAP, 0, 0))
        lines.add_column(width=max(name.cell_len for name in names), no_wrap=True)
        lines.add_column(overflow="fold")
        for name, cell in zip(names, row):
            lines.add_row(name, cell if cell.plain else "-")
        yield lines
        yield Text("")
