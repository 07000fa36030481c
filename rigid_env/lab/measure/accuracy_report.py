"""Measure error against computing time in a terminal, with progress, tables and a result file."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

from rich.console import Console

import physics
from physics import validation
from rigid_env.lab.measure import accuracy, accuracy_jobs
from rigid_env.lab.measure.accuracy import Found, Ladder
from rigid_env.lab.measure.accuracy_table import MARKS, answers, goals, make_table, summary
from rigid_env.lab.measure.machine import write_json
from rigid_env.lab.measure.mujoco_scene import elsewhere
from rigid_env.launchers.place import HERE, Place
from rigid_env.terminal import ticking


@dataclass(frozen=True)
class Report:
    """Measurements of a run of `rigid-env accuracy`.

    Attributes
    ----------
    results : tuple of Found
        Measured scenes.
    ladder : Ladder
        Accuracies and steps of the run.
    is_complete : bool
        False if the run was interrupted.
    """

    results: tuple[Found, ...]
    ladder: Ladder
    is_complete: bool


@dataclass(frozen=True)
class Shown:
    """Choice of the output that is printed for the points of a measurement.

    Parameters
    ----------
    is_full : bool
        Print every point.
    has_goals : bool
        Print the goals of this project, and which setting reaches each.
    below : float, optional
        Print the cheapest setting with an error below this one, in each scene's unit.
    """

    is_full: bool = False
    has_goals: bool = False
    below: float | None = None


def measure_and_show(
    console: Console,
    scenes: Sequence[str] = (),
    peers: Sequence[str] = (),
    ladder: Ladder | None = None,
    duration: float | None = None,
    shown: Shown | None = None,
    place: Place = HERE,
) -> Report:
    """Measure scenes, and print the table of each as soon as it is measured.

    At another place than this process, each scene is a job. A place that prints its jobs measures none.

    Parameters
    ----------
    console : Console
    scenes : sequence of str
        See `accuracy.make_jobs`.
    peers : sequence of str
        Names of other engines.
    ladder : Ladder, optional
    duration : float, optional
        See `accuracy.make_jobs`.
    shown : Shown, optional
    place : Place, optional

    Raises
    ------
    ValueError
        No such scene or engine, or `shown.below` or `duration` is not positive.
    """
    shown = shown or Shown()
    if shown.below is not None:
        validation.positive(shown.below, (), "below")
    ladder = ladder or Ladder()
    engines = accuracy.load_peers(peers, console.print)
    if engines:
        console.print("peers: " + ", ".join(f"{e.name} {e.version}" for e in engines.values()))
    jobs = accuracy.make_jobs(scenes, engines, ladder, duration)
    spread = accuracy_jobs.make_jobs([job.key for job in jobs], place.folder, tuple(engines), ladder, duration)
    results = []
    with elsewhere():
        here = place.is_here
        for found in _here(jobs, ladder, console) if here else accuracy_jobs.found(jobs, place.watch(spread, console)):
            results.append(found)
            _show(console, found, shown)
    if place.is_printed:
        return Report((), ladder, is_complete=True)
    console.print(MARKS, style="dim")
    for line in [line for found in results for line in (answers(found, shown.below) if shown.below else ())]:
        console.print(line, soft_wrap=True)
    is_complete = len(results) == len(jobs) and all(found.frontier.is_complete for found in results)
    return Report(tuple(results), ladder, is_complete)


def _here(jobs: Sequence[accuracy.Job], ladder: Ladder, console: Console) -> Iterator[Found]:
    with ticking(console, "accuracy", accuracy.run_count(jobs, ladder)) as tick:
        yield from accuracy.run(jobs, ladder, tick)


def write_result(path: Path, report: Report) -> None:
    """Write results as JSON: settings, scenes, all points as ``rows``, and machine, versions and commit."""
    presets = {name: asdict(physics.PRESETS[name]) for name in report.ladder.accuracies}
    scenes, rows = [], []
    for found in report.results:
        about = found.to_dict()
        rows += [_row(found.job.key, about["measure"], point) for point in about.pop("points")]
        scenes.append(about)
    content = {"name": "accuracy", "is_complete": report.is_complete}
    content["settings"] = {**asdict(report.ladder), "presets": presets}
    write_json(path, {**content, "scenes": scenes, "rows": rows})


def _row(case: str, measure: str, point: dict) -> dict:
    """Point of a measurement for JSON, with its time in µs per simulated second; an infinite error is null."""
    rest = {name: value for name, value in point.items() if name not in ("cost", "costs")}
    times = {"us": 1e6 * point["cost"], "us_samples": [1e6 * cost for cost in point["costs"]]}
    return {"case": case, "error": point["errors"].get(measure), **times, **rest}


def _show(console: Console, found: Found, shown: Shown) -> None:
    console.print(make_table(found, shown.is_full))
    for line in [*(goals(found) if shown.has_goals else ()), *summary(found)]:
        console.print(f"  {line}", soft_wrap=True)
    console.print()
