"""Slices of a batch on threads: kernels release the GIL, so a thread pool is enough.

The pool is made when first needed and belongs to one process: after a fork the child makes its own. There is no
threading layer of Numba in it, so worlds may be stepped from several Python threads at once, and forked.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise


class SlicePool:
    """Runs a function on consecutive slices of range(count), one slice per thread."""

    def __init__(self, threads: int, count: int):
        threads = min(threads, count)
        bounds = [count * k // threads for k in range(threads + 1)]
        self.slices = list(pairwise(bounds))
        self._pool: ThreadPoolExecutor | None = None
        self._pid = -1

    def run(self, work: Callable[[int, int, int], None]) -> None:
        """Call work(slice index, first, last) for every slice; the last one on the calling thread."""
        if len(self.slices) == 1:
            work(0, *self.slices[0])
            return
        if self._pool is None or self._pid != os.getpid():
            self._pool = ThreadPoolExecutor(len(self.slices) - 1, thread_name_prefix="rigid-env")
            self._pid = os.getpid()
        waiting = [self._pool.submit(work, k, *bounds) for k, bounds in enumerate(self.slices[:-1])]
        try:
            work(len(self.slices) - 1, *self.slices[-1])
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
