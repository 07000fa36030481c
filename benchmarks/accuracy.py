"""Error against time: ``python -m benchmarks.accuracy [SCENE ...] [--json FILE]``.

Each scene of `benchmarks.truths` at each setting: how far from the truth it ends, and how long a simulated second
takes on one thread (median of several repeats). Marked are the settings that no other one beats in both.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from rich import box
from rich.progress import Progress
from rich.table import Table

import physics
from benchmarks import machine
from benchmarks.truths import CASES, Case
from benchmarks.truths import Path as Seen
from physics.accuracy import PRESETS
from rigid_env.measure.machine import write_json
from rigid_env.measure.table import make_console
from rigid_env.measure.timing import Stopwatch

REPEATS = 5
STEPS_PER_REPEAT = 2000  # at least, so that a repeat takes longer than the clock's grain
STEPS = (0.02, 0.01, 0.005, 0.002, 0.001)  # [s]
LADDER = ("fast", "balanced", "precise")


@dataclass(frozen=True)
class Point:
    """One scene at one setting.

    Attributes
    ----------
    case, accuracy : str
    dt : float
        Step [s].
    error : float
        In the unit of the case.
    us : float
        Wall-clock time per simulated second [µs].
    is_front : bool
        No other setting of the case has a smaller error in less time.
    """

    case: str
    accuracy: str
    dt: float
    error: float
    us: float
    is_front: bool = False


def watch(case: Case, accuracy: str, dt: float) -> Seen:
    """Simulate a case step by step and keep what is seen after each step."""
    world = physics.World(case.scene(), dt=dt, accuracy=accuracy)
    step = physics.Stepper(world, has_wrench=False)
    seen = {name: [getattr(world, name)[0, 0].copy()] for name in ("pos", "quat", "linvel", "angvel")}
    count = round(case.duration / dt)
    for _ in range(count):
        step()
        for name, values in seen.items():
            values.append(getattr(world, name)[0, 0].copy())
    return Seen(dt * np.arange(count + 1), **{name: np.array(values) for name, values in seen.items()})


def cost(case: Case, accuracy: str, dt: float, repeats: int) -> float:
    """Wall-clock time per simulated second [µs]: median of `repeats`."""
    world = physics.World(case.scene(), dt=dt, accuracy=accuracy)
    start, count = world.snapshot(), round(case.duration / dt)
    step = physics.Stepper(world, steps=count, has_wrench=False)
    runs = max(1, STEPS_PER_REPEAT // count)
    samples = []
    for _ in range(repeats + 1):
        clock = Stopwatch()
        for _ in range(runs):
            world.restore(start)
            with clock:
                step()
        samples.append(clock.seconds / (runs * count * dt) * 1e6)
    return float(np.median(samples[1:]))


def mark_front(points: list[Point]) -> list[Point]:
    """The points of one case with `is_front` set, quickest first."""
    ordered, best = [], np.inf
    for point in sorted(points, key=lambda p: (p.us, p.error)):
        ordered.append(replace(point, is_front=bool(point.error < best)))
        best = min(best, point.error)
    return ordered


def measure(cases: list[Case], repeats: int = REPEATS, steps=STEPS, tick=lambda what: None) -> list[Point]:
    """All points of the cases; `tick` is told before each what is measured."""
    found = []
    for case in cases:
        points = []
        for accuracy in LADDER:
            for dt in steps:
                tick(f"{case.key} {accuracy} {1e3 * dt:g} ms")
                error = case.error(watch(case, accuracy, dt))
                points.append(Point(case.key, accuracy, dt, error, cost(case, accuracy, dt, repeats)))
        found += mark_front(points)
    return found


def goals_met(case: Case, points: list[Point]) -> list[tuple[float, float, Point | None]]:
    """For each goal (error, µs): the quickest setting that is accurate enough, if it is also quick enough."""
    met = []
    for error, us in case.goals:
        good = [p for p in points if p.case == case.key and p.error <= error and p.us <= us]
        met.append((error, us, min(good, key=lambda p: p.us) if good else None))
    return met


def make_table(case: Case, points: list[Point]) -> Table:
    """The settings of one case, quickest first; those on the front are marked."""
    lines = []
    for error, us, point in goals_met(case, points):
        how = f"reached by {point.accuracy} at {1e3 * point.dt:g} ms" if point else "not reached"
        lines.append(f"≤ {error:g} {case.unit} at ≤ {us:g} µs: {how}")
    table = Table(title="\n".join([case.what, *lines]), title_justify="left", box=box.SIMPLE_HEAD)
    for name in ("accuracy", "dt, ms", f"error, {case.unit}", "µs per s", "front"):
        table.add_column(name, justify="right")
    for p in points:
        if p.case == case.key:
            table.add_row(p.accuracy, f"{1e3 * p.dt:g}", f"{p.error:.2g}", f"{p.us:.0f}", "*" if p.is_front else "")
    return table


def main(
    scene: Annotated[list[str] | None, typer.Argument(help="Some of " + ", ".join(c.key for c in CASES))] = None,
    json: Annotated[Path | None, typer.Option(help="Where to write the result.")] = None,
    quick: Annotated[bool, typer.Option("--quick", help="Few steps and repeats: only see that it runs.")] = False,
) -> None:
    """Measure error against truth and time, for every preset and step."""
    unknown = sorted(set(scene or ()) - {case.key for case in CASES})
    if unknown:
        raise typer.BadParameter(f"{', '.join(unknown)}; allowed are {', '.join(case.key for case in CASES)}")
    cases = [case for case in CASES if not scene or case.key in scene]
    steps = STEPS[:2] if quick else STEPS
    console = make_console()
    with Progress(console=console, transient=True, auto_refresh=False) as progress:
        task = progress.add_task("accuracy", total=len(cases) * len(LADDER) * len(steps))
        points = measure(
            cases, 1 if quick else REPEATS, steps,
            lambda what: progress.update(task, advance=1, description=what, refresh=True),
        )  # fmt: skip
    console.print(machine.headline())
    for case in cases:
        console.print(make_table(case, points))
    if not quick or json:
        name = "accuracy" if not scene else "accuracy_" + "_".join(scene)
        path = json.resolve() if json else machine.RESULTS / f"{name}.json"
        settings = {"repeats": REPEATS, "presets": {key: asdict(PRESETS[key]) for key in LADDER}}
        write_json(path, {"name": name, "settings": settings, "rows": [asdict(p) for p in points]})
        console.print(f"written to {path}")


if __name__ == "__main__":
    typer.run(main)
