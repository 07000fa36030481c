"""Run kernels as Python functions: the interface of `compiler.decorators` without a compiler."""

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

# Held while something is compiled elsewhere; here nothing is.
LOCK = threading.RLock()

# Answers as of `fused.backend`.
PREPARES_CALLS, MAKES_MACHINE_CODE, COLLECT_AT = False, False, gc.get_threshold()
atomic_add = None


def part(function):
    """Make a kernel of a function: the same function, with the arithmetic of machine code."""
    made = as_ieee(function)
    made.py_func = function
    return made


shared_part = inlined_part = runtime_part = user_part = part


def entry(function):
    """Make a kernel that Python calls."""
    made = part(function)
    return wraps(made)(machine_code(made, ()))


def chosen(stub: Callable, choose: Callable) -> Callable:
    """Call `choose` once for each type of the arguments."""
    known: dict[tuple, Callable] = {}

    def call(*arguments):
        types = tuple(map(type_of, arguments))
        found = known.get(types)
        if found is None:
            found = known[types] = as_ieee(choose(*arguments))
        return found(*arguments)

    return wraps(stub)(call)


def is_kernel(value) -> bool:
    """True for the result of a kernel decorator."""
    return hasattr(value, "py_func")


def is_none(value) -> bool:
    """True for None."""
    return value is None


def member(group, name: str):
    """A member of a named tuple or of a record."""
    return getattr(group, name)


def record_members(record):
    """Names of the members of a record."""
    return record.dtype.names


def machine_code(kernel: Callable, arguments: tuple) -> Callable:
    """The kernel as Python calls it, with arrays of records lent as `records.RecordArray`."""

    def call(*arguments):
        with np.errstate(all="ignore"):
            return kernel(*records_of(arguments))

    return call


@part
def lend(value):
    """Return the same arrays."""
    return value


def renew(function) -> None:
    """Do nothing: a Python function reads globals when it is called."""


@contextmanager
def count_compilations() -> Iterator[Callable[[], int]]:
    """Count the kernels compiled during the block: none."""
    yield lambda: 0


def examine(function: Callable, arguments: tuple, numbers: str) -> Examined:
    """Call a user's function once, with read-only numbers p; see `fused.user_functions.examine`."""
    arguments[1].flags.writeable = False
    return Examined(probe(function, machine_code(function, arguments), arguments, numbers), None, may_raise=True)
