"""Measure two threads against one while other programs use the machine: rows of a throughput table.

A ratio compares both under the same load, turn by turn. A busy process is an endless loop in Python; its niceness says
how much it leaves to others.
"""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace

from rigid_env.lab.measure import mujoco_scene, workloads
from rigid_env.lab.measure.rows import Tick, told
from rigid_env.lab.measure.timing import Row, interleave
from rigid_env.lab.measure.workloads import Sizes

ACCURACY = "balanced"
UNIT = "world steps/s"
ONE, TWO = "one thread", "two threads"
PEER = "MuJoCo's rollout"
LONGER = 3  # a run is so many times as long as the batch's: the system deals out processors in milliseconds
SETTLING = 0.3  # from the start of busy processes until something is measured [s]


@dataclass(frozen=True)
class Load:
    """Number and priority of busy processes beside the measured one.

    Attributes
    ----------
    busy : int
        Their number.
    nice : int
        Their niceness.
    target : float
        Least ratio of two threads to one.
    """

    busy: int
    nice: int
    target: float

    def __str__(self) -> str:
        if not self.busy:
            return "quiet machine"
        return f"beside {self.busy} busy process{'es' * (self.busy > 1)}" + f" at nice {self.nice}" * (self.nice > 0)


LOADS = (Load(0, 0, 1.8), *(Load(busy, nice, 0.95) for busy in (1, 2) for nice in (0, 10)))


@contextmanager
def beside(load: Load):
    """Run the busy processes of a load during the block."""
    command = f"import os\nif {load.nice}: os.nice({load.nice})\nwhile True: pass"
    processes = []
    try:
        for _ in range(load.busy):
            processes.append(subprocess.Popen([sys.executable, "-c", command]))
        time.sleep(SETTLING if load.busy else 0.0)
        yield
    finally:
        for process in processes:
            process.kill()
        for process in processes:
            process.wait()


def crowded_rows(sizes: Sizes, repeats: int, with_peer: bool, tick: Tick | None = None) -> Iterator[list[Row]]:
    """Measure the batch with one thread and two under each load; yields the row of each load.

    Parameters
    ----------
    sizes : Sizes
    repeats : int
        Of every contestant, in turns.
    with_peer : bool
        Whether the same ratio of MuJoCo's rollout is noted.
    tick : callable, optional
        Called before each run with its name.
    """
    longer = replace(sizes, batch_steps=LONGER * sizes.batch_steps)
    runners = {name: workloads.Batch(ACCURACY, replace(longer, threads=k)) for k, name in ((1, ONE), (2, TWO))}
    if with_peer:
        landed = mujoco_scene.landed_states(sizes)
        for k, name in ((1, ONE), (2, TWO)):
            runners[f"{PEER}, {name}"] = mujoco_scene.Rollout(replace(sizes, threads=k), landed)
    for load in _loads():
        with beside(load):
            spreads = interleave(runners, repeats, told(tick, str(load)))
        yield [_row(load, spreads, sizes)]


def run_count(repeats: int, with_peer: bool) -> int:
    """Number of calls of `tick` by `crowded_rows`."""
    return len(_loads()) * (4 if with_peer else 2) * (repeats + 1)


def _loads() -> list[Load]:
    """Loads that the system supports: Windows has no niceness."""
    return [load for load in LOADS if not load.nice or hasattr(os, "nice")]


def _row(load: Load, spreads: dict, sizes: Sizes) -> Row:
    row = Row(
        key=f"threads_beside_{load.busy}" + f"_nice_{load.nice}" * (load.nice > 0),
        what=f"{sizes.worlds:,} worlds, 2 threads, {load}",
        unit=UNIT, ours=spreads[TWO], accuracy=ACCURACY, peer_name="one thread", peer=spreads[ONE], target=load.target,
    )  # fmt: skip
    if f"{PEER}, {ONE}" not in spreads:
        return row
    theirs = replace(row, ours=spreads[f"{PEER}, {TWO}"], peer=spreads[f"{PEER}, {ONE}"])
    return replace(row, notes={"mujoco.rollout_ratio": theirs.ratio.to_dict()})
