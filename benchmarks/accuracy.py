"""Error against time: ``python -m benchmarks.accuracy [SCENE ...] [--peers NAMES] [--json FILE] [--quick]``.

`rigid-env accuracy`, with the result kept in ``results/``: ``accuracy.json`` for the whole measurement,
``accuracy_SCENE.json`` for a part of it.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from benchmarks import machine
from rigid_env.cli.names import listed
from rigid_env.lab.measure.accuracy import QUICK, Ladder, names
from rigid_env.lab.measure.accuracy_report import measure_and_show, write_result
from rigid_env.terminal import make_console


def main(
    scene: Annotated[list[str] | None, typer.Argument(help="Some of " + ", ".join(names()))] = None,
    peers: Annotated[str, typer.Option(help="Of mujoco,pybullet,drake; with commas.")] = "",
    json: Annotated[Path | None, typer.Option(help="Where to write the result.")] = None,
    quick: Annotated[bool, typer.Option("--quick", help="Few steps and repeats: only see that it runs.")] = False,
) -> None:
    """Measure error against truth and time, for every preset and step."""
    console, ladder = make_console(), QUICK if quick else Ladder()
    path = json.resolve() if json else None
    console.print(machine.headline())
    try:
        report = measure_and_show(console, scene or (), listed(peers), ladder)
    except ValueError as error:
        raise typer.BadParameter(str(error)) from error
    if path is None and not quick and report.is_complete:
        path = machine.RESULTS / ("_".join(["accuracy", *(scene or ())]) + ".json")
    if path is not None:
        write_result(path, report)
        console.print(f"written to {path}", soft_wrap=True, highlight=False)


if __name__ == "__main__":
    typer.run(main)
