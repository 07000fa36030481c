"""Parts of every command: the application, options, errors as messages, files."""

from __future__ import annotations

import contextlib
import signal
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from rigid_env.cli import names
from rigid_env.cli.files import output_option

INTERRUPTED = 130  # exit status after Ctrl-C, as a shell gives it

# Without markup: square brackets in a help text are printed, and an error is one line that is never framed or broken.
app = typer.Typer(
    no_args_is_help=True,
    help="A rigid-body engine you can check.",
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["--help", "-h"]},
)

Json = Annotated[Path | None, output_option("--json", ".json", help="Write the numbers here, too.")]
Accuracy = Annotated[
    str,
    typer.Option(
        help="Preset: fast, balanced, precise or reference.",
        autocompletion=names.complete_preset,
        callback=names.checked_preset,
    ),
]
SceneArgument = Annotated[
    str,
    typer.Argument(
        metavar="SCENE",
        help="A canonical scene, or a scene file (.toml, .xml or .urdf).",
        autocompletion=names.complete_scene,
    ),
]


def at_least(least: int):
    """Make a check of a least number, for an option's `callback`; the error names the value and the allowed ones."""

    def check(value: float) -> float:
        if not value >= least:
            raise typer.BadParameter(f"{value!r}; allowed are numbers from {least} on")
        return value

    return check


@contextlib.contextmanager
def told_errors():
    """Print errors that a user can mend without a traceback, and turn Ctrl-C into an exit status."""
    from gymnasium.error import DependencyNotInstalled

    try:
        yield
    except (ValueError, FileNotFoundError) as error:
        raise typer.BadParameter(str(error)) from error
    except (DependencyNotInstalled, OSError) as error:
        typer.echo(f"Error: {error}", err=True)
        raise typer.Exit(1) from error
    except KeyboardInterrupt:
        typer.echo("interrupted", err=True)
        raise typer.Exit(INTERRUPTED) from None


@contextlib.contextmanager
def ending_on_sigterm() -> Iterator[None]:
    """End the block at SIGTERM as at Ctrl-C: programs started in the background ignore SIGINT."""
    before = signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)


def collect(found: list, parts: Iterable[list]) -> bool:
    """Append each part to the list once it is measured; False if Ctrl-C came before the last."""
    try:
        for part in parts:
            found += part
    except KeyboardInterrupt:
        return False
    return True


def end(is_complete: bool, lacking: str = "") -> None:
    """Print why a measurement is incomplete, or which package a picture lacks, and exit with the status for it."""
    if lacking:
        typer.echo(f"Error: {lacking}", err=True)
    if not is_complete:
        typer.echo("interrupted: only what was measured by then is shown", err=True)
        raise typer.Exit(INTERRUPTED)
    if lacking:
        raise typer.Exit(1)


def drawable(path: Path | None, console: Console) -> tuple[Path | None, str]:
    """Return the path of a plot if matplotlib is installed, and the message for `end` if it is not.

    The message is also printed at once, before the measurement, so that a user can still stop it.
    """
    from rigid_env.lab.measure.plotting import lacks_matplotlib

    told = lacks_matplotlib() if path is not None else ""
    if told:
        console.print(f"without the plot: {told}", soft_wrap=True)
    return (None if told else path), told


def write(path: Path | None, content: dict, console: Console) -> None:
    """Write numbers and the machine that measured them as JSON, and print the path."""
    if path is None:
        return
    from rigid_env.lab.measure.machine import write_json

    write_json(path, content)
    tell_file(path, console)


def tell_file(path: Path, console: Console) -> None:
    """Print the path of a file that was written."""
    console.print(f"written     {path}", soft_wrap=True)
