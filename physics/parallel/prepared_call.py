"""Calls of kernels from machine code, with arguments prepared in memory (`fused.prepared_entry`)."""

from __future__ import annotations

import operator
import struct
from collections.abc import Callable
from functools import cache, cached_property, partial
from itertools import accumulate

import numpy as np

from physics.compiler.decorators import backend, kernel
from physics.compiler.fused.prepared_calls import (
    JOB_ARGUMENTS,
    JOB_ENTRY,
    JOB_EXCEPTION,
    JOB_SIZE,
    JOB_STATUS,
)
from physics.kernels.parallel.prepared_calls import reraise, run_job, run_jobs

loop_kernel, perform_all = kernel, run_jobs  # decorator of a loop that makes calls, and how it makes those it is handed


class PreparedCall:
    """Calls of kernels with all their arguments, made one after another in machine code.

    Parameters
    ----------
    calls : list of (int, tuple)
        A kernel's entry (`entry`) and its arguments. Arrays are bound, not copied: a call reads their contents at its
        time.
    words : list of array, optional
        Their arguments as a kernel finds them, where others have them already; they are shared.

    Attributes
    ----------
    jobs, count : int
        Address of the table of these calls, and their number: what `physics.kernels.parallel.prepared_calls` is told.
    perform : callable
        Makes the calls; whether one raised something, which `reraise` raises.
    handed : tuple
        Arguments of `perform_all` for these calls.
    """

    def __init__(self, calls: list[tuple[int, tuple]], words: list[np.ndarray] | None = None):
        self._calls = calls  # they own what the table has addresses of
        if words is None:
            words = [np.array(_words(arguments), dtype=np.int64) for _, arguments in calls]
        self._words = words
        self._table = np.zeros((len(calls), JOB_SIZE), dtype=np.int64)
        self._table[:, JOB_ENTRY] = [entry for entry, _ in calls]
        self._table[:, JOB_ARGUMENTS] = [words.ctypes.data for words in self._words]
        self.handed = self.jobs, self.count = self._table.ctypes.data, len(calls)
        if self.count == 1:
            self.perform = partial(_performing_one(), self.jobs)
        else:
            self.perform = partial(_performing(), self.jobs, self.count)

    def __call__(self) -> None:
        """Make the calls."""
        if self.perform():
            self.raise_again()

    def raise_again(self) -> None:
        """Raise the exception of the last calls, if there was one."""
        for row in self._table:
            reraise(row[JOB_STATUS], row[JOB_EXCEPTION])

    def forget(self) -> None:
        """Clear the exceptions of all calls."""
        self._table[:, JOB_STATUS] = 0

    def put(self, argument: int, value: float | tuple) -> None:
        """Replace an argument of the first call: a number, or a group of as many numbers."""
        words, place = _words((value,)), self._places[argument]
        self._words[0][place : place + len(words)] = words

    @cached_property
    def _places(self) -> list[int]:
        """Offsets of the words of each argument of the first call."""
        return list(accumulate((len(_words((value,))) for value in self._calls[0][1]), initial=0))

    def then(self, other: PreparedCall) -> PreparedCall:
        """Join these calls with others after them; `put` changes the arguments of both."""
        return PreparedCall([*self._calls, *other._calls], [*self._words, *other._words])


@cache
def _performing() -> Callable[[int, int], bool]:
    return backend.machine_code(run_jobs, (0, 0))


@cache
def _performing_one() -> Callable[[int], bool]:
    return backend.machine_code(run_job, (0,))


def _words(arguments: tuple) -> list[int]:
    """Words of the arguments as a kernel reads them from memory: see `physics.compiler.fused.prepared_entry`."""
    words: list[int] = []
    for value in arguments:
        if isinstance(value, np.ndarray):
            words += (0, 0, value.size, value.itemsize, value.ctypes.data, *value.shape, *value.strides)
        elif isinstance(value, tuple):
            words += _words(value)
        elif isinstance(value, float):
            words += struct.unpack("=q", struct.pack("=d", value))
        else:
            words.append(0 if value is None else operator.index(value))
    return words


def entry(kernel: Callable, arguments: tuple) -> int:
    """Entry of a kernel that returns nothing, for arguments of these types; compiles it if necessary."""
    with backend.LOCK:  # nobody else adds to what is linked meanwhile
        return kernel.ready_entry(backend.machine_code(kernel, arguments))
