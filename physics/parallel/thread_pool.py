"""Thread team for compilers without atomic operations: each thread has a fixed range of the worlds of a batch."""

from __future__ import annotations

import os
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor, wait
from itertools import pairwise

from physics.kernels.parallel import work_stealing as at
from physics.kernels.state.groups import WorkQueue
from physics.parallel.bound_call import BoundCall


class Pool:
    """Threads that share the worlds of a batch in equal ranges; same interface as `thread_team.Team`.

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
    taken : (size, TAKEN_FIRST_WORLD + worlds + PADDING_WORDS) int64
        For each thread the list of worlds that it stepped in the last run.
    queues : list of WorkQueue
        For each thread the queue with its range of worlds.
    """

    def __init__(self, threads: int, worlds: int):
        self.size = min(threads, worlds)
        self.taken = at.make_taken_lists(1, worlds).repeat(self.size, axis=0)
        ends = [worlds * k // self.size for k in range(self.size + 1)]
        ranges = [at.make_ranges(1, end, max(1, end - first)) for first, end in pairwise(ends)]
        for first, turns in zip(ends, ranges):
            turns[0, at.RANGE_END] = first
        self.queues = [WorkQueue(turns, taken) for turns, taken in zip(ranges, self.taken)]
        self._pool: ThreadPoolExecutor | None = None
        self._pid = -1

    def run(self, calls: Sequence[BoundCall]) -> None:
        """Make the calls, one in each thread and the first in the calling thread; an exception of one is raised."""
        if self.size == 1:
            calls[0].perform()
            return
        if self._pool is None or self._pid != os.getpid():
            self._pool, self._pid = ThreadPoolExecutor(self.size - 1, thread_name_prefix="rigid-env"), os.getpid()
        others = [self._pool.submit(call.perform) for call in calls[1:]]
        try:
            calls[0].perform()
        finally:
            wait(others)
        for other in others:
            other.result()

    def close(self) -> None:
        """End the threads; the next `run` starts new ones."""
        if self._pool is not None and self._pid == os.getpid():
            self._pool.shutdown()
        self._pool = None
