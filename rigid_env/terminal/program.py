"""A program of one command."""

from __future__ import annotations

from collections.abc import Callable

import typer


def run_program(main: Callable) -> None:
    """Run a function as a program; its parameters are the command line, its docstring the help.

    Without markup, as in the command line `rigid-env`: square brackets are printed, and an error is one line.
    """
    app = typer.Typer(add_completion=False, rich_markup_mode=None, pretty_exceptions_enable=False)
    app.command()(main)
    app()
