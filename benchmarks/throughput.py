"""Throughput beside MuJoCo: ``python -m benchmarks.throughput [--quick] [--json FILE]``.

Both engines take steps of 5 ms in the same scenes, in the same process and in turns (A B, B A); a ratio is
taken turn by turn, and its median is what counts. One run of each is thrown away first. Our numbers are given
at ``fast`` and ``balanced``. Without MuJoCo our numbers stand alone. The rows of the part ``threads`` compare two
threads with one, on a quiet machine and beside busy processes.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from rich.progress import Progress

from benchmarks import bodies, crowded, machine, memory, start
from rigid_env.lab.measure import environments, mujoco_scene, rows, workloads
from rigid_env.lab.measure.table import make_table
from rigid_env.lab.measure.timing import Row
from rigid_env.terminal import make_console

REPEATS = 7
QUICK_REPEATS = 2
MEMORY_STEPS = 1_000_000
QUICK_MEMORY_STEPS = 2000
PARTS = ("engine", "threads", "bodies", "environments", "memory", "start")


def measure(parts: tuple[str, ...], is_quick: bool, progress: Progress) -> list[Row]:
    """All rows of the given parts.

    Parameters
    ----------
    parts : tuple of str
        Of `PARTS`.
    is_quick : bool
        Little work and few repeats: to see that it runs, not to be quoted.
    progress : rich.progress.Progress
        Shows what is measured.
    """
    repeats = QUICK_REPEATS if is_quick else REPEATS
    has_peer = mujoco_scene.is_installed()
    found: list[Row] = []
    if "engine" in parts:
        tick = _bar(progress, "engine", rows.run_count(repeats, has_peer))
        sizes = workloads.QUICK if is_quick else workloads.FULL
        for some in rows.engine_rows(sizes, repeats, has_peer, tick):
            found += some
    if "threads" in parts:
        tick = _bar(progress, "threads", crowded.run_count(repeats, has_peer))
        sizes = workloads.QUICK if is_quick else workloads.FULL
        for some in crowded.crowded_rows(sizes, repeats, has_peer, tick):
            found += some
    if "bodies" in parts:
        tick = _bar(progress, "bodies", bodies.run_count(repeats, has_peer))
        for some in bodies.body_rows(is_quick, repeats, has_peer, tick):
            found += some
    if "environments" in parts:
        tick = _bar(progress, "environments", environments.run_count(repeats, has_peer))
        sizes = environments.QUICK if is_quick else environments.FULL
        for some in environments.environment_rows(sizes, repeats, _peer(has_peer), tick):
            found += some
    if "memory" in parts:
        _bar(progress, "memory", 1)("memory")
        found += memory.memory_rows(QUICK_MEMORY_STEPS if is_quick else MEMORY_STEPS)
    if "start" in parts:
        _bar(progress, "start", 1)("start of a process")
        found += start.start_rows(1 if is_quick else REPEATS)
    return found


def _peer(has_peer: bool):
    if not has_peer:
        return None
    from benchmarks.mujoco_env import make_peer

    return make_peer()


def _bar(progress: Progress, name: str, total: int):
    task = progress.add_task(name, total=total)

    def tick(what: str) -> None:
        progress.update(task, advance=1, description=what, refresh=True)

    return tick


def main(
    json: Annotated[Path | None, typer.Option(help="Where to write the result.")] = None,
    quick: Annotated[bool, typer.Option("--quick", help="Only see that it runs.")] = False,
    part: Annotated[list[str] | None, typer.Option(help=f"Some of {', '.join(PARTS)}.")] = None,
) -> None:
    """Measure steps per second, memory and start-up beside MuJoCo."""
    parts = tuple(part or PARTS)
    unknown = sorted(set(parts) - set(PARTS))
    if unknown:
        raise typer.BadParameter(f"{', '.join(unknown)}; allowed are {', '.join(PARTS)}")
    json = json.resolve() if json else None
    console = make_console()
    # a progress bar with a thread of its own would disturb what is measured
    with Progress(console=console, transient=True, auto_refresh=False) as progress, mujoco_scene.elsewhere():
        found = measure(parts, quick, progress)
    console.print(make_table(found, machine.headline()))
    if quick and json is None:
        return
    name = "throughput" if parts == PARTS else "throughput_" + "_".join(parts)
    path = machine.keep(name, found, json, is_quick=quick, repeats=QUICK_REPEATS if quick else REPEATS)
    console.print(f"written to {path}")


if __name__ == "__main__":
    typer.run(main)
