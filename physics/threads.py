"""Slices of a batch on threads: kernels release the GIL, so a thread pool is enough.

The pool is made when first needed and belongs to one process: after a fork the child makes its own. There is no
threading layer of Numba in it, so worlds may be stepped from several Python threads at once, and forked.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise

# Slices per thread: worlds in contact take several times as long as others, and a thread that is done with its
# slices takes the next one. Each costs a microsecond.
SLICES_PER_THREAD = 8

# A slice has at least so many worlds.
WORLDS_PER_SLICE = 16


class SlicePool:
    """Consecutive slices of range(count), several per thread, and the threads that work on them.

    Attributes
    ----------
    slices : list of (first, last)
        first <= index < last.
    """

    def __init__(self, threads: int, count: int):
        self._threads = min(threads, count)
        pieces = 1
        if self._threads > 1:
            pieces = max(self._threads, min(SLICES_PER_THREAD * self._threads, count // WORLDS_PER_SLICE))
        bounds = [count * k // pieces for k in range(pieces + 1)]
        self.slices = list(pairwise(bounds))
        self._pool: ThreadPoolExecutor | None = None
        self._pid = -1

    def run(self, calls: Sequence[Callable[[], None]]) -> None:
        """Make the calls, one per slice, on all threads, of which the calling one is one."""
        if self._threads == 1:
            for call in calls:
                call()
            return
        if self._pool is None or self._pid != os.getpid():
            self._pool = ThreadPoolExecutor(self._threads - 1, thread_name_prefix="rigid-env")
            self._pid = os.getpid()
        rest = iter(calls)  # the threads take turns at it: advancing it is atomic
        waiting = [self._pool.submit(_make_all, rest) for _ in range(self._threads - 1)]
        try:
            _make_all(rest)
        finally:
            for future in waiting:
                future.result()

    def close(self) -> None:
        """End the threads; the pool can be used again."""
        if self._pool is not None and self._pid == os.getpid():
            self._pool.shutdown()
        self._pool = None

    def __getstate__(self):
        return {**vars(self), "_pool": None, "_pid": -1}


def _make_all(calls: Iterator[Callable[[], None]]) -> None:
    for call in calls:
        call()
