"""Measure error against computing time in a terminal, with progress, tables and a result file."""

from __future__ import annotations

from collections.abc import Sequence
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
from rigid_env.launchers.place import Place
from rigid_env.terminal import progress_bar


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
    peers: str = "",
    ladder: Ladder | None = None,
    duration: float | None = None,
    shown: Shown | None = None,
    place: Place | None = None,
) -> Report:
    """Measure scenes, and print the table of each as soon as it is measured.

    With a `place`, each scene is measured by one of its jobs. A place that prints its jobs measures none.

    Parameters
    ----------
    console : Console
    scenes : sequence of str
        See `accuracy.make_jobs`.
    peers : str
        Names of other engines, with commas.
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
    engines, missing = accuracy.load_peers([name.strip() for name in peers.split(",") if name.strip()])
    for message in missing:
        console.print(f"skipped: {message}")
    if engines:
        console.print("peers: " + ", ".join(f"{e.name} {e.version}" for e in engines.values()))
    jobs = accuracy.make_jobs(scenes, engines, ladder, duration)
    spread = [] if place is None else accuracy_jobs.make_jobs(jobs, place.folder, tuple(engines), ladder, duration)
    if place is not None and place.is_printed:
        list(place.run(spread))
        return Report((), ladder, is_complete=True)
    results, total = [], len(jobs) if place else accuracy.run_count(jobs, ladder)
    with progress_bar(console, has_thread=False) as progress, elsewhere():
        task = progress.add_task("accuracy", total=total)

        def tick(what: str) -> None:
            progress.update(task, advance=1, description=what, refresh=True)

        here = place is None
        for found in accuracy.run(jobs, ladder, tick) if here else accuracy_jobs.found(jobs, place.run(spread), tick):
            results.append(found)
            _show(console, found, shown)
    console.print(MARKS, style="dim")
    for line in [line for found in results for line in (answers(found, shown.below) if shown.below else ())]:
        console.print(line, soft_wrap=True)
    is_complete = len(results) == len(jobs) and all(found.frontier.is_complete for found in results)
    return Report(tuple(results), ladder, is_complete)


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
