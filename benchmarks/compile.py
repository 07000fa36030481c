"""First use of a plan: ``python -m benchmarks.compile [--repeats N] [--accuracy NAME ...]``.

Each sample is a new process with an empty folder for kernels, and the three-wall box: what its first step takes, as CPU
seconds (compiling runs on one thread, so that an idle machine shows the same as wall clock) and as wall clock; and what
it takes in a second process that finds the kernels there.
"""

from __future__ import annotations

import json
import os
import statistics
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import typer
from rich import box
from rich.table import Table

import physics
from benchmarks import machine
from rigid_env.measure.table import make_console

PROGRAM = """
import json, sys, time
from numba.core import event
import physics, physics.scenes
wall, cpu = time.perf_counter(), time.process_time()
with event.install_recorder("numba:compile") as recorder:
    physics.World(physics.scenes.drop(), accuracy=sys.argv[1]).step()
seconds = {"cpu": time.process_time() - cpu, "wall": time.perf_counter() - wall}
print(json.dumps({**seconds, "kernels": sum(what.is_start for _, what in recorder.buffer)}))
"""


@dataclass(frozen=True)
class FirstStep:
    """What making a world and its first step took, after the imports.

    Attributes
    ----------
    cpu, wall : float
        [s].
    kernels : int
        That were compiled for it.
    """

    cpu: float
    wall: float
    kernels: int


def first_step(accuracy: str, kernels: Path) -> FirstStep:
    """The three-wall box in a new process that keeps its kernels in the folder `kernels`."""
    root = str(Path(physics.__file__).parents[1])
    path = os.pathsep.join([root, *filter(None, [os.environ.get("PYTHONPATH")])])
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM, accuracy], check=True, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL,
        text=True, env={**os.environ, "PYTHONPATH": path, "NUMBA_CACHE_DIR": str(kernels)},
    )  # fmt: skip
    return FirstStep(**json.loads(done.stdout))


def measure(accuracy: str, repeats: int) -> tuple[list[FirstStep], list[FirstStep]]:
    """First steps with nothing compiled, and those of a second process each."""
    cold, warm = [], []
    for _ in range(repeats):
        with tempfile.TemporaryDirectory() as folder:
            cold.append(first_step(accuracy, Path(folder)))
            warm.append(first_step(accuracy, Path(folder)))
    return cold, warm


def main(
    repeats: Annotated[int, typer.Option(min=1)] = 3,
    accuracy: Annotated[list[str] | None, typer.Option(help="Presets.")] = None,
) -> None:
    """Measure the first step of the three-wall box with nothing compiled, and with all of it."""
    table = Table(title=machine.headline(), title_justify="left", box=box.SIMPLE_HEAD)
    for name in ("accuracy", "kernels in the cache", "compiled", "CPU [s]", "wall clock [s]"):
        table.add_column(name, justify="left" if name == "accuracy" else "right")
    for preset in accuracy or ("fast", "balanced", "precise"):
        for state, found in zip(("none", "all"), measure(preset, repeats)):
            seconds = [f"{statistics.median(getattr(step, clock) for step in found):.2f}" for clock in ("cpu", "wall")]
            table.add_row(preset, state, str(found[0].kernels), *seconds)
    make_console().print(table)


if __name__ == "__main__":
    typer.run(main)
