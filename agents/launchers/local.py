"""Trials in processes of this machine."""

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

from agents.launchers.trial import RETRIES, Outcome, run_trial
from agents.trials import Trial


def launch(trials: Sequence[Trial], out: Path, jobs: int, address: str | None = None) -> Iterator[Outcome]:
    """Run trials in `jobs` processes, see `trial.Launch`; `address` is not used.

    If a process dies, all processes start again, and their trials continue from their last checkpoints.
    """
    left = {trial.name: trial for trial in trials}
    for _ in range(1 + RETRIES):
        try:
            for outcome in _run_all(list(left.values()), out, jobs):
                del left[outcome.name]
                yield outcome
            return
        except BrokenProcessPool:
            told = "a process was lost: the trials that ran go on from their last checkpoints"
            print(told, file=sys.stderr, flush=True)
    for name in left:
        yield Outcome(name, None, f"its process ended {1 + RETRIES} times; is there memory for {jobs} of them?")


def _end_with_parent() -> None:
    """End this process as soon as its parent has ended; its trial continues from a checkpoint next time."""

    def watch() -> None:
        multiprocessing.connection.wait([multiprocessing.parent_process().sentinel])
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


def _run_all(trials: Sequence[Trial], out: Path, jobs: int) -> Iterator[Outcome]:
    pool = ProcessPoolExecutor(jobs, mp_context=multiprocessing.get_context("spawn"), initializer=_end_with_parent)
    try:
        for future in as_completed([pool.submit(run_trial, t.name, t.config, str(out)) for t in trials]):
            yield future.result()
    finally:
        pool.shutdown(wait=True, cancel_futures=True)
