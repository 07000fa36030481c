"""Compilation of a kernel by one process if several need it: the others wait for its file, and load it.

A process that compiles a kernel holds a lock on a file beside that of the machine code. The system releases the lock
when the process ends, however it ends. Where files cannot be locked, each process compiles.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from physics.compiler.fused.ablation import is_on
from physics.compiler.notices import warn_once

QUIET_WAIT = 1.0  # time of waiting after which a line on standard error says so [s]
WAITING = "another process compiles a kernel for this scene, in ten seconds to a minute: waiting for it ..."
LONGEST_WAIT = 900.0  # time of waiting after which this process compiles, too, in case the other one hangs [s]


@contextmanager
def one_process(path: Path) -> Iterator[None]:
    """Context manager in which no other process makes the file `path` of machine code; it waits while one does.

    Within it the caller must look for the file again, which another process may have made meanwhile.
    """
    if not is_on("one_process"):
        yield
        return
    lock = _acquired(path)
    try:
        yield
    finally:
        if lock is not None:
            with suppress(OSError):  # on Windows, while another process waits
                Path(lock.lock_file).unlink()
            lock.release()


def _acquired(path: Path):
    """Acquire the lock of the file `path` and return it; None if files cannot be locked, or after `LONGEST_WAIT`."""
    from filelock import FileLock, Timeout  # imported only if something is compiled

    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        lock = FileLock(path.with_name(f"{path.name}.lock"))
        try:
            lock.acquire(timeout=QUIET_WAIT)
        except Timeout:
            warn_once("wait", WAITING)
            lock.acquire(timeout=LONGEST_WAIT)
    except (OSError, NotImplementedError):  # a `Timeout` is one
        return None
    return lock
