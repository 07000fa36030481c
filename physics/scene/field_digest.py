"""Digests of users' functions, which change with the code, and functions compiled for the current digest."""

from __future__ import annotations

import hashlib
import inspect
import types
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

from physics.compiler.decorators import backend, is_compiled, plain_function, user_kernel


def digest(*functions: Callable | None) -> str:
    """Hexadecimal digest of everything that decides the machine code of these functions.

    It covers the bytecode of the functions, and recursively the globals and closure variables (numbers, arrays,
    functions) that they read. For a module that they name it covers the whole source file.
    """
    found = hashlib.sha256()
    seen: set[int] = set()
    for function in functions:
        _feed(found, function, seen)
    return found.hexdigest()[:16]


def _feed(found, value, seen: set[int]) -> None:
    """Add to the digest `found` a value that a function reads, recursively.

    `seen` holds the ids of the functions that the digest covers already.
    """
    value = plain_function(value)
    if isinstance(value, types.FunctionType):
        if id(value) not in seen:
            seen.add(id(value))
            _feed_function(found, value, seen)
    elif isinstance(value, types.ModuleType):
        found.update(value.__name__.encode())
        source = getattr(value, "__file__", None)
        if source and Path(source).suffix == ".py":
            found.update(Path(source).read_bytes())
    elif isinstance(value, np.ndarray):
        found.update(f"{value.dtype}{value.shape}".encode() + value.tobytes())
    elif isinstance(value, (tuple, list)):
        for item in value:
            _feed(found, item, seen)
    elif isinstance(value, type):
        found.update(f"{value.__module__}.{value.__qualname__}".encode())
    else:
        found.update(repr(value).encode())


def _feed_function(found, function: types.FunctionType, seen: set[int]) -> None:
    around = inspect.getclosurevars(function)
    code = function.__code__
    found.update(code.co_code)
    found.update(repr((code.co_names, code.co_varnames)).encode())
    for constant in code.co_consts:
        if isinstance(constant, types.CodeType):
            found.update(constant.co_code + repr(constant.co_names).encode())
        else:
            found.update(repr(constant).encode())
    for names in (around.nonlocals, around.globals):
        for name in sorted(names):
            found.update(name.encode())
            _feed(found, names[name], seen)


def called(function: Callable, seen: set | None = None) -> Iterator[Callable]:
    """Iterate over a kernel and all kernels among its globals and closure variables, recursively.

    Kernels that it reaches as attributes of a module are left out. `seen` holds those that were yielded already.
    """
    seen = set() if seen is None else seen
    if function in seen:
        return
    seen.add(function)
    yield function
    around = inspect.getclosurevars(plain_function(function))
    for value in (*around.nonlocals.values(), *around.globals.values()):
        if is_compiled(value):
            yield from called(value, seen)


def as_it_is(function: Callable) -> Callable:
    """Compile a user's function for the current values of the globals that it reads; return the kernel.

    Numba reads globals only when it compiles. So kernels that read a global which has changed since are discarded and
    compiled again.
    """
    key = plain_function(function), digest(function)
    if key not in _AS_IT_IS:
        for each in called(function):
            found = digest(each)
            if _COMPILED_AS.setdefault(each, found) != found:
                _COMPILED_AS[each] = found
                backend.renew(each)
        _AS_IT_IS[key] = user_kernel(plain_function(function))
    return _AS_IT_IS[key]


_AS_IT_IS: dict[tuple[types.FunctionType, str], Callable] = {}
_COMPILED_AS: dict[Callable, str] = {}
