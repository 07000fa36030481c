"""Digest that identifies a version of a user's function, and its compiled form of that version."""

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

    The digest covers their code, and the numbers and functions that they read from around them, recursively. Of other
    modules that they name it covers the source.
    """
    found = hashlib.sha256()
    seen: set[int] = set()
    for function in functions:
        _feed(found, function, seen)
    return found.hexdigest()[:16]


def _feed(found, value, seen: set[int]) -> None:
    """Add a value that a function reads to a digest."""
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
    """A compiled function and all functions that it names, recursively; functions of modules are left out."""
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
    """Function without machine code from before an edit of the globals that it reads.

    Numba reads the numbers and functions around a function when it compiles it, and never again.
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
