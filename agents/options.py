"""Options that several commands share, and the file that ``--json`` writes."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated, Any

import typer

from rigid_env.cli.files import output_option
from rigid_env.cli.names import checked_preset

RUN_HELP = "Folder of a run; code in its model.zip runs while it is read: take it from those you trust only."
RunArgument = Annotated[Path | None, typer.Argument(metavar="RUN_DIR", help=RUN_HELP)]
BaselineOption = Annotated[str | None, typer.Option(help="Instead of a run: random or controller.")]
EnvOption = Annotated[str, typer.Option(help="Of the baseline.")]
SeedOption = Annotated[int, typer.Option(min=0, help="Chooses the episodes: the same number, the same ones.")]
AccuracyOption = Annotated[str | None, typer.Option(help="Preset of the engine.", callback=checked_preset)]
JsonOption = Annotated[Path | None, output_option("--json", ".json", help="Write the numbers here, too.")]


def write_json(path: Path, content: dict[str, Any]) -> None:
    """Write a dict as JSON; makes a missing folder."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps(content, indent=2) + "\n", encoding="utf-8")
