"""Cost of a step by the size of a pile: ``python -m benchmarks.piles [--quick] [--peer] [--json FILE] [--plot FILE]``.

A pile of cubes that settles in a shaft (`canonical_scenes.heap`), from a few to many: time of a step against its
contacts once it lies, and while it falls and settles, and the exponents that fit. And the broad phase alone, for cubes
spread evenly in a box at one density: time against the pairs that it finds. With ``--peer`` MuJoCo takes the same steps
of the same piles, once with each of two of its solvers (a quarter of an hour). With ``--json`` the result is written
after each pile.
"""

from __future__ import annotations

import time
from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import numpy as np
import typer

import physics
from benchmarks.settling import PARTS, Ours, Sample, Theirs, settle
from physics import scenes
from physics.kernels.multibody.broadphase.sweep_and_prune import find_pairs
from physics.kernels.multibody.data.arrays import NUM_PAIRS
from rigid_env.lab.measure import mujoco_scene
from rigid_env.lab.measure.machine import write_json
from rigid_env.lab.measure.plotting import make_figure
from rigid_env.lab.measure.workloads import STEP

PILES, QUICK_PILES = (25, 50, 100, 200, 400), (5, 10)
SPREADS, QUICK_SPREADS = (10, 100, 1000), (10, 100)
LIMIT, QUICK_LIMIT = 8000, 200  # steps in which a pile has to settle
CALLS = 50  # of the broad phase in one sample
VOLUME = 4.0  # of the box per unit cube [m³]
SOLVERS = ("Newton", "CG")  # of MuJoCo: its default, and the one that grows less
OURS = "ours"

Series = dict[str, list[Sample]]


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
    return Sample(count, float(many.counts[NUM_PAIRS]), float(np.median(times)))


def exponent(samples: list[Sample]) -> float:
    """Slope of the logarithm of time against that of what was found."""
    x, y = np.log([max(s.found, 1.0) for s in samples]), np.log([s.seconds for s in samples])
    return float(np.polyfit(x, y, 1)[0])


def measure_pile(count: int, limit: int, accuracy: str, solvers: tuple[str, ...], found: dict[str, Series]) -> None:
    """Let a pile of `count` cubes settle, ours and then MuJoCo's for as many steps, and add to what was `found`."""
    falling, lying = settle(count, Ours(scenes.heap(count), accuracy), limit)
    _note(OURS, falling, lying, found)
    for solver in solvers:
        pair = settle(count, Theirs(scenes.heap(count), solver), falling.steps, until_it_lies=False)
        _note(f"MuJoCo, {solver}", *pair, found)


def _note(name: str, falling: Sample, lying: Sample, found: dict[str, Series]) -> None:
    series = found.setdefault(name, {"piles": [], "falling": []})
    for what, sample, kind in (("falls", falling, "falling"), ("lies", lying, "piles")):
        series[kind].append(sample)
        ratio = sample.seconds / found[OURS][kind][-1].seconds
        line = f"{name:15s} {sample.bodies:4d} cubes  {what:5s} {sample.found:6.0f} contacts"
        line += f" {1e6 * sample.seconds:9.1f} µs, {ratio:.3g} of ours"
        line += f"; {sample.steps:5d} steps, fastest {sample.fastest:.1e} m/s"
        if sample.unconverged is not None:
            line += f", {100 * sample.unconverged:.1f} % unconverged"
        typer.echo(line)


def draw(path: Path, found: dict[str, Series], spreads: list[Sample]) -> None:
    """Time against what is found, side by side, logarithmic: piles that lie, that fall, and the broad phase."""
    figure = make_figure(15.0, 4.0)
    panels = (
        ("a step of a pile that lies", "contacts", {name: series["piles"] for name, series in found.items()}),
        ("a step while it falls and settles", "contacts", {name: series["falling"] for name, series in found.items()}),
        ("the broad phase", "near pairs", {OURS: spreads}),
    )
    for panel, (what, x, contenders) in zip(figure.subplots(1, len(panels)), panels):
        for color, (name, samples) in zip(("#0072b2", "#d55e00", "#cc79a7"), contenders.items()):
            _draw_samples(panel, name, samples, color)
        panel.set(xlabel=x, ylabel="time [µs]", title=what)
        panel.legend(frameon=False)
    figure.savefig(path, dpi=130)


def _draw_samples(panel, name: str, samples: list[Sample], color: str) -> None:
    count, times = [s.found for s in samples], [1e6 * s.seconds for s in samples]
    panel.loglog(count, times, "o-", color=color, label=f"{name}: exponent {exponent(samples):.2f}")
    if name != OURS:
        return
    panel.loglog(count, [times[0] * f / count[0] for f in count], "--", color="#8a8a8a", label="linear")
    for sample, t in zip(samples, times):
        panel.annotate(f"{sample.bodies} bodies", (sample.found, t), textcoords="offset points", xytext=(6, -10))


def to_dict(found: dict[str, Series], spreads: list[Sample], accuracy: str) -> dict:
    """All that was found so far, for JSON; exponents where there are two sizes."""
    kept = {name: dict(series) for name, series in found.items()}
    kept[OURS]["broad_phase"] = spreads
    for series in kept.values():
        exponents = {kind: exponent(samples) for kind, samples in series.items() if len(samples) > 1}
        series.update({kind: [asdict(s) for s in samples] for kind, samples in series.items()}, exponents=exponents)
    ours, peers = kept.pop(OURS), kept
    return {"name": "piles", "accuracy": accuracy, **ours, **({"peers": peers} if peers else {})}


def main(
    json: Annotated[Path | None, typer.Option(help="Where to write the result.")] = None,
    plot: Annotated[Path | None, typer.Option(help="Where to draw it.")] = None,
    quick: Annotated[bool, typer.Option("--quick", help="Only see that it runs.")] = False,
    accuracy: Annotated[str, typer.Option(help="Preset: fast or balanced.")] = "fast",
    peer: Annotated[bool, typer.Option("--peer", help="MuJoCo takes the same steps.")] = False,
) -> None:
    """Measure how the cost of a step grows with the contacts of a pile, and that of the broad phase with its pairs."""
    if peer and not mujoco_scene.is_installed():
        raise typer.BadParameter("MuJoCo is not installed: pip install 'rigid-env[bench]'", param_hint="--peer")
    json, plot = (path and path.resolve() for path in (json, plot))
    found, spreads = {}, []

    def keep() -> None:
        if json is not None:
            write_json(json, to_dict(found, spreads, accuracy))

    with mujoco_scene.elsewhere():
        for count in QUICK_PILES if quick else PILES:
            measure_pile(count, QUICK_LIMIT if quick else LIMIT, accuracy, SOLVERS if peer else (), found)
            keep()
    for count in QUICK_SPREADS if quick else SPREADS:
        spreads.append(spread(count))
        sample = spreads[-1]
        typer.echo(f"broad phase, {count} cubes: {sample.found:.0f} near pairs {1e6 * sample.seconds:.1f} µs")
    keep()
    if plot is not None:
        draw(plot, found, spreads)
    for name, series in found.items():
        lies, falls = exponent(series["piles"]), exponent(series["falling"])
        typer.echo(f"exponents, {name}: {lies:.2f} lying, {falls:.2f} falling")
    typer.echo(f"exponent of the broad phase: {exponent(spreads):.2f}")


if __name__ == "__main__":
    typer.run(main)
