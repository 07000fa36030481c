"""Worker process: it runs one job after the other, as its parent sends them.

A worker ignores Ctrl-C, which a terminal sends to all processes, and obeys its parent alone: SIGTERM interrupts the job
as Ctrl-C would, and ends the worker. Without its parent it ends, too.
"""

from __future__ import annotations

import gc
import multiprocessing
import os
import signal
import threading
from contextlib import suppress
from multiprocessing.connection import Connection, wait

from rigid_env.launchers.job import Ended, Job, run_job

SPAWN = multiprocessing.get_context("spawn")


class Worker:
    """Process that runs jobs, as its parent sees it.

    Attributes
    ----------
    process : multiprocessing.Process
    connection : Connection
        It is ready to be received from when the job has ended, or the process.
    job : Job
        Last one that was given.
    """

    job: Job

    def __init__(self) -> None:
        self.connection, theirs = SPAWN.Pipe()
        self.process = SPAWN.Process(target=_work, args=(theirs,), daemon=True)
        self.process.start()
        theirs.close()

    def give(self, job: Job) -> None:
        """Let the worker run a job; if the process has died, `receive` says so."""
        self.job = job
        with suppress(OSError):
            self.connection.send(job)

    def receive(self) -> Ended | None:
        """Return the end of the job; None if the process has died or was interrupted."""
        try:
            return self.connection.recv()
        except (EOFError, OSError):
            return None


def _work(connection: Connection) -> None:
    """Run jobs until the parent closes the connection or interrupts."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, _interrupt)
    threading.Thread(target=_end_with_parent, daemon=True).start()
    with suppress(KeyboardInterrupt, EOFError, ConnectionError):
        while True:
            _send(connection, run_job(connection.recv()))
    gc.freeze()  # Python would look through all objects in the end, PyTorch's for a second


def _interrupt(*_: object) -> None:
    raise KeyboardInterrupt


def _send(connection: Connection, end: Ended) -> None:
    """Send the end of a job, or the error of a result that cannot be pickled."""
    try:
        connection.send(end)
    except ConnectionError:
        raise
    except Exception as error:
        connection.send(Ended(end.name, None, f"result cannot be sent: {type(error).__name__}: {error}"))


def _end_with_parent() -> None:
    """End this process as soon as its parent process has ended."""
    wait([multiprocessing.parent_process().sentinel])
    os._exit(1)
