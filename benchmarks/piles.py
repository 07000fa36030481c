"""How cost grows with a pile: ``python -m benchmarks.piles [--quick] [--json FILE] [--plot FILE]``.

A pile of cubes that settles in a shaft (`scenes.heap`), from a few to many: time of a step against its contacts once
it has fallen, and the exponent that fits. And the broad phase alone, for cubes spread evenly in a box at one density:
time against the pairs that it finds. Result and plot are written only where they are asked for.
"""

from __future__ import annotations

import json as json_of
import time
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated

import numpy as np
import typer

import physics
from benchmarks import machine
from physics import scenes
from physics.kernels.many.arrays import PAIRS
from physics.kernels.many.near import find_pairs
from rigid_env.measure.plotting import require_matplotlib
from rigid_env.measure.workloads import STEP

PILES, QUICK_PILES = (25, 50, 100, 200, 400), (5, 10)
SPREADS, QUICK_SPREADS = (10, 100, 1000), (10, 100)
SETTLE, QUICK_SETTLE = 1600, 200  # steps: the highest of 400 cubes falls for 2.4 s
PARTS = 5  # of the time that is measured; the median part counts
CALLS = 50  # of the broad phase in one sample
VOLUME = 4.0  # of the box per unit cube [m³]


@dataclass(frozen=True)
class Sample:
    """What one size costs.

    Attributes
    ----------
    bodies : int
    found : float
        Contacts of a step, or near pairs.
    seconds : float
        Of a step, or of one broad phase [s].
    unconverged : float
        Share of the solves that did not reach the tolerance.
    """

    bodies: int
    found: float
    seconds: float
    unconverged: float = 0.0


def pile(count: int, settle: int, accuracy: str) -> Sample:
    """Let `count` cubes settle, then measure for a quarter of that time."""
    world = physics.World(scenes.heap(count), dt=STEP, accuracy=accuracy)
    world.step(steps=settle)
    steps, times, contacts, solves, failed = max(1, settle // (4 * PARTS)), [], [], 0, 0
    for _ in range(PARTS):
        start = time.perf_counter()
        report = world.step(steps=steps)
        times.append((time.perf_counter() - start) / steps)
        contacts.append(len(world.contact_ends(0)))
        solves, failed = solves + int(report.solves[0]), failed + int(report.unconverged[0])
    return Sample(count, float(np.mean(contacts)), float(np.median(times)), failed / max(1, solves))


def spread(count: int) -> Sample:
    """The broad phase of `count` unit cubes, at random in a box and turned at random."""
    rng = np.random.default_rng(count)
    side = (VOLUME * count) ** (1 / 3)
    turns = rng.normal(size=(count, 4))
    places = rng.uniform(0.0, side, (count, 3))
    bodies = [physics.Block((1.0, 1.0, 1.0), 1.0, pos=p, quat=q / np.linalg.norm(q)) for p, q in zip(places, turns)]
    world = physics.World(physics.Scene(bodies, (), [physics.Contact()]), dt=STEP, accuracy="fast")
    world.step()
    many, times = world.scratch[0], []
    for _ in range(PARTS):
        start = time.perf_counter()
        for _ in range(CALLS):
            find_pairs(STEP, many)
        times.append((time.perf_counter() - start) / CALLS)
    return Sample(count, float(many.counts[PAIRS]), float(np.median(times)))


def exponent(samples: list[Sample]) -> float:
    """Slope of the logarithm of time against that of what was found."""
    x, y = np.log([max(s.found, 1.0) for s in samples]), np.log([s.seconds for s in samples])
    return float(np.polyfit(x, y, 1)[0])


def draw(path: Path, piles: list[Sample], spreads: list[Sample]) -> None:
    """Both, side by side, logarithmic."""
    require_matplotlib()
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(10.0, 4.0), layout="constrained")
    FigureCanvasAgg(figure)
    panels = figure.subplots(1, 2)
    for panel, samples, what, x in (
        (panels[0], piles, "a step of a pile that lies", "contacts"),
        (panels[1], spreads, "the broad phase", "near pairs"),
    ):
        found, times = [s.found for s in samples], [1e6 * s.seconds for s in samples]
        panel.loglog(found, times, "o-", color="#0072b2")
        panel.loglog(found, [times[0] * f / found[0] for f in found], "--", color="#8a8a8a", label="linear")
        for sample, t in zip(samples, times):
            panel.annotate(f"{sample.bodies} bodies", (sample.found, t), textcoords="offset points", xytext=(6, -10))
        panel.set(xlabel=x, ylabel="time [µs]", title=f"{what}: exponent {exponent(samples):.2f}")
        panel.legend(frameon=False)
    figure.savefig(path, dpi=130)


def main(
    json: Annotated[Path | None, typer.Option(help="Where to write the result.")] = None,
    plot: Annotated[Path | None, typer.Option(help="Where to draw it.")] = None,
    quick: Annotated[bool, typer.Option("--quick", help="Only see that it runs.")] = False,
    accuracy: Annotated[str, typer.Option(help="Preset: fast or balanced.")] = "fast",
) -> None:
    """Measure how the cost of a step grows with the contacts of a pile, and that of the broad phase with its pairs."""
    piles = [pile(n, QUICK_SETTLE if quick else SETTLE, accuracy) for n in (QUICK_PILES if quick else PILES)]
    spreads = [spread(n) for n in (QUICK_SPREADS if quick else SPREADS)]
    for what, samples in (("contacts", piles), ("near pairs", spreads)):
        for s in samples:
            typer.echo(
                f"{s.bodies:5d} bodies {s.found:7.0f} {what:10s} {1e6 * s.seconds:9.1f} µs"
                f"  {100 * s.unconverged:4.1f} % unconverged"
            )
        if not quick:
            typer.echo(f"exponent {exponent(samples):.2f}")
    if plot is not None:
        draw(plot, piles, spreads)
    if json is not None:
        found = {"accuracy": accuracy, "piles": [asdict(s) for s in piles], "broad_phase": [asdict(s) for s in spreads]}
        found["exponents"] = {"piles": exponent(piles), "broad_phase": exponent(spreads)}
        json.write_text(json_of.dumps({"machine": machine.headline(), **found}, indent=1) + "\n")


if __name__ == "__main__":
    typer.run(main)
