"""Worth of each optimisation of the compiler: ``python -m benchmarks.ablation [--repeats N] [--only NAME ...]``.

Each optimisation of `physics.compiler.fused.ablation` is left out, in turns with all on (A B, B A). A sample is
three processes: the first step of `drop` at `balanced` with nothing compiled, that of `drop` without gravity in the
same folder, and runs of the workloads of `benchmarks.throughput`, whose kernels were compiled before. First steps are
measured in CPU seconds, as `benchmarks.compile` does. A column is the median of the ratios without over with, turn by
turn: an optimisation saves time to compile where it is above 1, and makes steps faster where it is below 1.

``--json FILE`` keeps the rows as they come; rows that the file holds are not measured again.
"""

from __future__ import annotations

import json as json_module
import os
import statistics
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Annotated

import typer

from benchmarks import machine
from benchmarks.compile import first_step
from benchmarks.processes import PATIENCE
from physics.compiler.fused.ablation import BASES, OPTIMISATIONS, VARIABLE
from rigid_env.lab.measure.machine import write_json
from rigid_env.lab.measure.timing import interleave
from rigid_env.terminal import Column, Table, make_console, number_columns

SCENE, ACCURACY = "drop", "balanced"
COLUMNS = {
    "first": "first compile [CPU s]",
    "second": "second plan [CPU s]",
    "flight": "in flight [steps/s]",
    "rest": "at rest [steps/s]",
    "shove": "shoved [steps/s]",
    "stack": "stack of ten [steps/s]",
}

SPEEDS = """
import json, sys
from benchmarks import bodies
from rigid_env.lab.measure import workloads
accuracy, runs = sys.argv[1], int(sys.argv[2])
sizes = workloads.Sizes(flights=200, rest_steps=400_000, shoves=4000)
works = {name.lower(): getattr(workloads, name)(accuracy, sizes) for name in ("Flight", "Rest", "Shove")}
works["stack"] = bodies.Ours(bodies.cases(False)["stack"], accuracy)
print(json.dumps({name: max(work() for _ in range(runs)) for name, work in works.items()}))
"""
RUNS = 10  # of each workload in a process, of which the fastest counts: others on the machine only slow it down


@contextmanager
def left_out(name: str) -> Iterator[None]:
    """Have processes that start meanwhile leave out an optimisation; "" for none."""
    before = os.environ.get(VARIABLE)
    os.environ[VARIABLE] = name
    try:
        yield
    finally:
        del os.environ[VARIABLE]
        if before is not None:
            os.environ[VARIABLE] = before


def steps_per_second(kernels: Path) -> dict[str, float]:
    """Speeds of the workloads in a new process that keeps its kernels in the folder `kernels`."""
    path = os.pathsep.join([str(Path(__file__).parents[1]), *filter(None, [os.environ.get("PYTHONPATH")])])
    done = subprocess.run(
        [sys.executable, "-c", SPEEDS, ACCURACY, str(RUNS)], check=True, timeout=PATIENCE, stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL, text=True, env={**os.environ, "PYTHONPATH": path, "NUMBA_CACHE_DIR": str(kernels)},
    )  # fmt: skip
    return json_module.loads(done.stdout)


def sample(name: str, kernels: Path) -> dict[str, float]:
    """One sample of each of `COLUMNS` without an optimisation.

    Parameters
    ----------
    name : str
        "" for all on.
    kernels : Path
        Folder of the kernels of the workloads.
    """
    with left_out(name), tempfile.TemporaryDirectory() as new:
        first = first_step(SCENE, ACCURACY, Path(new))
        second = first_step(SCENE, ACCURACY, Path(new), is_other=True)
        return {"first": first.cpu, "second": second.cpu, **steps_per_second(kernels)}


def measure(name: str, repeats: int, kernels: Path) -> dict[str, list[dict[str, float]]]:
    """Samples with and without an optimisation, in turns; the workloads of both are compiled before."""
    sides = {"with": ("", kernels / "all"), "without": (name, kernels / name)}
    for left, folder in sides.values():
        if not folder.exists():
            with left_out(left):
                steps_per_second(folder)
    runs = {which: partial(sample, left, folder) for which, (left, folder) in sides.items()}
    spreads = interleave(runs, repeats, lambda which: print(f"{name}: {which}", file=sys.stderr), is_warm=True)
    return {which: list(spread.samples) for which, spread in spreads.items()}


def ratio(samples: dict[str, list[dict[str, float]]], column: str) -> float:
    """Median of the ratios without over with, turn by turn."""
    turns = zip(samples["without"], samples["with"], strict=True)
    return statistics.median(without[column] / beside[column] for without, beside in turns)


def make_table(rows: dict[str, dict], title: str) -> Table:
    """A row for each optimisation, and below the table those without a switch."""
    bases = "\n".join(f"{name} has no switch: {reason}" for name, reason in BASES.items())
    columns = [Column("without", is_whole=True), *number_columns(*COLUMNS.values())]
    table = Table(columns, title, f"ratios without over with\n{bases}")
    for name, row in rows.items():
        table.add_row(name, *(f"{ratio(row['samples'], column):.2f}" for column in COLUMNS))
    return table


def main(
    repeats: Annotated[int, typer.Option(min=1, help="Turns of each optimisation.")] = 3,
    only: Annotated[list[str] | None, typer.Option(help=f"Some of {', '.join(OPTIMISATIONS)}.")] = None,
    json: Annotated[
        Path | None, typer.Option(help="File for the result, kept as it grows; rows that it holds are not run again.")
    ] = None,
) -> None:
    """Leave out each optimisation of the compiler, in turns with all on."""
    if unknown := sorted(set(only or ()) - set(OPTIMISATIONS)):
        raise typer.BadParameter(f"{', '.join(unknown)}; allowed are {', '.join(OPTIMISATIONS)}", param_hint="only")
    rows = json_module.loads(json.read_text())["rows"] if json and json.exists() else {}
    with tempfile.TemporaryDirectory() as folder:
        for name in only or OPTIMISATIONS:
            if name not in rows:
                samples = measure(name, repeats, Path(folder))
                rows[name] = {"machine": machine.headline(), "samples": samples}
            if json:
                write_json(json, {"name": "ablation", "settings": {"scene": SCENE, "accuracy": ACCURACY}, "rows": rows})
    make_console().print(make_table(rows, machine.headline()))


if __name__ == "__main__":
    typer.run(main)
