"""Interface for `compiler.decorators` with `numba.njit` for each kernel, without private interfaces of Numba.

A kernel that Python calls is compiled with all kernels below it; Numba keeps it on disk, in a folder of this package.
LLVM decides which kernels it inlines.
"""

from __future__ import annotations

import tempfile
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path

import numba
from numba import TypingError, types
from numba.extending import is_jitted, overload

from physics.compiler.cache_folder import cache_dir, is_owned_by_user
from physics.compiler.notices import warn
from physics.compiler.public.lent import declare_members, lend, member_type  # noqa: F401 (`lend`: for `compiler.decorators`)
from physics.compiler.public.simd_types import OPTIONS  # which also registers operations on lanes
from physics.compiler.user_function import Examined, FaultyFunctionError, probe

# Lock that a thread holds while it compiles or loads a kernel.
LOCK = threading.RLock()

# Constants with the meanings that `fused.backend` explains. Without the garbage collector Numba's tables would take
# half a gigabyte.
PREPARES_CALLS, MAKES_MACHINE_CODE, COLLECT_AT = False, True, (100_000, 50, 50)
atomic_add = None

_compilations = 0


def part(function):
    """Make a kernel of a function that other kernels call."""
    return numba.njit(**OPTIONS)(function)


shared_part = inlined_part = runtime_part = part


@cache
def _own_folder() -> Path | None:
    """Folder of machine code; None if it cannot be written, or if other users may write to it.

    Numba runs the content of its cache files without a check.
    """
    folder = cache_dir()
    if folder is None:
        return None
    try:  # without write access Numba would use `__pycache__`, and there old machine code of kernels edited since
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        warn(f"kernels cannot be kept in {folder} ({error.strerror or error}): each process compiles them")
        return None
    if is_owned_by_user(folder.stat()):
        return folder
    warn(f"{folder} is not used, since other users may write to it: each process compiles its kernels")
    return None


def entry(function):
    """Make a kernel of a function that Python calls; Numba keeps it on disk, together with all kernels below it."""
    folder = _own_folder()
    if folder is None:
        return part(function)
    before, numba.config.CACHE_DIR = numba.config.CACHE_DIR, str(folder)
    try:
        return numba.njit(cache=True, **OPTIONS)(function)
    finally:
        numba.config.CACHE_DIR = before


def user_part(function):
    """Make a kernel of a user's function that checks its indices."""
    return numba.njit(boundscheck=True, **OPTIONS)(function)


def chosen(stub: Callable, choose: Callable) -> Callable:
    """Let `choose` pick, by the types of arguments, the function that replaces each call of `stub`."""
    overload(stub, jit_options=OPTIONS, strict=False)(choose)
    return stub


def is_kernel(value) -> bool:
    """True if a value was made by a decorator of kernels."""
    return is_jitted(value)


def is_none(value) -> bool:
    """True if a value is None, or Numba's type of None."""
    return value is None or isinstance(value, types.NoneType)


def member(group, name: str):
    """Member `name` of a named tuple; of the type of a named tuple or record, the type of that member."""
    if isinstance(group, types.Record):
        return group.typeof(name)
    return member_type(group, name) if isinstance(group, types.Type) else getattr(group, name)


def record_members(record):
    """Names of the members of a record, given as a record or as its type."""
    return record.fields if isinstance(record, types.Record) else record.dtype.names


@cache
def _entry(kernel):
    return entry(kernel.py_func)


def machine_code(kernel, arguments: tuple) -> Callable:
    """Compile a kernel for arguments of these types; return a function that runs the machine code."""
    global _compilations
    with LOCK:
        declare_members(arguments)
        whole = _entry(kernel)
        loaded = sum(whole.stats.cache_hits.values())
        _compilations += 1  # corrected below if the machine code was loaded from disk
        code = whole.compile(tuple(map(numba.typeof, arguments)))
        _compilations -= sum(whole.stats.cache_hits.values()) - loaded
    return code


def renew(function) -> None:
    """Discard the compiled code of a function, after a global that it reads has changed."""
    function.recompile()


@contextmanager
def count_compilations() -> Iterator[Callable[[], int]]:
    """Context manager that counts compilations; it yields a function that returns their present number."""
    before = _compilations
    yield lambda: _compilations - before


def examine(function, arguments: tuple, numbers: str) -> Examined:
    """Examine a user's function: compile it for read-only numbers p and call it once.

    `fused.user_functions.examine` documents the arguments. Without a look at its code, every function counts as one
    that may raise an exception.
    """
    state, p, t = arguments
    p.flags.writeable = False
    arguments = state, p, t
    try:
        called = function.compile(tuple(map(numba.typeof, arguments)))
    except TypingError as error:
        if "setitem(readonly array" in str(error):
            raise FaultyFunctionError("writes to p; allowed is to read it", function, None) from None
        raise
    return Examined(probe(function, called, arguments, numbers), None, may_raise=True)
