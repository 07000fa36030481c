"""Measure scenes in other processes: each process measures a whole scene, whose settings are timed in turns."""

from __future__ import annotations

import shlex
from collections.abc import Iterable, Iterator, Sequence
from functools import partial
from pathlib import Path

import physics
from rigid_env.lab.measure import accuracy
from rigid_env.lab.measure.accuracy import QUICK, Found, Ladder, Tick
from rigid_env.launchers.job import Ended, Job


def make_jobs(
    jobs: Sequence[accuracy.Job], folder: Path, engines: tuple[str, ...], ladder: Ladder, duration: float | None
) -> list[Job]:
    """Make a job for each scene, whose command writes a file into `folder`; parameters as of `accuracy.make_jobs`."""
    return [
        Job(
            job.key,
            partial(measure, job.key, engines, ladder, duration),
            _command(job.key, folder, engines, ladder, duration),
        )
        for job in jobs
    ]


def _command(scene: str, folder: Path, engines: tuple[str, ...], ladder: Ladder, duration: float | None) -> str:
    words = ["rigid-env", "accuracy", scene]
    words += ["--peers", ",".join(engines)] if engines else []
    words += ["--duration", repr(duration)] if duration is not None else []
    words += ["--quick"] if ladder == QUICK else []
    return shlex.join([*words, "--json", str(folder / f"{Path(scene).stem}.json")])


def measure(scene: str, engines: tuple[str, ...], ladder: Ladder, duration: float | None) -> physics.Frontier:
    """Measure one scene in this process.

    Raises
    ------
    KeyboardInterrupt
        Interrupted before any setting was measured.
    """
    loaded, _ = accuracy.load_peers(engines)
    for found in accuracy.run(accuracy.make_jobs([scene], loaded, ladder, duration), ladder):
        return found.frontier
    raise KeyboardInterrupt


def found(jobs: Sequence[accuracy.Job], ends: Iterable[Ended], tick: Tick) -> Iterator[Found]:
    """Yield the measurements of each scene as soon as they come; `tick` takes the name of the scene.

    Raises
    ------
    ValueError
        If a scene could not be measured.
    """
    by_key = {job.key: job for job in jobs}
    for name, frontier, error, _ in ends:
        tick(name)
        if frontier is None:
            raise ValueError(f"{name}: {error}")
        yield Found(by_key[name], frontier)
