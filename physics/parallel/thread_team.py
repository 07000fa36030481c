"""Thread team that shares the worlds of a batch; kernels release the GIL, so a pool of Python threads is enough.

The pool is made at the first run and belongs to one process: after a fork the child makes its own. It does not use
Numba's threading layer, so worlds may be stepped from several Python threads at once, and a process may be forked. The
threads run a loop in machine code (`physics.kernels.parallel.spin_wait_workers`), in which a thread waits for the next
run for a short time. A waiting thread yields its processor to other programs, and no run waits for a thread that has
not begun its part.

At most as many threads take part as there are usable processors. With the environment variable
``RIGID_ENV_THREADS=fixed`` all threads take part, and waiting threads do not yield.
"""

from __future__ import annotations

import os
import timeit
from collections.abc import Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from functools import cache, partial

import numpy as np

from physics.kernels.parallel import spin_wait_workers
from physics.kernels.parallel import work_stealing as at
from physics.kernels.state.groups import WorkQueue
from physics.parallel import processors
from physics.parallel.bound_call import BoundCall, compiled

# Number of worlds that a thread takes at once; fewer in small batches, so that each thread takes several times. Worlds
# in contact take several times as long as others, and at the end threads wait for the last worlds of one of them.
WORLDS_AT_ONCE = 8
TURNS_PER_THREAD = 4

# The leading thread checks for PATIENCE whether the workers have finished; then it sleeps until they wake it. A worker
# checks for STAY whether there is a next run; then it ends. Waiting threads yield their processor every BETWEEN, the
# first time after BRIEF if the leading thread is still busy [s].
PATIENCE = 2.0e-4
STAY = 3.0e-4
BETWEEN = 1.0e-4
BRIEF = 2.5e-5

# Environment variable for measurements: its value "fixed" makes threads ignore quotas, and not yield.
SWITCH = "RIGID_ENV_THREADS"


class Team:
    """Threads that share the worlds of a batch by work stealing.

    Parameters
    ----------
    threads : int
        Number of threads; at most one for each world is used.
    worlds : int
        Number of worlds of the batch.

    Attributes
    ----------
    size : int
        Number of threads in use.
    turns : (1 + size, PADDING_WORDS) int64
        Ranges of worlds that are not taken yet, of `physics.kernels.parallel.work_stealing`.
    taken : (size, TAKEN_FIRST_WORLD + worlds + PADDING_WORDS) int64
        For each thread the list of worlds that it took in the last run.
    queues : list of WorkQueue
        For each thread the ranges, and its list of taken worlds.
    """

    def __init__(self, threads: int, worlds: int):
        self.size = min(threads, worlds)
        chunk = min(WORLDS_AT_ONCE, worlds // (TURNS_PER_THREAD * self.size)) if self.size > 1 else worlds
        self.turns = at.make_ranges(self.size, worlds, max(1, chunk))
        self.taken = at.make_taken_lists(self.size, worlds)
        self.queues = [WorkQueue(self.turns, taken) for taken in self.taken]
        self._crew = spin_wait_workers.make_worker_table(self.size - 1)
        self._told: Sequence[BoundCall] | None = None  # calls that are in the crew's table
        self._futures: dict[int, Future] = {}
        self._is_interrupted = False  # whether workers may still be busy with the last run
        self._pool: ThreadPoolExecutor | None = None
        self._pid = -1

    def run(self, calls: Sequence[BoundCall]) -> None:
        """Make the calls, one in each thread and the first in the calling thread; raise an exception that one raised.

        The call of a thread is skipped if all worlds are taken before the thread begins; its list of worlds is then
        empty.
        """
        if self.size == 1:
            if calls[0].perform():
                calls[0].raise_again()
            return
        if self._pool is None or self._pid != os.getpid():
            self._start()
        if self._is_interrupted:
            self._let_go()
        if calls is not self._told:
            self._tell(calls)
        outcome, self._is_interrupted = spin_wait_workers.RUN_UNFINISHED, True
        try:
            if self._summon(self._members) > 0:
                self._send_for_all()
            outcome = self._lead(self._members, calls[0].jobs, calls[0].count, self._patience)
        finally:
            if outcome == spin_wait_workers.RUN_UNFINISHED:
                self._let_go()
        self._is_interrupted = False
        if outcome != spin_wait_workers.RUN_DONE:
            _raise(calls)

    def _start(self) -> None:
        self._pool = ThreadPoolExecutor(self.size - 1, thread_name_prefix="rigid-env")
        self._pid, self._told, self._futures, self._is_interrupted = os.getpid(), None, {}, False
        self._crew[...] = self.taken[:, at.TAKEN_COUNT] = 0
        is_fixed = os.environ.get(SWITCH) == "fixed"
        if not is_fixed:
            (
                self._crew[0, spin_wait_workers.CREW_YIELD_ADDRESS],
                self._crew[0, spin_wait_workers.CREW_PROCESSOR_ADDRESS],
            ) = (
                processors.giving_way(),
                processors.telling(),
            )
        self._crew[0, spin_wait_workers.CREW_YIELD_INTERVAL], self._crew[0, spin_wait_workers.CREW_BRIEF_PAUSES] = (
            _pauses(BETWEEN),
            _pauses(BRIEF),
        )
        self._patience, self._stay = _pauses(PATIENCE), _pauses(STAY)
        self._members = (self.size if is_fixed else min(self.size, processors.usable())) - 1
        self._summon = partial(
            compiled(spin_wait_workers.wake_workers, (self._crew, self.turns, 0)), self._crew, self.turns
        )
        self._dismiss = partial(compiled(spin_wait_workers.stop_workers, (self._crew,)), self._crew)
        self._lead = partial(
            compiled(spin_wait_workers.run_and_join, (self._crew, self.taken, 0, 0, 0, 0)), self._crew, self.taken
        )
        self._serve = partial(compiled(spin_wait_workers.worker_loop, (self._crew, 0, 0)), self._crew)

    def _tell(self, calls: Sequence[BoundCall]) -> None:
        self._told = calls
        for member, call in enumerate(calls[1:], 1):
            (
                self._crew[member, spin_wait_workers.WORKER_JOBS],
                self._crew[member, spin_wait_workers.WORKER_JOB_COUNT],
            ) = (
                call.jobs,
                call.count,
            )

    def _send_for_all(self) -> None:
        """Start pool threads for the workers that no longer wait in their loop."""
        for member in 1 + np.flatnonzero(self._crew[1:, spin_wait_workers.WORKER_WAS_IDLE]):
            self._futures[member] = self._pool.submit(self._be_member, member)

    def _be_member(self, member: int) -> None:
        """Run the loop of worker number `member` in a pool thread; `self` keeps the team and its calls alive."""
        self._serve(member, self._stay)

    def _let_go(self) -> None:
        """End the loops of all workers, and wait until they have ended."""
        self._dismiss()
        for future in self._futures.values():
            future.result()

    def close(self) -> None:
        """End the threads; the next `run` starts new ones."""
        if self._pool is not None and self._pid == os.getpid():
            self._dismiss()
            self._pool.shutdown()
        self._pool = None


def _raise(calls: Sequence[BoundCall]) -> None:
    """Raise the exception that a call raised, and forget those of all calls, so that none is raised again later."""
    try:
        for call in calls:
            call.raise_again()
    finally:
        for call in calls:
            call.forget()


def _pauses(seconds: float) -> int:
    """Number of `spin_pause` instructions that take about this time [s]."""
    return int(seconds / _pause()) + 1


@cache
def _pause() -> float:
    """Time of a `spin_pause` instruction on this processor [s]: the shortest of several trials."""
    pause, count = compiled(spin_wait_workers.repeat_pause, (0,)), 1000
    return min(timeit.repeat(lambda: pause(count), number=1, repeat=7)) / count
