"""Let one process compile what several want: the others wait for its file, and load it.

The right to compile a kernel is a lock on a file beside that of its machine code. The system takes it back when a
process ends, however it ends. Where files cannot be locked, each process compiles.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from physics.compiler.fused.ablation import is_on
from physics.compiler.notices import warn_once

QUIET_WAIT = 1.0  # without a line that says so [s]
LONGEST_WAIT = 900.0  # for a process that holds a lock and does not go on: then this one compiles, too [s]


@contextmanager
def one_process(path: Path) -> Iterator[None]:
    """Hold the right to make the file `path`, as a context; wait while another process has it.

    The caller looks for the file once more, inside.
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
    """A lock, or None where there is none to have."""
    from filelock import FileLock, Timeout  # only for what is compiled

    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        lock = FileLock(path.with_name(f"{path.name}.lock"))
        try:
            lock.acquire(timeout=QUIET_WAIT)
        except Timeout:
            warn_once("wait", "another process compiles a kernel for this scene: waiting for it ...")
            lock.acquire(timeout=LONGEST_WAIT)
    except (OSError, NotImplementedError):  # a `Timeout` is one
        return None
    return lock
