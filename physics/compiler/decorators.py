"""Decorators of kernels. They have the same meaning for all compilers; `compiler_choice` has chosen the one in use."""

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
"""Type variable for decorators that return a function of the same signature."""

is_kernel, lend = backend.is_kernel, backend.lend


def is_compiled(value) -> bool:
    """True if a value is a kernel, or a function that other code has compiled with Numba."""
    return hasattr(value, "py_func")


def plain_function(value):
    """Python function from which a kernel was compiled; any other value is returned unchanged."""
    return getattr(value, "py_func", value)


def kernel(function):
    """Decorate a function as a kernel that other kernels call; it is compiled for the types of its arguments.

    Arithmetic follows IEEE 754: a division by zero gives inf, not an exception. Without `fastmath` results do not
    depend on how an optimiser reorders a sum. With `fused` a product in a sum is rounded together with the sum
    (`fused.folding_builder.fused_multiply_add`). Kernels run without the GIL. A kernel must not allocate arrays; it
    works on those of its arguments.

    An index counts from the front of its axis, and must not be negative unless it is a literal. Only under
    `NUMBA_BOUNDSCHECK=1` an index outside its axis raises IndexError.

    An effect switch among the arguments is ``None`` for off, anything else for on. Since a kernel is compiled for the
    types of its arguments, code behind a switch that is off is removed. Numba removes a branch on ``x is not None``
    before type inference only if x itself is an argument, and None; all other branches must have types even if they
    never run. A branch that would have no types, or is large, becomes a function of its own that the type of the switch
    chooses (`if_given`).

    In a kernel with branches no variable may have the name of another one followed by digits, as x1 and x12: Numba may
    mistake one for the other, and then cannot compile the kernel (`tests/kernels/test_variable_names.py`).
    """
    return backend.part(function)


def entry_kernel(function):
    """Decorate a function as a `kernel` that Python may call directly, without `physics.parallel.bound_call`."""
    return backend.entry(function)


def cold_kernel(function):
    """Decorate a function as a `kernel` that steps seldom need, and that `fused` therefore does not inline.

    LLVM would inline a function with a single call, however long it is. The usual path of the caller would then have
    fewer registers for its numbers, and would move them to the stack and back.
    """
    function.is_cold = True
    return backend.part(function)


def shared_kernel(function):
    """Decorate a function as a `kernel` that all plans share: `fused` compiles it once per signature for all of them.

    `physics.compiler.fused.dispatcher` explains shared kernels.
    """
    return backend.shared_part(function)


def inlined(function):
    """Decorate a function as a `kernel` that `fused` inlines: one of a few instructions, or with a single caller."""
    return backend.inlined_part(function)


def runtime_kernel(function):
    """Decorate a function made at run time, or by a user, as an `inlined` kernel without a cache file of its own.

    Its machine code is kept on disk as a part of its callers.
    """
    return backend.runtime_part(function)


def user_kernel(function: Function) -> Function:
    """Decorate a user's function as a `runtime_kernel` in which an index outside its axis raises IndexError."""
    return backend.user_part(function)


def by_type(choose: Callable, about: Callable | None = None):
    """Make a kernel that calls one of several functions, chosen by the types of the arguments while compiling.

    Parameters
    ----------
    choose : callable
        Takes the types of the arguments (the arguments themselves with the compiler `python`) and returns a function
        of the same arguments.
    about : callable, optional
        Function whose name and docstring the kernel gets.
    """

    def stub(*arguments):
        return choose(*arguments)(*arguments)

    for name in ("__name__", "__qualname__", "__doc__", "__module__"):
        if about is not None:
            setattr(stub, name, getattr(about, name))
    return backend.chosen(stub, choose)


def when(is_chosen: Callable, otherwise=None):
    """Make a decorator of a kernel that runs only for some types of arguments, decided while compiling.

    Parameters
    ----------
    is_chosen : callable
        Takes the types of the arguments (the arguments themselves with the compiler `python`); True: the decorated
        function is called.
    otherwise : callable or number or None
        Replacement for other types: a function that is called with the same arguments, or a value that is returned.
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
    """Make a decorator of a kernel that runs only if an effect switch is on, decided while compiling.

    Parameters
    ----------
    switch : str
        Name of the argument that is the switch, or of a member of an argument, as in `contact.friction`. It is off if
        it is None.
    otherwise : callable or number or None
        Replacement if the switch is off: a function that is called with the same arguments, or a value that is
        returned.
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
    """Names of the members of a record, given as a record or as its type."""
    return list(backend.record_members(group))
