"""Options that several commands share, and the file that ``--json`` writes."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated, Any

import typer

from rigid_env.cli.common import at_least
from rigid_env.cli.files import checked_folder, output_option
from rigid_env.cli.names import checked_preset

RUN_HELP = "Folder of a run; code in its model.zip runs while it is read: take it from those you trust only."
RunArgument = Annotated[Path | None, typer.Argument(metavar="RUN_DIR", help=RUN_HELP)]
BaselineOption = Annotated[str | None, typer.Option(help="Instead of a run: random or controller.")]
EnvOption = Annotated[str, typer.Option(help="Of the baseline.")]
SeedOption = Annotated[
    int, typer.Option(callback=at_least(0), help="Chooses the episodes: the same number, the same ones.")
]
AccuracyOption = Annotated[str | None, typer.Option(help="Preset of the engine.", callback=checked_preset)]
JsonOption = Annotated[Path | None, output_option("--json", ".json", help="Write the numbers here, too.")]


def folder_option(help: str, show_default: bool | str = True) -> Any:
    """Make an option for a folder, which is checked when the command line is read, and stays as it was typed."""

    def check(path: Path | None) -> Path | None:
        if path is not None:
            checked_folder(path)
        return path

    return typer.Option(metavar="DIR", help=help, callback=check, show_default=show_default)


def make_folders(**folders: Path) -> None:
    """Make the folders of options, given by the names of the options, where they are missing.

    Raises
    ------
    typer.BadParameter
        The system refuses; the message names the option.
    """
    for name, path in folders.items():
        try:
            path.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            told = f"--{name} is {str(path)!r}, which cannot be made: {error.strerror}"
            raise typer.BadParameter(f"{told}; allowed is a folder that you may make and write into") from error


def write_json(path: Path, content: dict[str, Any]) -> None:
    """Write a dict as JSON; makes a missing folder."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps(content, indent=2) + "\n", encoding="utf-8")
