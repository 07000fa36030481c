"""Start of a new process to its first step, kernels in the cache: seconds, imports included."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from functools import partial
from pathlib import Path

import physics
from benchmarks.processes import PATIENCE
from rigid_env.lab.measure.timing import Row, interleave

LIMIT = 1.5  # [s]

PROGRAMS = {
    "start_world": (
        "new process to first World.step",
        "import physics; physics.World(physics.scenes.drop(), accuracy={accuracy!r}).step()",
    ),
    "start_env": (
        "new process to first Env.step",
        "import gymnasium; env = gymnasium.make('rigid_env:rigid_env/BlockReach-v0', accuracy={accuracy!r});"
        "env.reset(seed=0); env.step(env.action_space.sample())",
    ),
}


def start_rows(repeats: int, accuracies=("fast", "balanced")) -> list[Row]:
    """One row per program and accuracy, in turns; each runs once more before, to fill the cache."""
    programs = {(key, accuracy): program.format(accuracy=accuracy)
                for key, (_, program) in PROGRAMS.items() for accuracy in accuracies}  # fmt: skip
    spreads = interleave({name: partial(_seconds, code) for name, code in programs.items()}, repeats)
    return [
        Row(key, PROGRAMS[key][0], "s", spread, accuracy=accuracy, target=LIMIT, is_ratio=False)
        for (key, accuracy), spread in spreads.items()
    ]


def _seconds(code: str) -> float:
    root = str(Path(physics.__file__).parents[1])
    paths = [root, *filter(None, [os.environ.get("PYTHONPATH")])]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(paths)}
    with tempfile.TemporaryDirectory() as folder:
        start = time.perf_counter()
        subprocess.run([sys.executable, "-c", code], check=True, timeout=PATIENCE, cwd=folder, env=environment)
        return time.perf_counter() - start
