"""What the commands share: the application, options, errors as messages, progress, files."""

from __future__ import annotations

import contextlib
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

app = typer.Typer(no_args_is_help=True, add_completion=False, help="A rigid-body engine you can check.")

Json = Annotated[Path | None, typer.Option("--json", metavar="FILE", help="Write the numbers here, too.")]
Accuracy = Annotated[str, typer.Option(help="Preset: fast, balanced, precise or reference.")]


@contextlib.contextmanager
def told_errors():
    """Turn what a user can put right into a message without a traceback."""
    from gymnasium.error import DependencyNotInstalled

    try:
        yield
    except ValueError as error:
        raise typer.BadParameter(str(error)) from error
    except (DependencyNotInstalled, OSError) as error:
        typer.echo(f"Error: {error}", err=True)
        raise typer.Exit(1) from error


def progress_bar(console: Console, has_thread: bool = True) -> Progress:
    """A progress bar; without its thread, which would disturb what is measured, refresh it yourself."""
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn())
    return Progress(*columns, console=console, transient=True, auto_refresh=has_thread)


def write(path: Path | None, content: dict, console: Console) -> None:
    if path is None:
        return
    from rigid_env.measure.machine import write_json

    write_json(path, content)
    tell_file(path, console)


def tell_file(path: Path, console: Console) -> None:
    console.print(f"written     {path}", soft_wrap=True, highlight=False)
