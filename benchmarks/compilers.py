"""Compare the compilers of kernels: ``python -m benchmarks.compilers [--scene NAME] [--turns N] [--json FILE]``.

The first table has the first step of a scene in a process of its own: CPU seconds and memory with nothing kept on disk,
and CPU seconds of a second process. The second one has steps per second of each compiler, by process in turns (fused,
numba, numba, fused, ...), and the ratio of `fused` to it, of which the median over the turns counts. Python's row has
few steps.
"""

from __future__ import annotations

import json as json_module
import os
import statistics
import subprocess
import sys
import tempfile
from functools import partial
from pathlib import Path
from typing import Annotated

import typer
from rich.progress import Progress

import physics
from benchmarks import machine
from benchmarks.processes import PATIENCE
from physics.compiler.compiler_choice import COMPILERS, FUSED, NUMBA, PYTHON, VARIABLE
from rigid_env.lab.measure.machine import write_json
from rigid_env.lab.measure.timing import interleave
from rigid_env.terminal import Column, Table, make_console, number_columns

WORK = ("flight", "rest", "shoved", "stack")

FIRST_STEP = """
import json, resource, sys, time
import physics
name, accuracy = sys.argv[1:]
scene = physics.scenes.by_name(name)
cpu, wall = time.process_time(), time.perf_counter()
physics.World(scene, accuracy=accuracy).step()
cpu, wall = time.process_time() - cpu, time.perf_counter() - wall
print(json.dumps({"cpu": cpu, "wall": wall, "memory": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20}))
"""

RATES = """
import json, statistics, sys
from benchmarks import bodies
from rigid_env.lab.measure import workloads
accuracy, names, repeats, is_quick = sys.argv[1], sys.argv[2].split(","), int(sys.argv[3]), sys.argv[4] == "True"
sizes = workloads.QUICK if is_quick else workloads.FULL
found = {}
for name in names:
    if name == "stack":
        run = bodies.Ours(bodies.cases(is_quick)["stack"], accuracy)
    else:
        run = {"flight": workloads.Flight, "rest": workloads.Rest, "shoved": workloads.Shove}[name](accuracy, sizes)
    run()
    found[name] = statistics.median(run() for _ in range(repeats))
print(json.dumps(found))
"""


def _run(program: str, compiler: str, kernels: Path, *arguments: str) -> dict:
    """Last line of a program's output, which a compiler runs that keeps kernels in a folder."""
    root = str(Path(physics.__file__).parents[1])
    path = os.pathsep.join([root, *filter(None, [os.environ.get("PYTHONPATH")])])
    environment = {**os.environ, "PYTHONPATH": path, "NUMBA_CACHE_DIR": str(kernels), VARIABLE: compiler}
    done = subprocess.run(
        [sys.executable, "-c", program, *arguments],
        check=True, timeout=PATIENCE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True, env=environment,
    )  # fmt: skip
    return json_module.loads(done.stdout.splitlines()[-1])


def first_steps(scene: str, accuracy: str, compiler: str) -> dict[str, float]:
    """First step with nothing kept, and in a second process: CPU and wall-clock time [s], memory [GiB]."""
    with tempfile.TemporaryDirectory() as folder:
        cold = _run(FIRST_STEP, compiler, Path(folder), scene, accuracy)
        warm = _run(FIRST_STEP, compiler, Path(folder), scene, accuracy)
    return {**cold, "second process": warm["cpu"]}


def rates(accuracy: str, work: list[str], turns: int, kernels: Path, tick) -> dict[str, list[dict[str, float]]]:
    """Steps per second of each compiler in each turn; of Python in one, of little work."""
    run = partial(_run, RATES)
    few, full = (kernels, accuracy, ",".join(work), "1", "True"), (kernels, accuracy, ",".join(work), "5", "False")
    for compiler in (FUSED, NUMBA):
        tick(f"{compiler}: compiling")
        run(compiler, *few)
    runs = {compiler: partial(run, compiler, *full) for compiler in (FUSED, NUMBA)}
    found = {name: list(of.samples) for name, of in interleave(runs, turns, tick, is_warm=True).items()}
    tick(PYTHON)
    return {**found, PYTHON: [run(PYTHON, *few)]}


def first_table(rows: list[dict], title: str) -> Table:
    """First steps: a row for each scene and compiler."""
    columns = [Column("scene"), Column("accuracy"), Column("compiler")]
    names = "first step, CPU [s]", "memory [GiB]", "second process, CPU [s]"
    table = Table([*columns, *number_columns(*names)], title)
    for row in rows:
        table.add_row(
            row["scene"], row["accuracy"], row["compiler"],
            f"{row['cpu']:.1f}", f"{row['memory']:.2f}", f"{row['second process']:.2f}",
        )  # fmt: skip
    return table


def ratios(found: dict[str, list[dict[str, float]]], work: list[str]) -> dict[str, dict[str, float]]:
    """Steps per second, and how many times slower than `fused` a compiler is: medians over the turns."""
    medians = {}
    for compiler, turns in found.items():
        for name in work:
            rate = statistics.median(turn[name] for turn in turns)
            slower = statistics.median(fast[name] / slow[name] for fast, slow in zip(found[FUSED], turns))
            medians.setdefault(name, {})[compiler] = {"steps per second": rate, "times slower": slower}
    return medians


def rate_table(medians: dict[str, dict], accuracy: str, title: str) -> Table:
    """Throughput: a row for each kind of work and compiler."""
    columns = [Column("work"), Column("accuracy"), Column("compiler")]
    table = Table([*columns, *number_columns("steps/s", "times slower than fused")], title)
    for name, of in medians.items():
        for compiler, numbers in of.items():
            row = f"{numbers['steps per second']:,.0f}", f"{numbers['times slower']:.2f}"
            table.add_row(name, accuracy, compiler, *row)
    return table


def main(
    scene: Annotated[list[str] | None, typer.Option(help="Scenes whose first step is measured.")] = None,
    accuracy: Annotated[str, typer.Option(help="Preset.")] = "fast",
    work: Annotated[list[str] | None, typer.Option(help=f"Some of {', '.join(WORK)}.")] = None,
    turns: Annotated[int, typer.Option(min=1)] = 5,
    skip_first: Annotated[bool, typer.Option("--skip-first", help="Leave out the first table.")] = False,
    json: Annotated[Path | None, typer.Option(help="Where to write the result.")] = None,
) -> None:
    """Measure first steps, memory and steps per second of the three compilers."""
    unknown = sorted(set(work or ()) - set(WORK))
    if unknown:
        raise typer.BadParameter(f"{', '.join(unknown)}; allowed are {', '.join(WORK)}")
    console, chosen = make_console(), list(work or WORK)
    rows: list[dict] = []
    kernels = Path(os.environ.get("NUMBA_CACHE_DIR") or tempfile.mkdtemp())
    with Progress(console=console, transient=True) as progress:
        task = progress.add_task("compilers", total=None)

        def tick(what: str) -> None:
            progress.update(task, advance=1, description=what)

        for name in () if skip_first else scene or ("drop",):
            for compiler in COMPILERS:
                tick(f"first step of {name}: {compiler}")
                about = {"scene": name, "accuracy": accuracy, "compiler": compiler}
                rows.append({**about, **first_steps(name, accuracy, compiler)})
        medians = ratios(rates(accuracy, chosen, turns, kernels, tick), chosen)
    if rows:
        console.print(first_table(rows, machine.headline()))
    console.print(rate_table(medians, accuracy, machine.headline()))
    if json is not None:
        about = {"name": "compilers", "turns": turns, "accuracy": accuracy}
        write_json(json, {**about, "first steps": rows, "rates": medians})


if __name__ == "__main__":
    typer.run(main)
