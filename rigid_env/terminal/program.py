"""Program with one command, made from a function."""

from __future__ import annotations

import gc
import signal
from collections.abc import Callable

import typer


def run_program(main: Callable) -> None:
    """Run a function as a program: its parameters become the options of the command line, its docstring the help text.

    As in the command line `rigid-env` there is no markup: square brackets are printed, and an error is one line.
    Objects are left to the system in the end: Python would look through all of them, PyTorch's for a second. Ctrl-C in
    this last moment has nothing to say: it ends the process without a traceback.
    """
    app = typer.Typer(add_completion=False, rich_markup_mode=None, pretty_exceptions_enable=False)
    app.command()(main)
    try:
        app()
    finally:
        if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
            signal.signal(signal.SIGINT, signal.SIG_DFL)
        gc.freeze()
