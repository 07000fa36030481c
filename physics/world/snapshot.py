"""Snapshots: all that decides how a world goes on."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from physics.kernels.compile.compiler_choice import COMPILER
from physics.summary import lines_repr

# Arrays that decide how a `World` goes on, in the order of `Snapshot.arrays`; the last one where bodies may sleep.
KEPT = ("state", "params", "gravity", "memory", "report_table", "sleep")


@dataclass(frozen=True)
class Snapshot:
    """Everything that decides how a `World` goes on: states, warm starts, parameters, time, the actuator's memory.

    `compiler` is the one that made it (`physics.kernels.compile.compiler_choice`): with another one a world goes on
    with other last bits.
    """

    arrays: tuple[np.ndarray, ...]
    time: float
    actuation: tuple | None = None
    compiler: str = COMPILER

    def __repr__(self) -> str:
        shapes = (f"{name} {array.shape}" for name, array in zip(KEPT, self.arrays))
        return lines_repr("Snapshot", f"time={self.time:.6g} s", *shapes, f"compiler={self.compiler}")
