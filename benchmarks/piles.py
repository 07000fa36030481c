"""How cost grows with a pile: ``python -m benchmarks.piles [--quick] [--json FILE] [--plot FILE]``.

A pile of cubes that settles in a shaft (`scenes.heap`), from a few to many: time of a step against its contacts once
it lies, and while it falls and settles, and the exponents that fit. And the broad phase alone, for cubes spread evenly
in a box at one density: time against the pairs that it finds. Result and plot are written only where asked for.
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
LIMIT, QUICK_LIMIT = 8000, 200  # steps in which a pile has to settle
LIES = 1e-3  # a pile lies once no body of it has been faster than this [m/s] ...
LIES_FOR = 400  # ... for so many steps; and so many are measured then
PARTS = 5  # of what is measured; the median part counts
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
    steps : int
        That it took.
    fastest : float
        Speed of the fastest body at the end [m/s].
    """

    bodies: int
    found: float
    seconds: float
    unconverged: float = 0.0
    steps: int = 0
    fastest: float = 0.0


class Watch:
    """A pile as it is stepped: parts of so many steps, what they cost and how fast it was at the end of each."""

    def __init__(self, world: physics.World) -> None:
        self.world, self.steps = world, 0
        self.times, self.contacts, self.speeds, self.solves, self.failed = [], [], [], 0, 0

    def part(self, steps: int) -> None:
        """Step the world."""
        start = time.perf_counter()
        report = self.world.step(steps=steps)
        self.times.append((time.perf_counter() - start) / steps)
        self.contacts.append(len(self.world.contact_ends(0)))
        self.speeds.append(float(np.linalg.norm(self.world.linvel[0], axis=-1).max()))
        self.solves, self.failed = self.solves + int(report.solves[0]), self.failed + int(report.unconverged[0])
        self.steps += steps

    def lies(self, parts: int) -> bool:
        """Whether nothing was fast at the end of any of the last parts."""
        return len(self.speeds) >= parts and max(self.speeds[-parts:]) <= LIES

    def sample(self, seconds: float) -> Sample:
        """What was seen, a step of it at `seconds`."""
        contacts, failed = float(np.mean(self.contacts)), self.failed / max(1, self.solves)
        return Sample(len(self.world.linvel[0]), contacts, seconds, failed, self.steps, self.speeds[-1])


def pile(count: int, limit: int, accuracy: str) -> tuple[Sample, Sample]:
    """Let `count` cubes settle until they lie, for `limit` steps at most: while they do, and what they cost then."""
    world = physics.World(scenes.heap(count), dt=STEP, accuracy=accuracy)
    world.step(dt=STEP * 1e-3)  # compiled
    size = LIES_FOR // (10 * PARTS)
    falling, lying = Watch(world), Watch(world)
    while falling.steps < limit and not falling.lies(LIES_FOR // size):
        falling.part(size)
    for _ in range(PARTS):
        lying.part(LIES_FOR // PARTS)
    return falling.sample(float(np.mean(falling.times))), lying.sample(float(np.median(lying.times)))


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


def draw(path: Path, panels_of: list[tuple[str, str, list[Sample]]]) -> None:
    """All, side by side, logarithmic: what, what it is drawn against, samples."""
    require_matplotlib()
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(5.0 * len(panels_of), 4.0), layout="constrained")
    FigureCanvasAgg(figure)
    for panel, (what, x, samples) in zip(figure.subplots(1, len(panels_of)), panels_of):
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
    piles = [pile(n, QUICK_LIMIT if quick else LIMIT, accuracy) for n in (QUICK_PILES if quick else PILES)]
    spreads = [spread(n) for n in (QUICK_SPREADS if quick else SPREADS)]
    kinds = [
        ("a step of a pile that lies", "contacts", [lying for _, lying in piles]),
        ("a step while it falls and settles", "contacts", [falling for falling, _ in piles]),
        ("the broad phase", "near pairs", spreads),
    ]
    for what, found, samples in kinds:
        typer.echo(what)
        for s in samples:
            more = f"  {s.steps:5d} steps {100 * s.unconverged:4.1f} % unconverged, fastest {s.fastest:.1e} m/s"
            more = more if s.steps else ""
            typer.echo(f"{s.bodies:5d} bodies {s.found:7.0f} {found:10s} {1e6 * s.seconds:9.1f} µs{more}")
        if not quick:
            typer.echo(f"exponent {exponent(samples):.2f}")
    if plot is not None:
        draw(plot, kinds)
    if json is not None:
        names = ("piles", "falling", "broad_phase")
        found = {name: [asdict(s) for s in samples] for name, (_, _, samples) in zip(names, kinds)}
        found["exponents"] = {name: exponent(samples) for name, (_, _, samples) in zip(names, kinds)}
        found = {"machine": machine.headline(), "accuracy": accuracy, **found}
        json.write_text(json_of.dumps(found, indent=1) + "\n")


if __name__ == "__main__":
    typer.run(main)
