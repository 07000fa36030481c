"""Command line ``rigid-env``. Each command imports its packages when it runs, so that ``--help`` is quick."""

from __future__ import annotations

from importlib import metadata
from typing import Annotated

import typer

from rigid_env.cli import describing, exploring, measuring, viewing
from rigid_env.cli.common import app

__all__ = ["app", "describing", "exploring", "measuring", "viewing"]


def _print_version(is_wanted: bool) -> None:
    if not is_wanted:
        return
    try:
        typer.echo(f"rigid-env {metadata.version('rigid-env')}")
    except metadata.PackageNotFoundError:
        typer.echo("rigid-env, not installed: run from its sources")
    raise typer.Exit


@app.callback()
def _main(
    version: Annotated[
        bool, typer.Option("--version", callback=_print_version, is_eager=True, help="Show the version.")
    ] = False,
) -> None:
    pass
