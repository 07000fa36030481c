"""Rollouts and snapshots: ``python -m benchmarks.rollout [--quick] [--json FILE]``.

A rollout of 1,024 blocks shoved about in their box, against `World.step` in a loop with copies of the same columns, in
turns; and the time that a snapshot of them takes, and going back to it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import numpy as np
import typer

import physics
from benchmarks import machine
from physics import scenes
from rigid_env.lab.measure.table import make_table
from rigid_env.lab.measure.timing import Row, Spread, Stopwatch, interleave
from rigid_env.lab.measure.workloads import STEP
from rigid_env.terminal import make_console

LOOP, ROLLOUT = "World.step in a loop", "rollout"
FORCE = 50.0  # largest component of a wrench [N, N m]


@dataclass(frozen=True)
class Sizes:
    """Worlds, wrenches of each, turns, and calls of a snapshot in each turn."""

    worlds: int = 1024
    length: int = 100
    repeats: int = 21
    calls: int = 200


FULL, QUICK = Sizes(), Sizes(worlds=8, length=4, repeats=1, calls=2)


class Pair:
    """The same worlds twice: one rolled out, one stepped in a loop.

    Parameters
    ----------
    sizes : Sizes
    accuracy : str
    threads : int
    is_last_only : bool
        Whether only the last state is kept.
    """

    def __init__(self, sizes: Sizes, accuracy: str, threads: int, is_last_only: bool):
        self.worlds = [batch(sizes.worlds, accuracy, threads) for _ in range(2)]
        rng = np.random.default_rng(0)
        self.wrenches = rng.uniform(-FORCE, FORCE, (sizes.worlds, sizes.length, 1, 6))
        self.every = sizes.length if is_last_only else 1
        self.start = self.worlds[0].snapshot()
        self.rolled = physics.rollout(self.worlds[0], self.wrenches, self.start, every=self.every)
        self.copies = {name: np.empty_like(getattr(self.rolled, name)) for name in self.rolled.columns}

    def rollout(self) -> float:
        """World steps per second of `physics.rollout`."""
        self.worlds[0].restore(self.start)
        with Stopwatch() as watch:
            physics.rollout(self.worlds[0], self.wrenches, every=self.every, out=self.rolled)
        return self.wrenches.shape[0] * self.wrenches.shape[1] / watch.seconds

    def loop(self) -> float:
        """World steps per second of a loop that keeps the same."""
        world, length = self.worlds[1], self.wrenches.shape[1]
        world.restore(self.start)
        with Stopwatch() as watch:
            for k in range(length):
                world.step(self.wrenches[:, k])
                if (k + 1) % self.every == 0:
                    for name, copied in self.copies.items():
                        copied[:, (k + 1) // self.every - 1] = getattr(world, name)
        return self.wrenches.shape[0] * length / watch.seconds

    def are_the_same(self) -> bool:
        """True if both kept the same bits."""
        return all(np.array_equal(getattr(self.rolled, name), copied) for name, copied in self.copies.items())


def batch(worlds: int, accuracy: str, threads: int = 1) -> physics.World:
    """Blocks in their box, on the way to the floor: half a second before they meet it."""
    world = physics.World(scenes.by_name("drop"), worlds=worlds, dt=STEP, accuracy=accuracy, threads=threads)
    world.step(steps=80)
    return world


def rollout_row(sizes: Sizes, accuracy: str, threads: int, is_last_only: bool) -> Row:
    """A rollout against a loop."""
    pair = Pair(sizes, accuracy, threads, is_last_only)
    spreads = interleave({ROLLOUT: pair.rollout, LOOP: pair.loop}, sizes.repeats)
    kept = "the last state" if is_last_only else "all states"
    plural = "s" if threads > 1 else ""
    return Row(
        key=f"{'last' if is_last_only else 'all'}_{threads}_thread{plural}",
        what=f"{sizes.worlds:,} worlds, {sizes.length} steps, {kept}, {threads} thread{plural}", unit="world steps/s",
        ours=spreads[ROLLOUT], accuracy=accuracy, peer_name=LOOP, peer=spreads[LOOP],
        target=None if is_last_only else 1.2, is_valid=pair.are_the_same(), notes={"bytes": pair.rolled.nbytes},
    )  # fmt: skip


def snapshot_rows(worlds: int, accuracy: str, sizes: Sizes, limit: float) -> list[Row]:
    """Microseconds of a call that saves or restores a batch."""
    world = batch(worlds, accuracy)
    kept = world.snapshot()
    calls = {
        "save": world.snapshot, "save_over": lambda: world.snapshot(out=kept), "restore": lambda: world.restore(kept),
    }  # fmt: skip
    what = {"save": "snapshot()", "save_over": "snapshot(out=...)", "restore": "restore(...)"}
    spreads = interleave({name: microseconds(call, sizes.calls) for name, call in calls.items()}, sizes.repeats)
    return [snapshot_row(name, what[name], worlds, spread, accuracy, limit) for name, spread in spreads.items()]


def snapshot_row(name: str, what: str, worlds: int, spread: Spread, accuracy: str, limit: float) -> Row:
    """One line about snapshots."""
    count = f"{worlds:,} worlds" if worlds > 1 else "1 world"
    return Row(key=f"{name}_{worlds}", what=f"{what}, {count}", unit="µs", ours=spread, accuracy=accuracy,
               target=limit, is_ratio=False)  # fmt: skip


def microseconds(call: Callable[[], object], calls: int) -> Callable[[], float]:
    """A run of so many calls: µs of one."""

    def run() -> float:
        with Stopwatch() as watch:
            for _ in range(calls):
                call()
        return 1e6 * watch.seconds / calls

    return run


def main(
    json: Annotated[Path | None, typer.Option(help="Where to write the result.")] = None,
    quick: Annotated[bool, typer.Option("--quick", help="Only see that it runs.")] = False,
    accuracy: Annotated[str, typer.Option(help="Preset: fast or balanced.")] = "balanced",
) -> None:
    """Measure rollouts and snapshots."""
    sizes = QUICK if quick else FULL
    rows = [rollout_row(sizes, accuracy, threads, last) for last in (False, True) for threads in (1, 2)]
    rows += [*snapshot_rows(sizes.worlds, accuracy, sizes, 100.0), *snapshot_rows(1, accuracy, sizes, 10.0)]
    console = make_console()
    console.print(make_table(rows, machine.headline()))
    if quick and json is None:
        return
    path = machine.keep("rollout", rows, json, is_quick=quick, repeats=sizes.repeats)
    console.print(f"written to {path}")


if __name__ == "__main__":
    typer.run(main)
