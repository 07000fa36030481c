"""Bytes allocated per step once running: in kernels, by Python, and by the process."""

from __future__ import annotations

import gc
import itertools
import os
import sys
import tracemalloc
from pathlib import Path

import numpy as np
from numba import njit
from numba.core.runtime import _nrt_python, rtsys

import physics
from physics import scenes
from rigid_env.lab.measure.timing import Row, Spread
from rigid_env.lab.measure.workloads import HOLD, STEP, random_wrenches

COUNTED_STEPS = 1000
STRETCHES = 5
FLAT = 1.0  # growth of the process that counts as none [bytes/step]; a leaked float would be 24
WARM_STEPS = 2000


@njit
def _allocating():
    return np.empty(3)


def memory_rows(steps: int) -> list[Row]:
    """Kernel allocations, Python allocations kept, and growth of the process over `steps` steps.

    Every step is a call of `World.step` with a fresh wrench, the block in and out of contact.
    """
    world = physics.World(scenes.shove(), dt=STEP)
    wrenches = random_wrenches(64)
    _steps(world, wrenches, WARM_STEPS)
    rows = [
        _row(
            "kernel_bytes",
            "allocations in kernels",
            [kernel_allocations(world, wrenches)],
            0.0,
            "allocations/step",
        ),
        _row("python_bytes", "kept by Python", python_growth(world, wrenches), FLAT, "bytes/step"),
    ]
    if sys.platform.startswith("linux"):
        what = f"growth of the process over {steps:,} steps"
        rows.append(_row("process_bytes", what, [process_growth(world, wrenches, steps)], FLAT, "bytes/step"))
    return rows


def kernel_allocations(world, wrenches) -> float:
    """Allocations by Numba's run-time per step.

    A call from Python costs a fixed number of headers, one per array handed over; so calls of one step are
    subtracted from calls of many.

    Raises
    ------
    RuntimeError
        If the counter does not count an allocation that is known.
    """
    _nrt_python.memsys_enable_stats()
    _allocating()
    if allocations(_allocating) != 1:
        raise RuntimeError("Numba's allocation statistics do not count")
    short = sum(allocations(lambda wrench=wrench: world.step(wrench)) for wrench in wrenches)
    long = sum(allocations(lambda wrench=wrench: world.step(wrench, steps=1 + HOLD)) for wrench in wrenches)
    return (long - short) / (HOLD * len(wrenches))


def allocations(call) -> int:
    """Allocations by Numba's run-time during a call."""
    before = rtsys.get_allocation_stats().alloc
    call()
    return rtsys.get_allocation_stats().alloc - before


def python_growth(world, wrenches) -> list[float]:
    """Growth of what Python objects hold [bytes/step], over some stretches of steps."""
    tracemalloc.start()
    held = []
    for _ in range(1 + STRETCHES):
        _steps(world, wrenches, COUNTED_STEPS)
        gc.collect()
        held.append(tracemalloc.get_traced_memory()[0])
    tracemalloc.stop()
    return [(after - before) / COUNTED_STEPS for before, after in itertools.pairwise(held)]


def process_growth(world, wrenches, steps: int) -> float:
    """Growth of the resident set [bytes/step]."""
    gc.collect()
    before = resident_bytes()
    _steps(world, wrenches, steps)
    gc.collect()
    return (resident_bytes() - before) / steps


def resident_bytes() -> int:
    """Resident set of this process (Linux) [bytes]."""
    pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE")


def _steps(world, wrenches, count):
    for k in range(count):
        world.step(wrenches[k % len(wrenches)])


def _row(key, what, values, target, unit) -> Row:
    return Row(
        key=key,
        what=what,
        unit=unit,
        ours=Spread(tuple(values)),
        accuracy="balanced",
        target=target,
        is_ratio=False,
    )
