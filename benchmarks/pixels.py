"""Time of a picture: ``python -m benchmarks.pixels [--quick] [--json FILE]``.

Three pictures: the block in the three-wall box as a pixel observation of 84 x 84, from `physics.World` to the array,
one world of a batch after the other; the same block as a frame of a video, 640 x 400 with arrows and text; and fifty
blocks, spheres and ellipsoids in a shaft, 960 x 600. They are drawn in turns, and medians count. Times are CPU times:
drawing has one thread, and on a core that it has for itself they are those of the clock, which the notes hold.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path
from typing import Annotated

import numpy as np
import typer

import physics
from benchmarks import machine
from physics import scenes
from rigid_env.lab.measure.table import make_table
from rigid_env.lab.measure.timing import Row, Spread, interleave
from rigid_env.lab.measure.workloads import STEP
from rigid_env.rendering import Renderer
from rigid_env.rendering.picture import world_frame
from rigid_env.rendering.pixels import PixelObserver
from rigid_env.rendering.staging import Stage
from rigid_env.terminal import make_console

WORLDS = 64
BODIES = 50
REPEATS, QUICK_REPEATS = 15, 2
OBSERVATION, VIDEO, PICTURE = (84, 84), (640, 400), (960, 600)  # width and height [px]
FLIGHT = 80  # steps in which the block falls and hits the floor in some worlds
FALL = 400  # steps in which the fifty bodies become a pile
TARGETS = {"observation": 1.0, "video": None, "pile": 30.0}  # of a picture at most [ms]


def falling_blocks() -> physics.World:
    """Worlds of the block in the three-wall box, at random places and turned at random, on their way down."""
    rng = np.random.default_rng(1)
    world = physics.World(scenes.drop(), worlds=WORLDS, dt=STEP, accuracy="fast")
    quat = rng.standard_normal((WORLDS, 1, 4))
    pos = rng.uniform((-6.0, 3.5, -5.0), (6.0, 7.0, 5.0), (WORLDS, 1, 3))
    world.set_state(pos=pos, quat=quat / np.linalg.norm(quat, axis=-1, keepdims=True))
    world.step(steps=FLIGHT)
    return world


def mixed_heap(steps: int) -> physics.World:
    """Blocks, spheres and ellipsoids in turn, fallen in layers of 5 x 5 into the shaft of `scenes.heap`."""
    heap = scenes.heap(BODIES)
    shapes = (
        lambda **start: physics.Block((1.2, 1.0, 0.8), 1.0, **start),
        lambda **start: physics.Sphere(0.6, 1.0, **start),
        lambda **start: physics.Ellipsoid((0.8, 0.6, 0.45), 1.0, **start),
    )
    bodies = [shapes[k % 3](pos=cube.pos, quat=cube.quat) for k, cube in enumerate(heap.bodies)]
    world = physics.World(physics.Scene(bodies, heap.walls, heap.effects), dt=STEP, accuracy="fast")
    world.step(steps=steps)
    return world


def _observe() -> Callable[[int], None]:
    world, observer = falling_blocks(), PixelObserver(*OBSERVATION)
    pictures = np.zeros((WORLDS, *observer.shape), dtype=np.uint8)
    return lambda k: observer.observe_world(world, k % WORLDS, pictures[k % WORLDS])


def _film() -> Callable[[int], None]:
    world, renderer = falling_blocks(), Renderer(*VIDEO)
    return lambda k: renderer.draw(world_frame(world, k % WORLDS, text=("distance 1.00 m",)))


def _draw_pile(is_quick: bool) -> Callable[[int], None]:
    world = mixed_heap(1 if is_quick else FALL)
    stage = Stage(world.scene, world_frame(world), world.pos)
    renderer = Renderer(*PICTURE, bounds=stage.bounds)
    return lambda _: renderer.draw(stage.place(world_frame(world, arrows=False)))


def measure(is_quick: bool) -> list[Row]:
    """One row for each picture, in milliseconds."""
    pictures = {
        "observation": (_observe(), WORLDS, "block in three walls, 84 x 84, no arrows"),
        "video": (_film(), WORLDS // 4, "block in three walls, 640 x 400, arrows and text"),
        "pile": (_draw_pile(is_quick), 2, f"{BODIES} bodies, 960 x 600, no arrows"),
    }
    clock: dict[str, list[float]] = {name: [] for name in pictures}

    def run(name: str) -> float:
        draw, count, _ = pictures[name]
        start, cpu_start = time.perf_counter(), time.process_time()
        for k in range(count):
            draw(k)
        clock[name].append(1e3 * (time.perf_counter() - start) / count)
        return 1e3 * (time.process_time() - cpu_start) / count

    repeats = QUICK_REPEATS if is_quick else REPEATS
    spreads = interleave({name: lambda name=name: run(name) for name in pictures}, repeats)
    return [_row(name, pictures[name][2], spread, clock[name][1:]) for name, spread in spreads.items()]


def _row(name: str, what: str, cpu: Spread, clock: list[float]) -> Row:
    notes = {"pictures_per_second": 1e3 / cpu.median, "clock_ms": Spread(tuple(clock)).to_dict()}
    return Row(name, what, "ms a picture", cpu, target=TARGETS[name], is_ratio=False, notes=notes)


def main(
    json: Annotated[Path | None, typer.Option(help="Where to write the result.")] = None,
    quick: Annotated[bool, typer.Option("--quick", help="Only see that it runs.")] = False,
) -> None:
    """Measure how long pictures take."""
    console = make_console()
    found = measure(quick)
    console.print(make_table(found, machine.headline()))
    for row in found:
        clock = row.notes["clock_ms"]["median"]
        console.print(f"{row.what}: {row.notes['pictures_per_second']:.0f} a second; by the clock {clock:.2f} ms")
    if json is not None or not quick:
        console.print(f"written to {machine.keep('pixels', found, json, is_quick=quick, worlds=WORLDS, bodies=BODIES)}")


if __name__ == "__main__":
    typer.run(main)
