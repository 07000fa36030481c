"""Compare the speed of two commits, in turns: ``python -m benchmarks.in_turns OTHER_CHECKOUT [--turns N]``.

A process over each checkout takes the same steps of a scene of `benchmarks.bit_scenes`, or of an environment, one after
the other (A B, B A, ...). A ratio is CPU time there over CPU time here, of one turn; its median counts. 1.05 says that
this checkout is 5 % faster. Where roundings decide what happens, two commits take two motions of other lengths:
`mixed-drawn` starts its worlds at drawn places, and its time is a mean over many motions.
"""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Annotated

import typer
from rich.progress import track

from benchmarks import machine
from benchmarks.same_bits import Checkout
from benchmarks.turn_worker import ENVIRONMENT
from rigid_env.lab.measure.machine import write_json
from rigid_env.lab.measure.table import make_table
from rigid_env.lab.measure.timing import Row, interleave
from rigid_env.terminal import make_console

WORKER = Path(__file__).with_name("turn_worker.py")
SCENES = (
    "tumble", "drop", "shoved", "elastic", "grain", "kick", "floats", "spring", "tower", "mixed", "mixed-drawn",
    "sleeping-tower",
)  # fmt: skip
HERE, THERE = "this checkout", "the other checkout"
SAMPLE_SECONDS = 0.3  # CPU time of a sample, at least


def seconds(side: Checkout, name: str, count: int) -> float:
    """CPU time of `count` steps over a checkout [s]."""
    side.ask(name, count)
    return side.answer()


def steps_of(side: Checkout, name: str) -> int:
    """Steps that take `SAMPLE_SECONDS`."""
    count = 10
    while (spent := seconds(side, name, count)) < SAMPLE_SECONDS:
        count = round(count * min(10.0, 1.3 * SAMPLE_SECONDS / max(spent, 1e-3)))
    return count


def compare(here: Checkout, there: Checkout, name: str, turns: int) -> Row:
    """Steps per second of CPU time here and there, in turns: their ratio is CPU time there over CPU time here."""
    count = steps_of(here, name)

    def rate(side: Checkout) -> float:
        return count / seconds(side, name, count)

    spreads = interleave({HERE: partial(rate, here), THERE: partial(rate, there)}, turns)
    return Row(name, name, "steps/CPU s", spreads[HERE], peer_name=THERE, peer=spreads[THERE])


def main(
    other: Annotated[Path, typer.Argument(help="A checkout of the commit to compare with.", exists=True)],
    turns: Annotated[int, typer.Option(min=1, help="Samples of each.")] = 11,
    scene: Annotated[list[str] | None, typer.Option(help=f"Some of {', '.join((*SCENES, ENVIRONMENT))}.")] = None,
    json: Annotated[Path | None, typer.Option(help="File for the result, kept as it grows.")] = None,
) -> None:
    """Print the ratio of each scene, median and range; keep all samples."""
    rows = []
    mine = Path(__file__).parents[1]
    with Checkout(mine, worker=WORKER) as here, Checkout(other.resolve(), worker=WORKER) as there:
        for name in track(scene or (*SCENES, ENVIRONMENT), description="scenes"):
            rows.append(compare(here, there, name, turns))
            if json is not None:
                write_json(json, {"name": "in_turns", "ratios": {row.key: row.ratio.samples for row in rows}})
    make_console().print(make_table(rows, machine.headline(), (HERE, THERE)))


if __name__ == "__main__":
    typer.run(main)
