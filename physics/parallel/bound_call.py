"""Kernels compiled for the arguments they are called with, and bound to them."""

from __future__ import annotations

import gc
import operator
import struct
import sys
import threading
from collections.abc import Callable
from contextlib import contextmanager
from functools import cache, cached_property, partial
from itertools import accumulate

import numba
import numpy as np
from numba.core.compiler_lock import global_compiler_lock

from physics.kernels.compile.fused.ablation import is_on
from physics.kernels.parallel.prepared_calls import (
    JOB_ARGUMENTS,
    JOB_ENTRY,
    JOB_EXCEPTION,
    JOB_SIZE,
    JOB_STATUS,
    reraise,
    run_job,
    run_jobs,
)

# Seconds after which the first step of a plan says that it is compiling.
COMPILE_NOTICE = 1.0


class Work:
    """Calls of kernels with all their arguments, made one after another in machine code.

    Parameters
    ----------
    calls : list of (int, tuple)
        A kernel's entry (`Kernel.ready_entry`) and its arguments. Arrays are bound, not copied: what they hold when a
        call is made counts.

    Attributes
    ----------
    jobs, count : int
        Address of the table of these calls, and their number: what `physics.kernels.parallel.prepared_calls` is told.
    perform : callable
        Makes the calls; whether one raised something, which `reraise` raises.
    """

    def __init__(self, calls: list[tuple[int, tuple]]):
        self._calls = calls  # they own what the table has addresses of
        self._words = [np.array(_words(arguments), dtype=np.int64) for _, arguments in calls]
        self._table = np.zeros((len(calls), JOB_SIZE), dtype=np.int64)
        self._table[:, JOB_ENTRY] = [entry for entry, _ in calls]
        self._table[:, JOB_ARGUMENTS] = [words.ctypes.data for words in self._words]
        self.jobs, self.count = self._table.ctypes.data, len(calls)
        if self.count == 1:
            self.perform = partial(_performing_one(), self.jobs)
        else:
            self.perform = partial(_performing(), self.jobs, self.count)

    def __call__(self) -> None:
        """Make the calls."""
        if self.perform():
            self.raise_again()

    def raise_again(self) -> None:
        """Raise what one of the calls raised when they were made last, if one did."""
        for row in self._table:
            reraise(row[JOB_STATUS], row[JOB_EXCEPTION])

    def forget(self) -> None:
        """Let none of the calls have raised anything."""
        self._table[:, JOB_STATUS] = 0

    def put(self, argument: int, value: float | tuple) -> None:
        """Give the first of the calls another value for an argument: a number, or as many of them as it had."""
        words, place = _words((value,)), self._places[argument]
        self._words[0][place : place + len(words)] = words

    @cached_property
    def _places(self) -> list[int]:
        """Return the offsets of the words of each argument of the first call."""
        return list(accumulate((len(_words((value,))) for value in self._calls[0][1]), initial=0))

    def then(self, other: Work) -> Work:
        """These calls, and the other ones after them."""
        return Work([*self._calls, *other._calls])


@cache
def _performing() -> Callable[[int, int], bool]:
    return compiled(run_jobs, (0, 0))


@cache
def _performing_one() -> Callable[[int], bool]:
    return compiled(run_job, (0,))


def _words(arguments: tuple) -> list[int]:
    """Arguments as a kernel finds them in memory: see `physics.kernels.compile.fused.prepared_entry`."""
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


def compiled(kernel: Callable, arguments: tuple) -> Callable:
    """The machine code of a kernel for arguments of these types.

    To call it leaves out Numba's dispatcher, which finds out the types of all arguments in each call.
    """
    with global_compiler_lock, compiling():
        return kernel.compile(tuple(map(numba.typeof, arguments)))


def bound(kernel: Callable, *arguments) -> Work:
    """A kernel that returns nothing with its arguments, to be called often.

    Parameters
    ----------
    kernel : Callable
        Of `physics.kernels.compile.decorators.kernel`.
    *arguments
        Arrays are bound, not copied: what they hold when a call is made counts.
    """
    with global_compiler_lock:
        entry = kernel.ready_entry(compiled(kernel, arguments))
    return Work([(entry, arguments)])


@contextmanager
def compiling():
    """Say on standard error that a kernel is being compiled, if it takes long enough to notice.

    The garbage collector waits: it would walk through Numba's growing tables again and again, a tenth of the time.
    """
    text = "rigid-env: compiling the kernel of this scene, once (it is kept for later runs) ..."
    timer = threading.Timer(COMPILE_NOTICE, lambda: print(text, file=sys.stderr, flush=True))
    timer.daemon = True
    was_collecting = gc.isenabled()
    timer.start()
    if is_on("paused_gc"):
        gc.disable()
    try:
        yield
    finally:
        timer.cancel()
        if was_collecting:
            gc.enable()
