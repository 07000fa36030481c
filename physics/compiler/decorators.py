"""Decorate kernels: one source for each compiler (`compiler_choice`)."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from typing import Any, TypeVar

from physics.compiler.compiler_choice import COMPILER, FUSED, NUMBA

if COMPILER == FUSED:
    from physics.compiler.fused import backend
elif COMPILER == NUMBA:
    from physics.compiler.public import backend
else:
    from physics.compiler.interpreted import backend

Function = TypeVar("Function", bound=Callable[..., Any])
"""Type variable of a function whose signature a decorator keeps."""

is_kernel, lend = backend.is_kernel, backend.lend


def is_compiled(value) -> bool:
    """True for a kernel, and for a function that others have compiled by Numba."""
    return hasattr(value, "py_func")


def plain_function(value):
    """Python function of a compiled one; any other value as it is."""
    return getattr(value, "py_func", value)


def kernel(function):
    """Compile `function`: IEEE semantics, the GIL released.

    A division by zero gives inf and not an exception. There is no `fastmath`, so results do not depend on how an
    optimiser reorders a sum. `fused` rounds a product in a sum with it, which is said for each
    (`fused.folding_builder.fused_multiply_add`). A kernel allocates nothing: arrays are lent to it.

    An index counts from the front of its axis, unless it is a literal: nothing asks whether it is negative. Under
    `NUMBA_BOUNDSCHECK=1` one that is outside its axis raises IndexError.

    Switches among the arguments are passed as ``None`` (off) or not (on). A kernel is compiled for the types of its
    arguments, so that LLVM drops effects that are off. Numba prunes a branch on ``x is not None`` of an argument x that
    is None before it infers types; of any other both branches have to have types. Where one has none, or is large, it
    stands in a function that is chosen by the type of the switch (`if_given`).

    A variable of a kernel with branches is not named after another one with digits behind, as x1 and x12 are: Numba may
    take one for the other, and then cannot compile it (`tests/kernels/test_variable_names.py`).
    """
    return backend.part(function)


def entry_kernel(function):
    """Compile a `kernel` that Python calls directly, without `physics.parallel.bound_call`."""
    return backend.entry(function)


def cold_kernel(function):
    """Compile a `kernel` that steps seldom need: `fused` does not inline it.

    LLVM copies a function with one call into its caller, however long it is. The caller's usual path then has fewer
    registers for its numbers, and moves them to the stack and back.
    """
    function.is_cold = True
    return backend.part(function)


def shared_kernel(function):
    """Compile a `kernel` that all plans share: `fused` gives it its own machine code (`fused.dispatcher`)."""
    return backend.shared_part(function)


def inlined(function):
    """Compile a `kernel` of a few instructions, or with one caller: `fused` inlines it."""
    return backend.inlined_part(function)


def runtime_kernel(function):
    """Compile an `inlined` kernel made at run time, or by a user; it is kept on disk with its callers."""
    return backend.runtime_part(function)


def user_kernel(function: Function) -> Function:
    """Compile a `runtime_kernel` of a user's function, in which an index outside its axis raises IndexError."""
    return backend.user_part(function)


def by_type(choose: Callable, about: Callable | None = None):
    """Make a kernel that dispatches to another kernel for each type of its arguments.

    Parameters
    ----------
    choose : callable
        From the types of the arguments, or from the arguments themselves where nothing is compiled, to a function of
        the same arguments.
    about : callable, optional
        The function whose name and docstring it has.
    """

    def stub(*arguments):
        return choose(*arguments)(*arguments)

    for name in ("__name__", "__qualname__", "__doc__", "__module__"):
        if about is not None:
            setattr(stub, name, getattr(about, name))
    return backend.chosen(stub, choose)


def when(is_chosen: Callable, otherwise=None):
    """Make a kernel that is chosen by type: it is called where `is_chosen` is true of the types of its arguments.

    Parameters
    ----------
    is_chosen : callable
        From the types of the arguments, or from the arguments, to a truth.
    otherwise : callable or number or None
        What is called instead, with the same arguments, or returned.
    """

    def constant(*arguments):
        return otherwise

    skip = otherwise if callable(otherwise) else constant

    def decorate(function):
        compiled = kernel(function)

        def call(*arguments):
            return compiled(*arguments)

        return by_type(lambda *types: call if is_chosen(*types) else skip, function)

    return decorate


def if_given(switch: str, otherwise=None):
    """Make a kernel that is called where a switch is on; elsewhere `otherwise` takes its place.

    Parameters
    ----------
    switch : str
        Name of an argument, or of a member of one, as in `contact.friction`: None where it is off.
    otherwise : callable or number or None
        Function of the same arguments, or a value.
    """

    def constant(*arguments):
        return otherwise

    skip = otherwise if callable(otherwise) else constant

    def decorate(function):
        name, *path = switch.split(".")
        place = list(inspect.signature(function).parameters).index(name)

        def choose(*types):
            found = types[place]
            for member in path:
                found = backend.member(found, member)
            return skip if backend.is_none(found) else plain_function(function)

        return by_type(choose, function)

    return decorate


def members(group) -> list[str]:
    """Names of the members of a record, or of its type."""
    return list(backend.record_members(group))
