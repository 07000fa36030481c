"""Options of commands whose parts can run in many processes or on many machines."""

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


def make_place(launcher: str | None, at_once: int, address: str | None, json: Path | None) -> Place | None:
    """Return where jobs run, None for this process; their files go beside `json`, in a folder of its name.

    Raises
    ------
    ValueError
        If there is no such launcher, or one is needed.
    """
    if launcher is None:
        if address is not None:
            raise ValueError(f"address is {address!r} without a launcher; allowed with --launcher ray or submitit")
        return None
    folder = json.with_suffix("") if json is not None else Path("rigid-env-jobs")
    return Place(launcher, folder, at_once, address)
