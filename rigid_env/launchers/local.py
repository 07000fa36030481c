"""Launcher of jobs in processes of this machine."""

from __future__ import annotations

import sys
from collections import Counter, deque
from collections.abc import Iterator, Sequence
from multiprocessing.connection import Connection, wait
from pathlib import Path

from rigid_env.launchers.interrupts import Interrupts
from rigid_env.launchers.job import RETRIES, Ended, Job
from rigid_env.launchers.local_worker import Worker

NAMED = 3  # jobs that are named when they are interrupted
GRACE = 10.0  # time of a process between its last job and its end [s]


def launch(jobs: Sequence[Job], folder: Path, at_once: int, address: str | None = None) -> Iterator[Ended]:
    """Run jobs in worker processes, as `job.Launch` describes; `folder` and `address` are not used.

    A job whose process dies is started again. Ctrl-C interrupts the jobs that run, and no other job starts; a second
    Ctrl-C kills them.

    Raises
    ------
    KeyboardInterrupt
        After Ctrl-C, as soon as no job runs.
    """
    crew = _Crew(jobs, at_once)
    with Interrupts(crew.kill) as interrupts:
        try:
            yield from crew.run(interrupts)
        finally:
            crew.end()
    if interrupts.count:
        raise KeyboardInterrupt


class _Crew:
    """Processes that run jobs, at most `at_once`, and the jobs that wait."""

    def __init__(self, jobs: Sequence[Job], at_once: int):
        self._waiting, self._at_once = deque(jobs), at_once
        self._workers: list[Worker] = []
        self._busy: dict[Connection, Worker] = {}
        self._losses: Counter[str] = Counter()

    def run(self, interrupts: Interrupts) -> Iterator[Ended]:
        """Run all jobs, or after an interrupt those that have begun, and yield their ends."""
        is_told = False
        while True:
            if interrupts.count and not is_told:
                self._waiting.clear()
                self._interrupt()
                is_told = True
            while self._waiting and len(self._busy) < self._at_once:
                self._start(interrupts)
            if not self._busy:
                return
            for ready in wait([*self._busy, interrupts.arrived]):
                if ready is interrupts.arrived:
                    interrupts.arrived.recv()
                else:
                    yield from self._end_job(self._busy.pop(ready), interrupts)

    def kill(self) -> None:
        """Kill all processes."""
        for worker in self._workers:
            worker.process.kill()

    def end(self) -> None:
        """Interrupt the jobs that run, if any, and wait until all processes have ended."""
        for worker in self._busy.values():
            worker.process.terminate()
        for worker in self._workers:
            worker.process.join(GRACE)
        self.kill()

    def _start(self, interrupts: Interrupts) -> None:
        """Start a process with the next job."""
        with interrupts.ignored():
            worker = Worker()
        self._workers.append(worker)
        self._give(worker)

    def _give(self, worker: Worker) -> None:
        """Let a worker run the next job."""
        worker.give(self._waiting.popleft())
        self._busy[worker.connection] = worker

    def _end_job(self, worker: Worker, interrupts: Interrupts) -> Iterator[Ended]:
        """Yield the end of a worker's job, after the worker has got the next one, or none and so ends."""
        job, end = worker.job, worker.receive()
        if end is not None and self._waiting and not interrupts.count:
            self._give(worker)
        else:
            worker.connection.close()
        if end is not None:
            yield end
        elif not interrupts.count:
            yield from self._start_again(job)

    def _start_again(self, job: Job) -> Iterator[Ended]:
        """Let a job wait again whose process was lost, or yield its error if it has lost too many."""
        self._losses[job.name] += 1
        if self._losses[job.name] > RETRIES:
            memory = f"is there memory for {self._at_once} of them?"
            yield Ended(job.name, None, f"its process ended {1 + RETRIES} times; {memory}")
        else:
            self._waiting.appendleft(job)
            _tell(f"a process was lost: {job.name} is started again")

    def _interrupt(self) -> None:
        """Interrupt the jobs that run, and name them."""
        for worker in self._busy.values():
            worker.process.terminate()
        names = [worker.job.name for worker in self._busy.values()]
        more = f" and {len(names) - NAMED} more" if len(names) > NAMED else ""
        if names:
            _tell(f"stopping {', '.join(names[:NAMED])}{more}; Ctrl-C again kills what still runs")


def _tell(text: str) -> None:
    print(text, file=sys.stderr, flush=True)
