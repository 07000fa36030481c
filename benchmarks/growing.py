"""Cost of a step as a pile grows: ``python -m benchmarks.growing [--quick] [--peer] [--json FILE] [--plot FILE]``.

Layer upon layer of 5 x 5 unit cubes, turned at random, falls onto a pile in a shaft (that of `canonical_scenes.heap`),
each a diagonal above the highest cube, each 1.5 s after the one before: whatever its height, the pile is given the same
to do, and all of the rest has to be held. Time of a step against its contacts, the mean over those 1.5 s, and the
exponent that fits from the pile on that is `DEEP` layers deep: of the first two layers nearly all lie side by side on
the floor, each body with contacts of its own, which differs from a pile.

With ``--peer`` MuJoCo takes the same 300 steps of some of these piles, from where ours are, once with each of two of
its solvers. With ``--json`` the result is written after each layer.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import numpy as np
import typer

import physics
from benchmarks.piles import OURS, SOLVERS, exponent
from benchmarks.settling import Ours, Sample, Theirs, Watch
from physics import scenes
from rigid_env.lab.measure import mujoco_scene
from rigid_env.lab.measure.machine import write_json
from rigid_env.lab.measure.plotting import make_figure

LAYERS, QUICK_LAYERS = 32, 2
PEER_LAYERS = (4, 8, 16)  # MuJoCo takes a minute for the last one
DEEP = 4  # layers from which on it is a pile
WIDTH = 5  # of a layer, in cubes
PITCH = 1.75  # of its grid [m], as in `canonical_scenes.heap`
DIAGONAL = 1.7321  # of a cube, rounded up [m]
PART, PARTS, QUICK_PARTS = 20, 15, 1  # steps of a part, and parts for each layer


def grown(bodies: list[physics.Block], seed: int) -> list[physics.Block]:
    """The bodies of a pile and one more layer above them, which touches nothing."""
    rng = np.random.default_rng(seed)
    top = max((body.pos[1] for body in bodies), default=0.0)
    height = top + (1.5 if bodies else 0.5) * DIAGONAL  # its lowest corners are a diagonal above the highest centre
    layer = []
    for k in range(WIDTH * WIDTH):
        q = rng.standard_normal(4)
        place = (PITCH * (k % WIDTH - WIDTH // 2), height, PITCH * (k // WIDTH - WIDTH // 2))
        layer.append(physics.Block((1.0, 1.0, 1.0), 1.0, pos=place, quat=q / np.linalg.norm(q)))
    return bodies + layer


def bodies_of(world: physics.World) -> list[physics.Block]:
    """The cubes of a world, as they are and move."""
    states = zip(world.pos[0], world.quat[0], world.linvel[0], world.angvel[0])
    return [physics.Block((1.0, 1.0, 1.0), 1.0, pos=x, quat=q, linvel=v, angvel=w) for x, q, v, w in states]


def grow(layers: int, accuracy: str) -> Iterator[tuple[physics.Scene, Ours]]:
    """Layer by layer the scene as it begins, and the pile: whoever is given it advances it."""
    shaft, bodies = scenes.heap(1), []
    for layer in range(layers):
        scene = physics.Scene(grown(bodies, layer), shaft.walls, shaft.effects)
        pile = Ours(scene, accuracy)
        yield scene, pile
        bodies = bodies_of(pile.world)


def measure(count: int, pile: Ours | Theirs, parts: int) -> Sample:
    """Measure a step of a pile of `count` cubes, the mean over so many parts."""
    watch = Watch(pile)
    for _ in range(parts):
        watch.part(PART)
    return watch.sample(count, float(np.mean(watch.times)))


def fit(samples: list[Sample]) -> float | None:
    """Exponent over the piles that are `DEEP` layers deep, where there are two of them."""
    deep = [s for s in samples if s.bodies >= DEEP * WIDTH * WIDTH]
    return exponent(deep) if len(deep) > 1 else None


def _note(name: str, sample: Sample, found: dict[str, list[Sample]]) -> None:
    found.setdefault(name, []).append(sample)
    line = f"{name:15s} {sample.bodies:4d} cubes {sample.found:6.0f} contacts {1e6 * sample.seconds:9.1f} µs a step"
    line += f", {1e6 * sample.seconds / sample.found:.2f} a contact; {1e3 * sample.deepest:.2f} mm deep"
    if sample.unconverged is not None:
        line += f"; {100 * sample.unconverged:.0f} % unconverged, residual {sample.residual:.1e}"
    typer.echo(line)


def to_dict(found: dict[str, list[Sample]], accuracy: str) -> dict:
    """All that was found so far, for JSON."""
    series = {name: {"exponent": fit(s), "samples": [asdict(one) for one in s]} for name, s in found.items()}
    return {"name": "growing", "accuracy": accuracy, "from_layer": DEEP, **series}


def draw(path: Path, found: dict[str, list[Sample]]) -> None:
    """Time of a step against its contacts, logarithmic, and what would be linear."""
    figure = make_figure(6.5, 4.5)
    panel = figure.subplots()
    for color, (name, samples) in zip(("#0072b2", "#d55e00", "#cc79a7"), found.items()):
        slope = fit(samples)
        label = name if slope is None else f"{name}: exponent {slope:.2f}"
        panel.loglog([s.found for s in samples], [1e6 * s.seconds for s in samples], "o-", color=color, label=label)
    last = found[OURS][-1]
    ends = (found[OURS][0].found, last.found)
    line = [1e6 * last.seconds * x / last.found for x in ends]
    panel.loglog(ends, line, "--", color="#8a8a8a", label="linear")
    panel.set(xlabel="contacts", ylabel="time [µs]", title="a step of a pile onto which a layer falls")
    panel.legend(frameon=False)
    figure.savefig(path, dpi=130)


def main(
    json: Annotated[Path | None, typer.Option(help="Where to write the result.")] = None,
    plot: Annotated[Path | None, typer.Option(help="Where to draw it.")] = None,
    quick: Annotated[bool, typer.Option("--quick", help="Only see that it runs.")] = False,
    accuracy: Annotated[str, typer.Option(help="Preset: fast or balanced.")] = "fast",
    layers: Annotated[int, typer.Option(min=1, help="How high the pile grows.")] = LAYERS,
    peer: Annotated[bool, typer.Option("--peer", help="MuJoCo takes the same steps.")] = False,
) -> None:
    """Measure how the cost of a step grows with the contacts of a pile that layer upon layer falls onto."""
    if peer and not mujoco_scene.is_installed():
        raise typer.BadParameter("MuJoCo is not installed: pip install 'rigid-env[bench]'", param_hint="--peer")
    json, plot = (path and path.resolve() for path in (json, plot))
    layers, parts = (QUICK_LAYERS, QUICK_PARTS) if quick else (layers, PARTS)
    peer_layers = () if not peer else range(1, layers + 1) if quick else PEER_LAYERS
    found: dict[str, list[Sample]] = {}
    with mujoco_scene.elsewhere():
        for scene, pile in grow(layers, accuracy):
            count = len(scene.bodies)
            _note(OURS, measure(count, pile, parts), found)
            for solver in SOLVERS if count // (WIDTH * WIDTH) in peer_layers else ():
                _note(f"MuJoCo, {solver}", measure(count, Theirs(scene, solver), parts), found)
            if json is not None:
                write_json(json, to_dict(found, accuracy))
    if plot is not None:
        draw(plot, found)
    for name, samples in found.items():
        if (slope := fit(samples)) is not None:
            typer.echo(f"exponent from {DEEP} layers on, {name}: {slope:.2f}")


if __name__ == "__main__":
    typer.run(main)
