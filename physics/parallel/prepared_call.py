"""Bound calls of kernels that machine code makes, with arguments prepared in memory; for the compiler `fused`.

`physics.compiler.fused.prepared_entry` makes the entries of kernels that such calls use.
"""

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

loop_kernel, perform_all = kernel, run_jobs  # decorator of a loop that makes bound calls; function that makes them


class PreparedCall:
    """Calls of kernels with bound arguments, made one after another in machine code.

    Parameters
    ----------
    calls : list of (int, tuple)
        Entry of a kernel (`entry`), and its arguments. Arrays are not copied: each call reads their contents at that
        time.
    words : list of array, optional
        Prepared arguments of each call, as `_words` makes them, if another object has them already; they are shared.

    Attributes
    ----------
    jobs, count : int
        Address of the table of these calls, and their number, for `physics.kernels.parallel.prepared_calls`.
    perform : callable
        Makes the calls and returns whether one raised an exception, which `raise_again` then raises.
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
        """Make the calls; an exception of one is raised."""
        if self.perform():
            self.raise_again()

    def raise_again(self) -> None:
        """Raise the exception that a call of the last `perform` raised, if there was one."""
        for row in self._table:
            reraise(row[JOB_STATUS], row[JOB_EXCEPTION])

    def forget(self) -> None:
        """Forget the exceptions of all calls."""
        self._table[:, JOB_STATUS] = 0

    def put(self, argument: int, value: float | tuple) -> None:
        """Replace argument number `argument` of the first call by another number, or group of as many numbers."""
        words, place = _words((value,)), self._places[argument]
        self._words[0][place : place + len(words)] = words

    @cached_property
    def _places(self) -> list[int]:
        """Index of the first word of each argument of the first call."""
        return list(accumulate((len(_words((value,))) for value in self._calls[0][1]), initial=0))

    def then(self, other: PreparedCall) -> PreparedCall:
        """Join these calls with those of `other`, made after them. Arguments are shared: `put` acts in both objects."""
        return PreparedCall([*self._calls, *other._calls], [*self._words, *other._words])


@cache
def _performing() -> Callable[[int, int], bool]:
    return backend.machine_code(run_jobs, (0, 0))


@cache
def _performing_one() -> Callable[[int], bool]:
    return backend.machine_code(run_job, (0,))


def _words(arguments: tuple) -> list[int]:
    """Convert arguments to 64-bit words, as an entry of `physics.compiler.fused.prepared_entry` reads them."""
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
    """Address of the prepared entry of a kernel that returns nothing, for arguments of these types.

    The kernel is compiled if necessary.
    """
    with backend.LOCK:  # no other thread may link machine code meanwhile
        return kernel.ready_entry(backend.machine_code(kernel, arguments))
