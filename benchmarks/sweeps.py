"""Cost of spreading runs: ``python -m benchmarks.sweeps [--trials N] [--steps N] [--launcher NAME ...] [--json FILE]``.

Trials of BlockReach in one process and in two; empty jobs through each launcher; what a trial writes. From these follow
the numbers in docs/sweeps.md of where a sweep over many machines stops to scale.
"""

from __future__ import annotations

import os
import tempfile
import time
from functools import partial
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from agents.config import HYPERPARAMETERS
from agents.sweep import sweep
from agents.trials import Trial, make_trials
from benchmarks import machine
from rigid_env.lab.measure.machine import write_json
from rigid_env.launchers import load
from rigid_env.launchers.job import Job
from rigid_env.launchers.place import Place
from rigid_env.terminal import Table, make_console, number_columns

ENV = "rigid_env/BlockReach-v0"
EMPTY_JOBS = 200
PROCESSES = (1, 2)


def trials_of(count: int, steps: int) -> list[Trial]:
    """Trials that differ by their seeds, each of so many steps; none reaches 100 % of successes before."""
    return make_trials([ENV], range(count), {"max_steps": [steps], "target": [1.0]}, None, HYPERPARAMETERS)


def trial_seconds(trials: list[Trial], at_once: int) -> tuple[float, int]:
    """Wall clock of a sweep in `at_once` processes, their start among it [s], and the bytes that it leaves."""
    with tempfile.TemporaryDirectory() as folder:
        start = time.perf_counter()
        ends = sweep(trials, Path(folder), load("local"), at_once, None, Console(quiet=True))
        seconds = time.perf_counter() - start
        assert all(end.result is not None for end in ends), [end.error for end in ends]
        return seconds, sum(path.stat().st_size for path in Path(folder).rglob("*") if path.is_file())


def checkpoint_bytes(trial: Trial) -> int:
    """Size of one checkpoint of a trial [bytes]."""
    from agents.algorithms import make_model, make_training_env
    from agents.checkpoint import save_checkpoint

    env = make_training_env(trial.config)
    model = make_model(trial.config, env)
    model.learn(1)
    with tempfile.TemporaryDirectory() as folder:
        place = save_checkpoint(Path(folder), model, None)
        size = sum(path.stat().st_size for path in place.rglob("*") if path.is_file())
    env.close()
    return size


def job_seconds(launcher: str) -> float:
    """Mean time of an empty job among many, from the first end to the last [s]."""
    with tempfile.TemporaryDirectory() as folder:
        place = Place(launcher, Path(folder), 1, "local" if launcher == "submitit" else None)
        times = []
        for _ in place.run([Job(str(k), partial(os.getpid), "") for k in range(EMPTY_JOBS)]):
            times.append(time.perf_counter())
    return (times[-1] - times[0]) / (len(times) - 1)


def main(
    trials: Annotated[int, typer.Option(min=2, help="In all.")] = 8,
    steps: Annotated[int, typer.Option(min=1, help="Of each trial.")] = 200_000,
    launcher: Annotated[list[str] | None, typer.Option(help="Whose empty jobs are timed; none: local.")] = None,
    repeats: Annotated[int, typer.Option(min=1, help="Of the trials, in turns.")] = 1,
    json: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Instead of benchmarks/results/sweeps.json.")
    ] = None,
) -> None:
    """Measure what spreading runs costs."""
    console = make_console()
    todo = trials_of(trials, steps)
    with tempfile.TemporaryDirectory() as folder:  # kernels are in the cache from here on
        sweep(trials_of(1, 1), Path(folder), load("local"), 1, None, Console(quiet=True))
    seconds: dict[int, list[float]] = {count: [] for count in PROCESSES}
    left = 0
    for _ in range(repeats):
        for count in PROCESSES:
            took, left = trial_seconds(todo, count)
            seconds[count].append(took)
            console.print(f"{trials} trials in {count} processes: {took:.1f} s")
    one, two = (sorted(seconds[count])[len(seconds[count]) // 2] for count in PROCESSES)
    jobs = {name: job_seconds(name) for name in launcher or ["local"]}
    found = {
        "trials": trials, "steps": steps, "seconds": {str(count): value for count, value in seconds.items()},
        "efficiency": one / (2 * two), "bytes_kept_per_trial": left / trials,
        "bytes_per_checkpoint": checkpoint_bytes(todo[0]), "seconds_per_empty_job": jobs,
    }  # fmt: skip
    table = Table(["", *number_columns("value")], machine.headline())
    table.add_row("efficiency on two processes", f"{found['efficiency']:.2f}")
    table.add_row("left by a trial [MB]", f"{found['bytes_kept_per_trial'] / 1e6:.2f}")
    table.add_row("a checkpoint [MB]", f"{found['bytes_per_checkpoint'] / 1e6:.2f}")
    for name, value in jobs.items():
        table.add_row(f"an empty job by {name} [ms]", f"{1e3 * value:.2f}")
    console.print(table)
    write_json(json or machine.RESULTS / "sweeps.json", {"name": "sweeps", **found})


if __name__ == "__main__":
    typer.run(main)
