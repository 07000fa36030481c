"""Compile the kernels of a run in a second process, while the first one imports PyTorch and makes the model.

The kernels come to the first process by the cache on disk, which lets one process at a time compile a kernel. If they
are in the cache already, the second process ends after a second. If it fails, the first one compiles, and tells the
error. `RIGID_ENV_COMPILE_AHEAD=0` turns it off.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from contextlib import suppress
from dataclasses import asdict

from agents.config import RunConfig

SWITCH = "RIGID_ENV_COMPILE_AHEAD"


def compile_ahead(config: RunConfig) -> subprocess.Popen | None:
    """Start a process that compiles the kernels of a run; None if it is turned off, or the system refuses it.

    Ctrl-C does not reach the process.

    Raises
    ------
    ValueError
        If `RIGID_ENV_COMPILE_AHEAD` is neither 0 nor 1.
    """
    chosen = os.environ.get(SWITCH, "1")
    if chosen not in ("0", "1"):
        raise ValueError(f"{SWITCH} is {chosen!r}; allowed are 0, 1")
    if chosen == "0":
        return None
    with suppress(OSError):
        process = subprocess.Popen(
            [sys.executable, "-m", "agents.compile_ahead"], stdin=subprocess.PIPE, stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL, start_new_session=True, text=True,
        )  # fmt: skip
        with process.stdin:
            process.stdin.write(json.dumps(asdict(config)))
        return process
    return None


if __name__ == "__main__":
    from agents.environments import warm_kernels

    warm_kernels(RunConfig(**json.load(sys.stdin)))
