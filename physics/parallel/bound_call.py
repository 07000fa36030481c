"""Compile kernels for the types of their arguments, and bind them to the arguments."""

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

# Seconds after which the first step of a plan says that it is compiling.
COMPILE_NOTICE = 1.0


def compiled(kernel: Callable, arguments: tuple) -> Callable:
    """Machine code of a kernel for arguments of these types.

    A call of machine code skips Numba's dispatcher, which determines the types of all arguments in each call.
    """
    with backend.LOCK, compiling():
        return backend.machine_code(kernel, arguments)


def compiled_entry(kernel: Callable, arguments: tuple):
    """Entry of a kernel that returns nothing, for arguments of these types, as `BoundCall` takes it."""
    with backend.LOCK, compiling():
        return entry(kernel, arguments)


def bound(kernel: Callable, *arguments) -> BoundCall:
    """Bind a kernel that returns nothing to its arguments, for many calls.

    Parameters
    ----------
    kernel : Callable
        Of `physics.compiler.decorators.kernel`.
    *arguments
        Arrays are bound, not copied: a call reads their contents at its time.
    """
    return BoundCall([(compiled_entry(kernel, arguments), arguments)])


def bound_alike(key, kernel: Callable, *arguments) -> BoundCall:
    """Bind a kernel whose types of arguments follow from it and a `key`; this saves the slow look at each argument."""
    if (kernel, key) not in _ENTRIES:
        _ENTRIES[kernel, key] = compiled_entry(kernel, arguments)
    return BoundCall([(_ENTRIES[kernel, key], arguments)])


_ENTRIES: dict[tuple, object] = {}


@contextmanager
def compiling():
    """Print on standard error that a kernel is being compiled, if this takes noticeably long.

    Meanwhile the garbage collector scans Numba's growing tables less often; it would take a tenth or a fifth of the
    time.
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
    """Print a line as soon as something compiles and some time has passed; loading alone is not worth one."""
    while not is_over.wait(COMPILE_NOTICE):
        if count() > 0:
            text = "rigid-env: compiling a kernel for this scene (it is kept for later runs) ..."
            print(text, file=sys.stderr, flush=True)
            return
