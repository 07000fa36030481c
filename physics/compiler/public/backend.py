"""Compile each kernel with `numba.njit`: the interface of `compiler.decorators`, without private interfaces of Numba.

A kernel that Python calls is compiled with all kernels below it, and Numba keeps it on disk in a folder of ours. LLVM
decides alone what it inlines.
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

# Held while something is compiled or loaded.
LOCK = threading.RLock()

# Answers as of `fused.backend`. Numba's tables would take half a gigabyte without the garbage collector.
PREPARES_CALLS, MAKES_MACHINE_CODE, COLLECT_AT = False, True, (100_000, 50, 50)
atomic_add = None

_compilations = 0


def part(function):
    """Compile a function that other kernels call."""
    return numba.njit(**OPTIONS)(function)


shared_part = inlined_part = runtime_part = part


@cache
def _own_folder() -> Path | None:
    """Folder of machine code if nobody else may write to it, since Numba runs any content."""
    folder = cache_dir()
    if folder is None:
        return None
    try:  # where Numba cannot write it takes `__pycache__`, and machine code of kernels that were edited since
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
    """Compile a function that Python calls; it is kept on disk, with the machine code of all below it."""
    folder = _own_folder()
    if folder is None:
        return part(function)
    before, numba.config.CACHE_DIR = numba.config.CACHE_DIR, str(folder)
    try:
        return numba.njit(cache=True, **OPTIONS)(function)
    finally:
        numba.config.CACHE_DIR = before


def user_part(function):
    """Compile a user's function, with checks of its indices."""
    return numba.njit(boundscheck=True, **OPTIONS)(function)


def chosen(stub: Callable, choose: Callable) -> Callable:
    """Let `choose` pick the function for a call of `stub`."""
    overload(stub, jit_options=OPTIONS, strict=False)(choose)
    return stub


def is_kernel(value) -> bool:
    """True for the result of a kernel decorator."""
    return is_jitted(value)


def is_none(value) -> bool:
    """True for None and its type."""
    return value is None or isinstance(value, types.NoneType)


def member(group, name: str):
    """A member of a named tuple, or the type of one in the type of a named tuple or of a record."""
    if isinstance(group, types.Record):
        return group.typeof(name)
    return member_type(group, name) if isinstance(group, types.Type) else getattr(group, name)


def record_members(record):
    """Names of the members of a record, or of the type of one."""
    return record.fields if isinstance(record, types.Record) else record.dtype.names


@cache
def _entry(kernel):
    return entry(kernel.py_func)


def machine_code(kernel, arguments: tuple) -> Callable:
    """Machine code of a kernel for arguments of these types, to be called with such arguments."""
    global _compilations
    with LOCK:
        declare_members(arguments)
        whole = _entry(kernel)
        loaded = sum(whole.stats.cache_hits.values())
        _compilations += 1  # as far as is known until it ends
        code = whole.compile(tuple(map(numba.typeof, arguments)))
        _compilations -= sum(whole.stats.cache_hits.values()) - loaded
    return code


def renew(function) -> None:
    """Drop the compiled code of a function, after a global that it reads has changed."""
    function.recompile()


@contextmanager
def count_compilations() -> Iterator[Callable[[], int]]:
    """Count the kernels compiled during the block; yields a function that returns the number."""
    before = _compilations
    yield lambda: _compilations - before


def examine(function, arguments: tuple, numbers: str) -> Examined:
    """Compile a user's function for read-only numbers p, and call it once; see `fused.user_functions.examine`."""
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
