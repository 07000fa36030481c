"""A batch of worlds on threads: kernels release the GIL, so a thread pool is enough.

The pool is made when first needed and belongs to one process: after a fork the child makes its own. There is no
threading layer of Numba in it, so worlds may be stepped from several Python threads at once, and forked.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from physics.kernels import turns as at
from physics.machine_code import bound

# So many worlds a thread takes at once, or fewer where there are few: worlds in contact take several times as long as
# others, and at the end one thread waits for the other's last ones.
WORLDS_AT_ONCE = 8
TURNS_PER_THREAD = 4

# How often a thread asks whether the others have finished before it sleeps until they say so: a fifth of a millisecond.
# To be woken takes a thread half as long as a batch of 100 worlds.
PATIENCE = 30_000


class Team:
    """The threads that share a batch.

    Parameters
    ----------
    threads : int
    worlds : int
        Size of the batch.

    Attributes
    ----------
    size : int
        Number of threads.
    turns : (TURNS_SIZE,) int64
        Whose turn it is, of `physics.kernels.turns`.
    taken : list of (FIRST + worlds,) int64
        For each thread the worlds that it took in the last run.
    """

    def __init__(self, threads: int, worlds: int):
        self.size = min(threads, worlds)
        self.turns = np.zeros(at.TURNS_SIZE, dtype=np.int64)
        self.turns[at.WORLDS] = worlds
        self.turns[at.CHUNK] = worlds
        if self.size > 1:
            self.turns[at.CHUNK] = max(1, min(WORLDS_AT_ONCE, worlds // (TURNS_PER_THREAD * self.size)))
        self.taken = [np.zeros(at.FIRST + worlds, dtype=np.int64) for _ in range(self.size)]
        self._finish: Callable[[], object] | None = None
        self._have_finished: Callable[[], object] | None = None
        self._pool: ThreadPoolExecutor | None = None
        self._pid = -1

    def run(self, calls: Sequence[Callable[[], None]]) -> None:
        """Make the calls, one per thread, of which the calling one is the first."""
        self.turns[at.NEXT] = 0
        if self.size == 1:
            calls[0]()
            return
        self.turns[at.FINISHED] = 0
        if self._pool is None or self._pid != os.getpid():
            self._start()
        waiting = [self._pool.submit(self._take_part, call) for call in calls[1:]]
        try:
            calls[0]()
        finally:
            if not self._have_finished():
                for future in waiting:
                    future.result()

    def _start(self) -> None:
        self._pool = ThreadPoolExecutor(self.size - 1, thread_name_prefix="rigid-env")
        self._pid = os.getpid()
        patience = PATIENCE if self.size <= _cores() else 1
        self._finish = bound(at.finish, self.turns)
        self._have_finished = bound(at.have_finished, self.turns, self.size - 1, patience)

    def _take_part(self, call: Callable[[], None]) -> None:
        call()
        self._finish()  # not reached if the call raises: the first thread then asks for what was raised

    def close(self) -> None:
        """End the threads; the team can be used again."""
        if self._pool is not None and self._pid == os.getpid():
            self._pool.shutdown()
        self._pool = None


def listed(worlds: np.ndarray) -> np.ndarray:
    """Worlds (n,) as a list (FIRST + n,) int64 of those that a thread took."""
    return np.concatenate([[len(worlds), -1], worlds])


def _cores() -> int:
    """How many the process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
