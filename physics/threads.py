"""Slices of a batch on threads: kernels release the GIL, so a thread pool is enough.

The pool is made when first needed and belongs to one process: after a fork the child makes its own. There is no
threading layer of Numba in it, so worlds may be stepped from several Python threads at once, and forked.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise


class SlicePool:
    """Consecutive slices of range(count), one per thread, and the threads that work on them.

    Attributes
    ----------
    slices : list of (first, last)
        first <= index < last.
    """

    def __init__(self, threads: int, count: int):
        threads = min(threads, count)
        bounds = [count * k // threads for k in range(threads + 1)]
        self.slices = list(pairwise(bounds))
        self._pool: ThreadPoolExecutor | None = None
        self._pid = -1

    def run(self, calls: Sequence[Callable[[], None]]) -> None:
        """Make the calls, one per slice, at the same time; the last one on the calling thread."""
        if len(calls) == 1:
            calls[0]()
            return
        if self._pool is None or self._pid != os.getpid():
            self._pool = ThreadPoolExecutor(len(self.slices) - 1, thread_name_prefix="rigid-env")
            self._pid = os.getpid()
        waiting = [self._pool.submit(call) for call in calls[:-1]]
        try:
            calls[-1]()
        finally:
            for future in waiting:
                future.result()

    def close(self) -> None:
        """End the threads; the pool can be used again."""
        if self._pool is not None and self._pid == os.getpid():
            self._pool.shutdown()
        self._pool = None

    def __getstate__(self):
        return {"slices": self.slices, "_pool": None, "_pid": -1}
