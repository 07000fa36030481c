"""Compilation of kernels for the types of given arguments, and calls of kernels with bound arguments."""

from __future__ import annotations

import gc
import sys
import threading
from collections.abc import Callable
from contextlib import contextmanager

from physics.compiler.decorators import backend

if backend.PREPARES_CALLS:
    from physics.parallel.prepared_call import PreparedCall as BoundCall
    from physics.parallel.prepared_call import entry, loop_kernel, perform_all
else:
    from physics.parallel.direct_call import DirectCall as BoundCall
    from physics.parallel.direct_call import entry, loop_kernel, perform_all

__all__ = ["BoundCall", "bound", "bound_alike", "compiled", "compiled_entry", "compiling", "loop_kernel", "perform_all"]

# Time after which a compilation is announced on standard error [s].
COMPILE_NOTICE = 1.0


def compiled(kernel: Callable, arguments: tuple) -> Callable:
    """Compile a kernel for arguments of the types of `arguments`; return a function that calls the machine code.

    Its calls skip Numba's dispatcher, which would determine the types of all arguments in each call.
    """
    with backend.LOCK, compiling():
        return backend.machine_code(kernel, arguments)


def compiled_entry(kernel: Callable, arguments: tuple):
    """Compile a kernel that returns nothing for arguments of these types; return its entry, as `BoundCall` takes it."""
    with backend.LOCK, compiling():
        return entry(kernel, arguments)


def bound(kernel: Callable, *arguments) -> BoundCall:
    """Compile a kernel that returns nothing and bind it to its arguments, for many calls.

    Parameters
    ----------
    kernel : Callable
        Kernel, made by `physics.compiler.decorators.kernel`.
    *arguments
        Arguments of every call. Arrays are not copied: each call reads their contents at that time.
    """
    return BoundCall([(compiled_entry(kernel, arguments), arguments)])


def bound_alike(key, kernel: Callable, *arguments) -> BoundCall:
    """Bind a kernel to its arguments as `bound` does, quicker if the same kernel and `key` were bound before.

    Equal kernels and keys must mean equal types of arguments, which are determined at the first call only.
    """
    if (kernel, key) not in _ENTRIES:
        _ENTRIES[kernel, key] = compiled_entry(kernel, arguments)
    return BoundCall([(_ENTRIES[kernel, key], arguments)])


_ENTRIES: dict[tuple, object] = {}


@contextmanager
def compiling():
    """Context manager around a compilation: it prints a line on standard error if that takes noticeably long.

    Within it the garbage collector runs less often, since its scans of Numba's growing tables would take a tenth or a
    fifth of the time.
    """
    is_over = threading.Event()
    before = gc.get_threshold()
    gc.set_threshold(*backend.COLLECT_AT)
    try:
        with backend.count_compilations() as count:
            threading.Thread(target=_tell, args=(count, is_over), daemon=True).start()
            yield
    finally:
        is_over.set()
        gc.set_threshold(*before)


def _tell(count: Callable[[], int], is_over: threading.Event) -> None:
    """Print a line once `COMPILE_NOTICE` has passed and `count()`, the number of compilations, is above 0.

    Nothing is printed if `is_over` is set before.
    """
    while not is_over.wait(COMPILE_NOTICE):
        if count() > 0:
            text = "rigid-env: compiling a kernel for this scene, in ten seconds to a minute (it is kept for later) ..."
            print(text, file=sys.stderr, flush=True)
            return
