"""Interface of the fused compiler for `compiler.decorators`: kernels of a step are compiled together."""

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

# Numba's options of all kernels. Without its run time (`_nrt`) there are no reference counts, and no allocation.
OPTIONS = {"error_model": "numpy", "nogil": True, "_nrt": False}

# Lock that a thread holds while it compiles or loads a kernel.
LOCK = global_compiler_lock

# Whether machine code can make calls, by the addresses of a kernel and of its arguments.
PREPARES_CALLS = True

# Whether a call of a kernel from Python runs machine code.
MAKES_MACHINE_CODE = True

# Thresholds of the garbage collector while a kernel is compiled, as of `gc.set_threshold`; 0: it does not run.
COLLECT_AT = (0, 0, 0) if is_on("paused_gc") else gc.get_threshold()


def make(function, called_as=PART_KIND, **options) -> Kernel:
    """Make a `Kernel` of `function` that is not kept on disk.

    `called_as` is its role when other kernels call it, as of `Kernel`; `options` are Numba's.
    """
    options = {"nopython": True, "boundscheck": None, **OPTIONS, **options}
    return Kernel(function, options=options, called_as=called_as)


def _kept(function, called_as=PART_KIND, **options) -> Kernel:
    made = make(function, called_as, **options)
    made.enable_caching(cache_dir())
    return made


def part(function) -> Kernel:
    """Make a kernel of a function, which other kernels and Python may call.

    Numba must not inline it. It would otherwise inline the kernel, and all kernels below it, wherever the first caller
    is inlined, with a copy for each call.
    """
    return _kept(function, forceinline=False)


entry = part


def shared_part(function) -> Kernel:
    """Make a shared kernel of a function: its machine code is compiled once for all kernels that call it."""
    return _kept(function, SHARED_KIND, forceinline=False)


def inlined_part(function) -> Kernel:
    """Make a kernel of a function that is inlined in its callers."""
    return _kept(function, forceinline=True)


def runtime_part(function) -> Kernel:
    """Make a kernel of a function that is inlined in its callers and not kept on disk alone."""
    return make(function, FOREIGN_KIND, forceinline=True)


def user_part(function) -> Kernel:
    """Make a kernel of a user's function that is inlined in its callers and checks its indices."""
    return make(function, FOREIGN_KIND, forceinline=True, boundscheck=True)


def chosen(stub: Callable, choose: Callable) -> Callable:
    """Let `choose` pick, by the types of arguments, the function that replaces each call of `stub`; it is inlined."""
    options = {**OPTIONS, "forceinline": True, "pipeline_class": Kernel.part_pipeline}
    overload(stub, jit_options=options, strict=False)(choose)
    return stub


def is_kernel(value) -> bool:
    """True if a value was made by a decorator of kernels."""
    return isinstance(value, Kernel)


def is_none(value) -> bool:
    """True if a value is None, or Numba's type of None."""
    return value is None or isinstance(value, types.NoneType)


def member(group, name: str):
    """Member `name` of a named tuple; of the type of a named tuple or record, the type of that member."""
    if isinstance(group, types.Record):
        return group.typeof(name)
    return group.types[group.fields.index(name)] if isinstance(group, types.BaseNamedTuple) else getattr(group, name)


def record_members(record):
    """Names of the members of a record, given as a record or as its type."""
    return record.fields if isinstance(record, types.Record) else record.dtype.names


def machine_code(kernel: Kernel, arguments: tuple) -> Callable:
    """Compile a kernel for arguments of these types; return a function that runs the machine code."""
    return kernel.compile(tuple(map(numba.typeof, arguments)))


@intrinsic
def lend(typing_context, value):
    """Lend arrays to other kernels: here they stay the same values, since kernels count no references."""
    return value(value), lambda context, builder, sig, args: args[0]


def renew(function: Dispatcher) -> None:
    """Discard the compiled code of a function, after a global that it reads has changed."""
    if isinstance(function, Kernel):
        function.renew()
    else:
        function.recompile()


@contextmanager
def count_compilations() -> Iterator[Callable[[], int]]:
    """Context manager that counts compilations; it yields a function that returns their present number."""
    with event.install_recorder("numba:compile") as recorder:
        yield lambda: sum(1 for _, what in recorder.buffer if what.is_start)
