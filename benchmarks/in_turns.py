"""Compare the speed of two commits, in turns: ``python -m benchmarks.in_turns OTHER_CHECKOUT [--turns N]``.

A process over each checkout takes the same steps of a scene of `benchmarks.bit_scenes`, or of an environment, one after
the other (A B, B A, ...). A ratio is CPU time there over CPU time here, of one turn; its median counts. 1.05 says that
this checkout is 5 % faster. Where roundings decide what happens, two commits take two motions of other lengths:
`mixed-drawn` starts its worlds at drawn places, and its time is a mean over many motions.
"""

from __future__ import annotations

import statistics
from pathlib import Path
from typing import Annotated

import typer

from benchmarks import machine
from benchmarks.same_bits import Checkout
from benchmarks.turn_worker import ENVIRONMENT
from rigid_env.lab.measure.machine import write_json

WORKER = Path(__file__).with_name("turn_worker.py")
SCENES = (
    "tumble", "drop", "shoved", "elastic", "grain", "kick", "floats", "spring", "tower", "mixed", "mixed-drawn",
    "sleeping-tower",
)  # fmt: skip
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


def compare(here: Checkout, there: Checkout, name: str, turns: int) -> list[float]:
    """CPU time there over CPU time here, of each turn; who begins changes."""
    count, ratios = steps_of(here, name), []
    seconds(there, name, count)
    for turn in range(turns):
        pair = (here, there) if turn % 2 == 0 else (there, here)
        spent = {side: seconds(side, name, count) for side in pair}
        ratios.append(spent[there] / spent[here])
    return ratios


def main(
    other: Annotated[Path, typer.Argument(help="A checkout of the commit to compare with.", exists=True)],
    turns: Annotated[int, typer.Option(min=1, help="Samples of each.")] = 11,
    scene: Annotated[list[str] | None, typer.Option(help=f"Some of {', '.join((*SCENES, ENVIRONMENT))}.")] = None,
    json: Annotated[Path | None, typer.Option(help="Where to write the result.")] = None,
) -> None:
    """Print the median ratio of each scene; keep all samples."""
    found = {}
    mine = Path(__file__).parents[1]
    with Checkout(mine, worker=WORKER) as here, Checkout(other.resolve(), worker=WORKER) as there:
        for name in scene or (*SCENES, ENVIRONMENT):
            found[name] = compare(here, there, name, turns)
            low, high = min(found[name]), max(found[name])
            typer.echo(f"{name:16} {statistics.median(found[name]):6.3f}   {low:.3f} to {high:.3f}")
    if json is not None:
        write_json(json, {"name": "in_turns", "machine": machine.headline(), "ratios": found})


if __name__ == "__main__":
    typer.run(main)
