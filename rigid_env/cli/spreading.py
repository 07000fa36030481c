"""Options of commands that can run their jobs in many processes or on many machines."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from rigid_env.cli.common import at_least
from rigid_env.launchers import LAUNCHERS
from rigid_env.launchers.place import Place

Launcher = Annotated[
    str | None,
    typer.Option(help=f"Spread it: {', '.join(LAUNCHERS)}.", show_default="one after the other, in this process"),
]
Jobs = Annotated[int, typer.Option(callback=at_least(1), help="Of --launcher: how many at once.")]
Address = Annotated[str | None, typer.Option(help="Of a Ray cluster, or a Slurm partition (local: none).")]


def make_place(launcher: str | None, at_once: int, address: str | None, json: Path | None) -> Place:
    """Make the place of a command's jobs; files that they write go into a folder named like `json`.

    Raises
    ------
    ValueError
        There is no such launcher, or `address` is given without one.
    """
    if launcher is None and address is not None:
        raise ValueError(f"address is {address!r} without a launcher; allowed with --launcher ray or submitit")
    folder = json.with_suffix("") if json is not None else Path("rigid-env-jobs")
    return Place(launcher, folder, at_once, address)
