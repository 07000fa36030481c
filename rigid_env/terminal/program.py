"""Program with one command, made from a function."""

from __future__ import annotations

from collections.abc import Callable

import typer


def run_program(main: Callable) -> None:
    """Run a function as a program: its parameters become the options of the command line, its docstring the help text.

    As in the command line `rigid-env` there is no markup: square brackets are printed, and an error is one line.
    """
    app = typer.Typer(add_completion=False, rich_markup_mode=None, pretty_exceptions_enable=False)
    app.command()(main)
    app()
