"""Parts that all commands share: the application, options, error messages, written files."""

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

# No markup: square brackets in a help text are printed, and an error is one line without a frame or a break.
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
    """Make a function that refuses numbers below `least`, for the `callback` of an option; None stays None."""

    def check(value: float | None) -> float | None:
        if value is not None and not value >= least:
            raise typer.BadParameter(f"{value!r}; allowed are numbers from {least} on")
        return value

    return check


@contextlib.contextmanager
def told_errors():
    """Context manager for a command: print errors that a user can mend without a traceback, and exit with a status.

    Ctrl-C leads to the exit status `INTERRUPTED`.
    """
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
    """Context manager that treats SIGTERM like Ctrl-C, since programs started in the background ignore SIGINT."""
    before = signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)


def collect(found: list, parts: Iterable[list]) -> bool:
    """Append the rows of each part of a measurement to `found`, as soon as they are measured.

    Returns True after the last part, and False if Ctrl-C has interrupted the measurement.
    """
    try:
        for part in parts:
            found += part
    except KeyboardInterrupt:
        return False
    return True


def end(is_complete: bool, lacking: str = "") -> None:
    """End a command: print why its result is incomplete, and exit with a nonzero status in that case.

    Parameters
    ----------
    is_complete : bool
        False if Ctrl-C has interrupted the measurement.
    lacking : str
        Message about a package that a picture needs and that is missing; "": none.
    """
    if lacking:
        typer.echo(f"Error: {lacking}", err=True)
    if not is_complete:
        typer.echo("interrupted: only what was measured by then is shown", err=True)
        raise typer.Exit(INTERRUPTED)
    if lacking:
        raise typer.Exit(1)


def drawable(path: Path | None, console: Console) -> tuple[Path | None, str]:
    """Check whether a plot can be drawn, before the measurement.

    Returns the path and "" if matplotlib is installed or no plot is requested. Else it returns None and a message for
    `end`, which it also prints at once, so that a user can stop the command.
    """
    from rigid_env.lab.measure.plotting import lacks_matplotlib

    told = lacks_matplotlib() if path is not None else ""
    if told:
        console.print(f"without the plot: {told}", soft_wrap=True)
    return (None if told else path), told


def write(path: Path | None, content: dict, console: Console) -> None:
    """Write numbers as JSON to `path`, with a description of the machine, and print the path; None: write nothing."""
    if path is None:
        return
    from rigid_env.lab.measure.machine import write_json

    write_json(path, content)
    tell_file(path, console)


def tell_file(path: Path, console: Console) -> None:
    """Print the path of a file that was written."""
    console.print(f"written     {path}", soft_wrap=True)
