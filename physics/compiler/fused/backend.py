"""Compile kernels together: the interface of `compiler.decorators`."""

from __future__ import annotations

import gc
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import numba
from numba.core import event, types
from numba.core.compiler_lock import global_compiler_lock
from numba.core.dispatcher import Dispatcher
from numba.extending import intrinsic, overload

from physics.compiler.cache_folder import cache_dir
from physics.compiler.fused.ablation import is_on
from physics.compiler.fused.atomics import atomic_add  # noqa: F401 (a part of the interface)
from physics.compiler.fused.dispatcher import FOREIGN_KIND, PART_KIND, SHARED_KIND, Kernel
from physics.compiler.fused.user_functions import examine  # noqa: F401 (a part of the interface)

# Without Numba's run time (`_nrt`) there are no reference counts to keep, nor can a kernel allocate.
OPTIONS = {"error_model": "numpy", "nogil": True, "_nrt": False}

# Held while something is compiled or loaded.
LOCK = global_compiler_lock

# Calls are made in machine code, by the address of a kernel and of its arguments.
PREPARES_CALLS = True

# Python's calls of a kernel run machine code.
MAKES_MACHINE_CODE = True

# Allocations between two runs of the garbage collector while something is compiled; 0: none.
COLLECT_AT = (0, 0, 0) if is_on("paused_gc") else gc.get_threshold()


def make(function, called_as=PART_KIND, **options) -> Kernel:
    """Make a `Kernel` of `function` that is not kept on disk."""
    options = {"nopython": True, "boundscheck": None, **OPTIONS, **options}
    return Kernel(function, options=options, called_as=called_as)


def _kept(function, called_as=PART_KIND, **options) -> Kernel:
    made = make(function, called_as, **options)
    made.enable_caching(cache_dir())
    return made


def part(function) -> Kernel:
    """Compile a function that other kernels call.

    The part is marked as not to be inlined. Numba would otherwise inline it if its first caller is inlined, together
    with all that it calls, one copy for each call.
    """
    return _kept(function, forceinline=False)


entry = part


def shared_part(function) -> Kernel:
    """Compile a function with machine code of its own."""
    return _kept(function, SHARED_KIND, forceinline=False)


def inlined_part(function) -> Kernel:
    """Compile a function into its callers."""
    return _kept(function, forceinline=True)


def runtime_part(function) -> Kernel:
    """Compile a function into its callers, without a place on disk."""
    return make(function, FOREIGN_KIND, forceinline=True)


def user_part(function) -> Kernel:
    """Compile a user's function into its callers, with checks of its indices."""
    return make(function, FOREIGN_KIND, forceinline=True, boundscheck=True)


def chosen(stub: Callable, choose: Callable) -> Callable:
    """Let `choose` pick the function for a call of `stub`, which becomes a part of its caller, with no call left."""
    options = {**OPTIONS, "forceinline": True, "pipeline_class": Kernel.part_pipeline}
    overload(stub, jit_options=options, strict=False)(choose)
    return stub


def is_kernel(value) -> bool:
    """True for the result of a kernel decorator."""
    return isinstance(value, Kernel)


def is_none(value) -> bool:
    """True for None and its type."""
    return value is None or isinstance(value, types.NoneType)


def member(group, name: str):
    """A member of a named tuple, or the type of one in the type of a named tuple or of a record."""
    if isinstance(group, types.Record):
        return group.typeof(name)
    return group.types[group.fields.index(name)] if isinstance(group, types.BaseNamedTuple) else getattr(group, name)


def record_members(record):
    """Names of the members of a record, or of the type of one."""
    return record.fields if isinstance(record, types.Record) else record.dtype.names


def machine_code(kernel: Kernel, arguments: tuple) -> Callable:
    """Machine code of a kernel for arguments of these types, to be called with such arguments."""
    return kernel.compile(tuple(map(numba.typeof, arguments)))


@intrinsic
def lend(typing_context, value):
    """Return the same arrays: kernels count no references anyway."""
    return value(value), lambda context, builder, sig, args: args[0]


def renew(function: Dispatcher) -> None:
    """Drop the compiled code of a function, after a global that it reads has changed."""
    if isinstance(function, Kernel):
        function.renew()
    else:
        function.recompile()


@contextmanager
def count_compilations() -> Iterator[Callable[[], int]]:
    """Count the kernels compiled during the block; yields a function that returns the number."""
    with event.install_recorder("numba:compile") as recorder:
        yield lambda: sum(1 for _, what in recorder.buffer if what.is_start)
