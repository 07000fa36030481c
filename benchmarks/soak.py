"""Look for failures as long as one likes: ``python -m benchmarks.soak --minutes 5 --seed 0 --keep DIR [--env ID]``.

Without ``--env``: random scenes, parameters, states and wrenches (`rigid_env.hard_cases.cases.random_scenes`), some of
them among fixed and driven bodies (`benchmarks.drawn_scenery`), held against their laws. With it: an agent that pushes
with all its strength, at random and for long into the walls, at every accuracy; states stay finite and inside, rewards
and successes are computed anew from the states. Each failure is kept, shrunk, as a recording for ``rigid-env replay``.
Ctrl-C ends it early; what was found is written all the same.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from rich.console import Console
from rich.progress import Progress

import physics
from benchmarks import drawn_scenery, machine, soak_env, soak_spread
from benchmarks.shrink import shrink
from rigid_env.cli.spreading import Address, Jobs, Launcher, make_place
from rigid_env.hard_cases.cases import random_draws, random_scenes
from rigid_env.lab.measure.machine import write_json
from rigid_env.launchers.job import Job
from rigid_env.launchers.place import Place

BATCH = 200
RECORDED = 40  # steps: a whole run of `random_scenes.drive`
KEPT_PER_LAW = 5  # recordings of each family and kind of failure


SCENERY = {"furniture": False, "room": True}
"""Families whose scenes are drawn anew for each batch, and whether theirs is a room (`benchmarks.drawn_scenery`)."""

FAMILIES = (*random_draws.BODIES, *SCENERY)


@dataclass(frozen=True)
class Family:
    """Random scenes of one kind.

    Attributes
    ----------
    worlds : Callable
        Makes the worlds of a batch from a generator.
    draws : dict
        Arguments of `random_scenes.drive` that draw states and loads.
    """

    worlds: Callable[[np.random.Generator], physics.World]
    draws: dict[str, Callable] = field(default_factory=dict)


def _family(name: str, accuracy: str) -> Family:
    if name in SCENERY:
        draws = {"start": drawn_scenery.begin, "load": drawn_scenery.draw_load}
        return Family(
            lambda rng: physics.World(drawn_scenery.draw_scene(rng, SCENERY[name]), worlds=BATCH, accuracy=accuracy),
            draws,
        )
    world = physics.World(random_draws.scene_of(name), worlds=BATCH, accuracy=accuracy)
    return Family(lambda rng: world)


def soak_scenes(
    seconds: float, seed: int, accuracy: str, keep: Path | None, tick, names: Iterable[str] = FAMILIES
) -> dict:
    """Random scenes of the families `names` for so many seconds: numbers of what was run, and of what was found."""
    rng, found = np.random.default_rng(seed), {}
    families = {name: _family(name, accuracy) for name in names}
    for name, family in families.items():
        family.worlds(np.random.default_rng(0)).step(dt=1e-9)  # compiles
        found[name] = {"worlds": 0, "steps": 0, "failures": {}, "largest_gain": 0.0, "told": 0, "left_after_told": 0}
    deadline = time.monotonic() + seconds
    try:
        while time.monotonic() < deadline:
            for name, family in families.items():
                _soak_batch(name, family, rng, found[name], keep)
                tick(", ".join(f"{each} {one['worlds']}: {_failures(one)}" for each, one in found.items()))
    except KeyboardInterrupt:
        pass
    return found


def _failures(found: dict) -> str:
    count = sum(found["failures"].values())
    return f"{count} failures" if count else "no failure"


def _soak_batch(name: str, family: Family, rng, found: dict, keep: Path | None) -> None:
    world = family.worlds(rng)
    recorder = physics.Recorder(world, keep=RECORDED)

    def told(index: int, law: str) -> None:
        kind = law.split()[0]
        found["failures"][kind] = found["failures"].get(kind, 0) + 1
        if keep is None or found["failures"][kind] > KEPT_PER_LAW:
            return
        keep.mkdir(parents=True, exist_ok=True)
        small = shrink(recorder.recording(index, f"{name}: {law}"))
        number = found["failures"][kind]
        small.save(keep / f"{name}-{kind}-{world.accuracy.scheme}-{number}.npz")

    outcome = random_scenes.drive(world, rng, told, **family.draws)
    recorder.stop()
    found["worlds"] += world.worlds
    found["steps"] += world.worlds * (2 * random_scenes.PUSHED + random_scenes.FREE)
    found["told"] += int(outcome.told.sum())
    found["left_after_told"] += int(outcome.has_left.sum())
    found["largest_gain"] = max(found["largest_gain"], float(outcome.gain.max()))


def main(
    minutes: Annotated[float, typer.Option(min=0.0, help="How long.")] = 5.0,
    seed: Annotated[int, typer.Option(min=0)] = 0,
    keep: Annotated[Path | None, typer.Option(metavar="DIR", help="Where recordings of failures go.")] = None,
    env: Annotated[list[str] | None, typer.Option(metavar="ID", help="Environments instead of scenes.")] = None,
    accuracy: Annotated[
        list[str] | None, typer.Option(help="Presets; none: balanced for scenes, all for --env.")
    ] = None,
    family: Annotated[list[str] | None, typer.Option(help="Kinds of random scenes; none: all.")] = None,
    json: Annotated[Path | None, typer.Option(metavar="FILE", help="Instead of benchmarks/results/soak.json.")] = None,
    launcher: Launcher = None,
    seeds: Annotated[int, typer.Option(min=1, help="Of --launcher: seeds from --seed on, each for --minutes.")] = 2,
    jobs: Jobs = 2,
    address: Address = None,
) -> None:
    """Run random scenes, or environments, and report what breaks a law."""
    console = Console()
    presets = accuracy or (list(physics.PRESETS) if env else ["balanced"])
    for name in presets:
        physics.accuracy.resolve(name)
    for name in family or ():
        if name not in FAMILIES:
            raise typer.BadParameter(f"family is {name!r}; allowed are {', '.join(FAMILIES)}")
    path = json or machine.RESULTS / ("soak_env.json" if env else "soak.json")
    console.print(machine.headline())
    place = make_place(launcher, jobs, address, path)
    if not place.is_here:
        if env or family:
            raise typer.BadParameter(
                "env or family is given with a launcher; allowed are all random scenes, without --env and --family"
            )
        spread = soak_spread.make_jobs(minutes, range(seed, seed + seeds), presets, keep, place.folder)
        _soak_there(console, place, spread, path, {"seed": seed, "seeds": seeds, "minutes": minutes})
        return
    parts = [(preset, name) for preset in presets for name in env or [None]]
    found: dict = {}
    with Progress(console=console, transient=True) as progress:
        task = progress.add_task("soaking", total=len(parts))
        for preset, name in parts:
            seconds = 60.0 * minutes / len(parts)

            def tick(what: str, preset=preset) -> None:
                progress.update(task, description=f"{preset}: {what}")

            if name is None:
                found[preset] = soak_scenes(seconds, seed, preset, keep, tick, family or FAMILIES)
            else:
                found[f"{name} {preset}"] = soak_env.soak(name, preset, seconds, seed, keep, tick)
            progress.advance(task)
    write_json(path, {"seed": seed, "minutes": minutes, "found": found})
    console.print_json(data=found)
    console.print(f"written to {path}")


def _soak_there(console: Console, place: Place, jobs: list[Job], path: Path, settings: dict) -> None:
    """Soak at a place, and write what all seeds found together."""
    found, errors = soak_spread.merge(place.watch(jobs, console))
    for error in errors:
        console.print(f"Error: {error}", soft_wrap=True)
    if not place.is_printed:
        write_json(path, {**settings, "found": found})
        console.print_json(data=found)
        console.print(f"written to {path}")
    if errors:
        raise typer.Exit(1)


if __name__ == "__main__":
    typer.run(main)
