"""Interface for `compiler.decorators` without compilation: kernels run as Python functions."""

from __future__ import annotations

import gc
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import wraps

import numpy as np

from physics.compiler.interpreted.ieee_source import as_ieee
from physics.compiler.interpreted.records import records_of, type_of
from physics.compiler.user_function import Examined, probe

# Lock with the meaning of `fused.backend.LOCK`.
LOCK = threading.RLock()

# Constants with the meanings that `fused.backend` explains.
PREPARES_CALLS, MAKES_MACHINE_CODE, COLLECT_AT = False, False, gc.get_threshold()
atomic_add = None


def part(function):
    """Make a kernel of a function: a Python function with the arithmetic of machine code."""
    made = as_ieee(function)
    made.py_func = function
    return made


shared_part = inlined_part = runtime_part = user_part = part


def entry(function):
    """Make a kernel that Python may call directly."""
    made = part(function)
    return wraps(made)(machine_code(made, ()))


def chosen(stub: Callable, choose: Callable) -> Callable:
    """Make a kernel that calls the function that `choose` picks from the arguments, once for each of their types."""
    known: dict[tuple, Callable] = {}

    def call(*arguments):
        types = tuple(map(type_of, arguments))
        found = known.get(types)
        if found is None:
            found = known[types] = as_ieee(choose(*arguments))
        return found(*arguments)

    return wraps(stub)(call)


def is_kernel(value) -> bool:
    """True if a value was made by a decorator of kernels."""
    return hasattr(value, "py_func")


def is_none(value) -> bool:
    """True if a value is None."""
    return value is None


def member(group, name: str):
    """Member `name` of a named tuple or of a record."""
    return getattr(group, name)


def record_members(record):
    """Names of the members of a record."""
    return record.dtype.names


def machine_code(kernel: Callable, arguments: tuple) -> Callable:
    """Make a function that calls a kernel, with arrays of records converted to `records.RecordArray`.

    `arguments` do not matter here.
    """

    def call(*arguments):
        with np.errstate(all="ignore"):
            return kernel(*records_of(arguments))

    return call


@part
def lend(value):
    """Lend arrays to other kernels: here they stay the same values."""
    return value


def renew(function) -> None:
    """Do nothing: a Python function reads globals at each call."""


@contextmanager
def count_compilations() -> Iterator[Callable[[], int]]:
    """Context manager that counts compilations; it yields a function that returns 0, as nothing is compiled."""
    yield lambda: 0


def examine(function: Callable, arguments: tuple, numbers: str) -> Examined:
    """Examine a user's function by a call with read-only numbers p; `fused.user_functions.examine` documents arguments.

    Without its intermediate code, every function counts as one that may raise an exception.
    """
    arguments[1].flags.writeable = False
    return Examined(probe(function, machine_code(function, arguments), arguments, numbers), None, may_raise=True)
