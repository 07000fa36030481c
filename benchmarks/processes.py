"""Run processes with a time limit: after it a signal that no process can ignore ends them.

A process that was started in the background ignores SIGINT, and hands that on to all that it starts.
"""

from __future__ import annotations

import subprocess
import threading
from collections.abc import Iterator
from contextlib import contextmanager

PATIENCE = 900.0
"""Time limit for an answer of another process [s]; compiling all kernels of a scene takes a minute or two."""

ENDING = 30.0
"""Time limit for the end of a process after it was told to end [s]."""


@contextmanager
def killed_after(process: subprocess.Popen, patience: float = PATIENCE) -> Iterator[None]:
    """Kill a process if the block takes longer than `patience` [s], which also ends waiting for its output or its end.

    Parameters
    ----------
    process : subprocess.Popen
    patience : float
    """
    timer = threading.Timer(patience, process.kill)
    timer.daemon = True
    timer.start()
    try:
        yield
    finally:
        timer.cancel()


def wait_for_end(process: subprocess.Popen, patience: float = ENDING) -> int:
    """Wait for the end of a process that was told to end; return its exit status.

    Parameters
    ----------
    process : subprocess.Popen
    patience : float
        Time after which it is killed [s].
    """
    with killed_after(process, patience):
        return process.wait()
