"""Console and progress bars of all programs."""

from __future__ import annotations

import os

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn
from rich.table import Table
from rich.text import Text

# Width in a pipe or a file, where nothing sets one: no line is longer, so that none is broken [characters].
UNBROKEN = 10_000
LABEL_WIDTH = 11  # of the labels that `say` prints [characters]


def make_console(is_error: bool = False) -> Console:
    """Make a console on standard output, or on standard error, that prints text as it is.

    Square brackets and colons mean nothing to it: a unit such as ``[s]`` is printed. A terminal sets the width, or the
    variable ``COLUMNS``. Without either, in a pipe or a file, no line is broken.
    """
    console = Console(markup=False, emoji=False, highlight=False, stderr=is_error)
    if console.is_terminal or os.environ.get("COLUMNS", "").isdigit():
        return console
    return Console(markup=False, emoji=False, highlight=False, stderr=is_error, width=UNBROKEN)


def progress_bar(console: Console, has_thread: bool = True) -> Progress:
    """Make a progress bar that disappears at its end.

    Parameters
    ----------
    console : Console
    has_thread : bool
        Whether a thread redraws it. One would disturb a measurement: without it, update with ``refresh=True``.
    """
    description = TextColumn("{task.description}", markup=False)
    columns = (description, BarColumn(), MofNCompleteColumn(), TimeElapsedColumn())
    is_hidden = not console.is_terminal
    return Progress(*columns, console=console, transient=True, auto_refresh=has_thread, disable=is_hidden)


def say(console: Console, label: str, text: str | Text) -> None:
    """Print a line with a label; in a narrow terminal, further lines begin under its text."""
    line = Table.grid(padding=(0, 1, 0, 0))
    line.add_column(width=LABEL_WIDTH, no_wrap=True)
    line.add_column(overflow="fold")
    line.add_row(Text(label), text if isinstance(text, Text) else Text(text))
    console.print(line)
