"""Output of programs to a terminal, a pipe or a file: a console, labelled lines, progress bars and tables."""

from rigid_env.terminal.console import counted, make_console, progress_bar, say, ticking
from rigid_env.terminal.program import run_program
from rigid_env.terminal.table import Column, Table, number_columns

__all__ = [
    "Column", "Table", "counted", "make_console", "number_columns", "progress_bar", "run_program", "say", "ticking",
]  # fmt: skip
