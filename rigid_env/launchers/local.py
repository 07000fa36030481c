"""Launcher of jobs in processes of this machine."""

from __future__ import annotations

import multiprocessing
import multiprocessing.connection
import os
import sys
import threading
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from pathlib import Path

from rigid_env.launchers.job import RETRIES, Ended, Job, run_job


def launch(jobs: Sequence[Job], folder: Path, at_once: int, address: str | None = None) -> Iterator[Ended]:
    """Run jobs in worker processes, as `job.Launch` describes; `folder` and `address` are not used.

    If one process dies, the pool loses the jobs of all its processes. All jobs that had not ended are then restarted.
    """
    left = {job.name: job for job in jobs}
    for _ in range(1 + RETRIES):
        try:
            for end in _run_all(list(left.values()), at_once):
                del left[end.name]
                yield end
            return
        except BrokenProcessPool:
            told = "a process was lost: the jobs that ran are started again"
            print(told, file=sys.stderr, flush=True)
    for name in left:
        yield Ended(name, None, f"its process ended {1 + RETRIES} times; is there memory for {at_once} of them?")


def _end_with_parent() -> None:
    """Start a thread that ends this process as soon as its parent process has ended."""

    def watch() -> None:
        multiprocessing.connection.wait([multiprocessing.parent_process().sentinel])
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


def _run_all(jobs: Sequence[Job], at_once: int) -> Iterator[Ended]:
    pool = ProcessPoolExecutor(at_once, mp_context=multiprocessing.get_context("spawn"), initializer=_end_with_parent)
    try:
        for future in as_completed([pool.submit(run_job, job) for job in jobs]):
            yield future.result()
    finally:
        pool.shutdown(wait=True, cancel_futures=True)
