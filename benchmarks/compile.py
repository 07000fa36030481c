"""First use of a plan: ``python -m benchmarks.compile [--repeats N] [--accuracy NAME ...] [--scene NAME ...]``.

Each sample is three processes that keep their kernels in one folder: the first step of a scene with nothing there, that
of the same scene without gravity, another plan that has much in common with the first, and that of the scene again; as
CPU seconds (compiling runs on one thread, so that an idle machine shows the same as wall clock) and as wall clock.
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

import physics
from benchmarks import machine
from benchmarks.processes import PATIENCE
from rigid_env.terminal import Column, Table, make_console, number_columns

PROGRAM = """
import json, sys, time
from numba.core import event
import physics
name, accuracy, is_other = sys.argv[1:]
scene = physics.scenes.by_name(name)
if is_other == "True":
    effects = [effect for effect in scene.effects if not isinstance(effect, physics.Gravity)]
    scene = physics.Scene(scene.bodies, scene.walls, effects)
wall, cpu = time.perf_counter(), time.process_time()
with event.install_recorder("numba:compile") as recorder:
    physics.World(scene, accuracy=accuracy).step()
seconds = {"cpu": time.process_time() - cpu, "wall": time.perf_counter() - wall}
print(json.dumps({**seconds, "kernels": sum(what.is_start for _, what in recorder.buffer)}))
"""


@dataclass(frozen=True)
class FirstStep:
    """Time of making a world and of its first step, after the imports.

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


def first_step(scene: str, accuracy: str, kernels: Path, *, is_other: bool = False) -> FirstStep:
    """A scene, or the other one like it, in a new process that keeps its kernels in the folder `kernels`."""
    root = str(Path(physics.__file__).parents[1])
    path = os.pathsep.join([root, *filter(None, [os.environ.get("PYTHONPATH")])])
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM, scene, accuracy, str(is_other)], check=True, timeout=PATIENCE,
        stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True,
        env={**os.environ, "PYTHONPATH": path, "NUMBA_CACHE_DIR": str(kernels)},
    )  # fmt: skip
    return FirstStep(**json.loads(done.stdout))


def measure(scene: str, accuracy: str, repeats: int) -> dict[str, list[FirstStep]]:
    """First steps by what is in the folder."""
    found: dict[str, list[FirstStep]] = {"nothing": [], "another plan": [], "this plan": []}
    for _ in range(repeats):
        with tempfile.TemporaryDirectory() as folder:
            found["nothing"].append(first_step(scene, accuracy, Path(folder)))
            found["another plan"].append(first_step(scene, accuracy, Path(folder), is_other=True))
            found["this plan"].append(first_step(scene, accuracy, Path(folder)))
    return found


def main(
    repeats: Annotated[int, typer.Option(min=1)] = 3,
    accuracy: Annotated[list[str] | None, typer.Option(help="Presets.")] = None,
    scene: Annotated[list[str] | None, typer.Option(help="Scenes with gravity.")] = None,
) -> None:
    """Measure the first step of a scene with nothing compiled, with another plan compiled, and with its own."""
    rows = [
        (one, preset, measure(one, preset, repeats))
        for one in scene or ("drop", "tower")
        for preset in accuracy or ("fast", "balanced", "precise")
    ]
    make_console().print(make_table(rows, machine.headline()))


def make_table(rows: list[tuple[str, str, dict[str, list[FirstStep]]]], title: str) -> Table:
    """A row for each scene, preset and state of the cache: medians over the repeats."""
    columns = [Column("scene"), Column("accuracy"), Column("in the cache")]
    table = Table([*columns, *number_columns("compiled", "CPU [s]", "wall clock [s]")], title)
    for scene, preset, states in rows:
        for state, found in states.items():
            medians = [statistics.median(getattr(step, clock) for step in found) for clock in ("cpu", "wall")]
            table.add_row(scene, preset, state, str(found[0].kernels), *(f"{seconds:.2f}" for seconds in medians))
    return table


if __name__ == "__main__":
    typer.run(main)
