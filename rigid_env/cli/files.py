"""Check the paths of files that a command will write, before it computes anything.

A path must have an ending that the command writes, and must not be a folder. The file, or the nearest folder above it
that exists, must be writable.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

import typer

PICTURES = (".png", ".gif")  # of a motion
PLOTS = (".png", ".pdf", ".svg")  # of numbers


def output_option(name: str, *endings: str, help: str):
    """Make an option for a file that the command writes; the path is checked when the command line is read.

    Parameters
    ----------
    name : str
        Name of the option, as typed.
    endings : str
        Allowed endings; the help lists them if there are several.
    help : str
        Help text; it ends with a period.
    """
    text = help if len(endings) == 1 else f"{help[:-1]}: {' or '.join(endings)}."

    def check(path: Path | None) -> Path | None:
        return None if path is None else checked(path, endings)

    return typer.Option(name, metavar="FILE", help=text, callback=check)


def checked(path: Path, endings: Sequence[str]) -> Path:
    """Check that a file can be written, and return its absolute path; nothing is created.

    Devices, such as ``/dev/stdout``, need no ending.

    Raises
    ------
    typer.BadParameter
        Naming the path and what is allowed.
    """
    full = Path(os.path.abspath(path.expanduser()))
    if full.exists() and not full.is_file() and not full.is_dir():
        return full
    if full.is_dir():
        raise typer.BadParameter(f"{str(path)!r} is a folder; allowed is a file that ends in {' or '.join(endings)}")
    if full.suffix.lower() not in endings:
        raise typer.BadParameter(f"{str(path)!r} ends in {full.suffix!r}; allowed is {' or '.join(endings)}")
    nearest = _nearest(full)
    if nearest != full and not nearest.is_dir():
        raise typer.BadParameter(f"{str(path)!r} is below {str(nearest)!r}, which is a file; allowed are folders")
    if not os.access(nearest, os.W_OK):
        raise typer.BadParameter(f"{str(path)!r} cannot be written: {str(nearest)!r} is read-only")
    return full


def checked_folder(path: Path) -> Path:
    """Check that a folder exists or can be made, and return its absolute path; nothing is created.

    Raises
    ------
    typer.BadParameter
        Naming the path and what is allowed.
    """
    full = Path(os.path.abspath(path.expanduser()))
    nearest = _nearest(full)
    if not nearest.is_dir():
        raise typer.BadParameter(f"{str(path)!r} is, or is below, the file {str(nearest)!r}; allowed are folders")
    if not os.access(nearest, os.W_OK):
        raise typer.BadParameter(f"{str(path)!r} cannot be written: {str(nearest)!r} is read-only")
    return full


def make_parents(*paths: Path | None) -> None:
    """Make the missing folders above files that are about to be written; None stands for no file.

    Raises
    ------
    typer.BadParameter
        The system refuses to make a folder.
    """
    for path in paths:
        if path is None:
            continue
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise typer.BadParameter(f"{str(path)!r} cannot be written: {error}") from error


def _nearest(path: Path) -> Path:
    """The path itself, or the nearest parent that exists."""
    return next(place for place in (path, *path.parents) if place.exists())
