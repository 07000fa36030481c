"""Kernels compiled for the arguments they are called with, and bound to them."""

from __future__ import annotations

import gc
import sys
import threading
from collections.abc import Callable
from contextlib import contextmanager
from functools import partial

import numba

# Seconds after which the first step of a plan says that it is compiling.
COMPILE_NOTICE = 1.0


def bound(kernel: Callable, *arguments) -> Callable[[], object]:
    """A kernel with its arguments, to be called often.

    Numba's dispatcher, which finds out the types of all arguments in each call, is left out.

    Parameters
    ----------
    kernel : Callable
        Of `physics.kernels.compiler.kernel`.
    *arguments
        Arrays are bound, not copied: what they hold when a call is made counts.
    """
    with compiling():
        return partial(kernel.compile(tuple(map(numba.typeof, arguments))), *arguments)


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
    gc.disable()
    try:
        yield
    finally:
        timer.cancel()
        if was_collecting:
            gc.enable()
