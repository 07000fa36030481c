"""Measure scenes in other processes: each process measures a whole scene, whose settings are timed in turns."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from functools import partial
from pathlib import Path

import physics
from rigid_env.lab.measure import accuracy
from rigid_env.lab.measure.accuracy import QUICK, Found, Ladder
from rigid_env.launchers.job import Ended, Job, shell_line


def make_jobs(
    scenes: Sequence[str], folder: Path, engines: tuple[str, ...], ladder: Ladder, duration: float | None
) -> list[Job]:
    """Make a job for each scene, whose command writes a file into `folder`; parameters as of `accuracy.make_jobs`."""
    about = {"peers": ",".join(engines) or None, "duration": duration, "quick": ladder == QUICK}
    return [
        Job(
            scene,
            partial(measure, scene, engines, ladder, duration),
            shell_line("rigid-env", "accuracy", scene, **about, json=folder / f"{Path(scene).stem}.json"),
        )
        for scene in scenes
    ]


def measure(scene: str, engines: tuple[str, ...], ladder: Ladder, duration: float | None) -> physics.Frontier:
    """Measure one scene in this process.

    Raises
    ------
    KeyboardInterrupt
        Interrupted before any setting was measured.
    """
    loaded = accuracy.load_peers(engines)
    for found in accuracy.run(accuracy.make_jobs([scene], loaded, ladder, duration), ladder):
        return found.frontier
    raise KeyboardInterrupt


def found(jobs: Sequence[accuracy.Job], ends: Iterable[Ended]) -> Iterator[Found]:
    """Yield the measurements of each scene as soon as they come.

    Raises
    ------
    ValueError
        If a scene could not be measured.
    """
    by_key = {job.key: job for job in jobs}
    for name, frontier, error, _ in ends:
        if frontier is None:
            raise ValueError(f"{name}: {error}")
        yield Found(by_key[name], frontier)
