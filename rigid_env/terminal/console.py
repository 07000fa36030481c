"""Console, labelled lines and progress bars, the same for all programs."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn
from rich.table import Table
from rich.text import Text

# Width of output to a pipe or a file, larger than any line, so that no line is broken [characters].
UNBROKEN = 10_000
LABEL_WIDTH = 11  # width of the labels that `say` prints [characters]


def make_console(is_error: bool = False) -> Console:
    """Make a console on standard output, or on standard error, that prints text as it is.

    Square brackets and colons have no special meaning: a unit such as ``[s]`` is printed. The terminal or the variable
    ``COLUMNS`` sets the width. Without either, in a pipe or a file, no line is broken.
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
        Whether a thread redraws it. A thread would disturb a measurement; without it, call `update` with
        ``refresh=True``.
    """
    description = TextColumn("{task.description}", markup=False)
    columns = (description, BarColumn(), MofNCompleteColumn(), TimeElapsedColumn())
    is_hidden = not console.is_terminal
    return Progress(*columns, console=console, transient=True, auto_refresh=has_thread, disable=is_hidden)


@contextmanager
def ticking(console: Console, what: str, total: int) -> Iterator[Callable[[str], None]]:
    """Context manager of a progress bar for a measurement, which no thread disturbs.

    Yields a function that counts one of `total` parts, and shows its text in place of `what`.
    """
    with progress_bar(console, has_thread=False) as progress:
        task = progress.add_task(what, total=total)
        yield lambda text: progress.update(task, advance=1, description=text, refresh=True)


def counted(count: int, noun: str) -> str:
    """Return a number with its noun: "1 trial", "2 trials"."""
    return f"{count:,} {noun}{'' if count == 1 else 's'}"


def say(console: Console, label: str, text: str | Text) -> None:
    """Print a line with a label on the left; where a terminal breaks the line, the rest is aligned with the text."""
    line = Table.grid(padding=(0, 1, 0, 0))
    line.add_column(width=LABEL_WIDTH, no_wrap=True)
    line.add_column(overflow="fold")
    line.add_row(Text(label), text if isinstance(text, Text) else Text(text))
    console.print(line)
