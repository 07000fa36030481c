"""Cost of a body that does nothing: ``python -m benchmarks.sleeping [--quick] [--json FILE]``.

Towers asleep against the same ones awake, many steps in one call and one step in each; and a block that flies: without
contact in its kernel, with it in a large box, and beside walls that it could touch at any step. All in turns.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import typer

import physics
from benchmarks import machine
from physics import scenes
from rigid_env.lab.measure.table import make_table
from rigid_env.lab.measure.timing import Row, Stopwatch, interleave
from rigid_env.lab.measure.workloads import FLIGHT_STEPS, STEP
from rigid_env.terminal import make_console

REPEATS, QUICK_REPEATS = 11, 1
TOWERS = (10, 50)
ASLEEP, AWAKE = "asleep", "awake"
MILLION = 1_000_000
SETTLE = 10_000  # steps in which a tower falls asleep, at most

# Half widths of boxes [m]: one in which a flight, in which the block falls 490 m, meets nothing, and one that its
# bounding sphere of 3.08 m reaches beyond, while the block, 2.92 m from its axis to an edge as it turns, does not.
LARGE, NARROW = 1e3, 3.0


@dataclass(frozen=True)
class Sizes:
    """Numbers of steps of towers awake, of calls, and of flights of `FLIGHT_STEPS` steps in one run."""

    tower: int = 2000
    calls: int = 20_000
    flights: int = 100


FULL, QUICK = Sizes(), Sizes(tower=20, calls=20, flights=1)


def tower(count: int, accuracy: str, does_sleep: bool) -> physics.World:
    """A tower that has come to rest, and sleeps if it can."""
    scene = scenes.tower(count)
    if does_sleep:
        scene = physics.Scene(scene.bodies, scene.walls, [*scene.effects, physics.Sleeping()])
    world = physics.World(scene, dt=STEP, accuracy=accuracy)
    for _ in range(SETTLE):
        world.step()
        if world.asleep.all():
            return world
    if does_sleep:
        raise RuntimeError(f"the tower of {count} does not sleep after {SETTLE} steps at {accuracy}")
    return world


def at_once(world: physics.World, steps: int) -> Callable[[], float]:
    """A run of so many steps in one call: steps per second."""

    def run() -> float:
        with Stopwatch() as watch:
            world.step(steps=steps)
        return steps / watch.seconds

    return run


def one_by_one(world: physics.World, calls: int) -> Callable[[], float]:
    """A run of so many calls of a prepared step: steps per second."""
    stepper = physics.Stepper(world)

    def run() -> float:
        with Stopwatch() as watch:
            for _ in range(calls):
                stepper()
        return calls / watch.seconds

    return run


def from_start(world: physics.World, flights: int) -> Callable[[], float]:
    """A run of so many flights, each from where the world is now: steps per second."""
    start = world.snapshot()

    def run() -> float:
        watch = Stopwatch()
        for _ in range(flights):
            world.restore(start)
            with watch:
                world.step(steps=FLIGHT_STEPS)
        return flights * FLIGHT_STEPS / watch.seconds

    return run


def tower_rows(count: int, accuracy: str, sizes: Sizes, repeats: int) -> list[Row]:
    """A tower asleep against the same one awake."""
    worlds = {ASLEEP: tower(count, accuracy, True), AWAKE: tower(count, accuracy, False)}
    runs = {
        "in one call": (at_once(worlds[ASLEEP], MILLION), at_once(worlds[AWAKE], sizes.tower), 50.0),
        "a call each": (one_by_one(worlds[ASLEEP], sizes.calls), one_by_one(worlds[AWAKE], sizes.tower), None),
    }
    rows = []
    for how, (asleep, awake, target) in runs.items():
        spreads = interleave({ASLEEP: asleep, AWAKE: awake}, repeats)
        rows.append(
            Row(
                key=f"tower_{count}_{how.replace(' ', '_')}", what=f"tower of {count} asleep, {how}", unit="steps/s",
                ours=spreads[ASLEEP], accuracy=accuracy, peer_name="awake", peer=spreads[AWAKE], target=target,
                is_valid=bool(worlds[ASLEEP].asleep.all()),
            )
        )  # fmt: skip
    return rows


def box(half: float) -> list[physics.HalfSpace]:
    """Six walls at ±`half` [m]; of a narrow one only those across x, between which the block turns about z."""
    axes = range(3) if half == LARGE else range(1)
    return [physics.HalfSpace([s * (k == axis) for k in range(3)], -half) for axis in axes for s in (1.0, -1.0)]


def flights(accuracy: str) -> dict[str, physics.World]:
    """The block turning about z as it falls: bare, in a large box, and where it is near walls all the time."""
    laws = [physics.Contact(0.3), physics.Friction(0.5)]
    gravity = physics.Gravity((0.0, -scenes.GRAVITY, 0.0))
    worlds = {}
    for name, walls in (("bare", ()), ("in a large box", box(LARGE)), ("near walls", box(NARROW))):
        block = physics.Block(scenes.SIZE, scenes.MASS, angvel=(0.0, 0.0, 5.0))
        scene = physics.Scene([block], walls, [gravity, *(laws if walls else ())])
        worlds[name] = physics.World(scene, dt=STEP, accuracy=accuracy)
    return worlds


def flight_rows(accuracy: str, sizes: Sizes, repeats: int) -> list[Row]:
    """Bare flight against flight near walls, and flight in a large box against bare flight."""
    worlds = flights(accuracy)
    spreads = interleave({name: from_start(world, sizes.flights) for name, world in worlds.items()}, repeats)
    touched = {name: int(world.report.solves[0]) for name, world in worlds.items()}
    return [
        Row(
            key=key, what=f"flight, {one}", unit="steps/s", ours=spreads[one], accuracy=accuracy, peer_name=other,
            peer=spreads[other], target=target, is_valid=not any(touched.values()), notes={"contacts": touched},
        )
        for key, one, other, target in (
            ("bare_flight", "bare", "near walls", 1.3),
            ("large_box", "in a large box", "bare", 0.9),
        )
    ]  # fmt: skip


def main(
    json: Annotated[Path | None, typer.Option(help="Where to write the result.")] = None,
    quick: Annotated[bool, typer.Option("--quick", help="Only see that it runs.")] = False,
    accuracy: Annotated[str, typer.Option(help="Preset: fast or balanced.")] = "balanced",
) -> None:
    """Measure what sleep and flight cost."""
    sizes, repeats = (QUICK, QUICK_REPEATS) if quick else (FULL, REPEATS)
    rows = [row for count in TOWERS for row in tower_rows(count, accuracy, sizes, repeats)]
    rows += flight_rows(accuracy, sizes, repeats)
    console = make_console()
    console.print(make_table(rows, machine.headline()))
    if quick and json is None:
        return
    path = machine.keep("sleeping", rows, json, is_quick=quick, repeats=repeats)
    console.print(f"written to {path}")


if __name__ == "__main__":
    typer.run(main)
