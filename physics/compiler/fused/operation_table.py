"""Table of operations that replaces Numba's: types of results, and lowerings.

Numba tries a dozen templates for `a[i]`, and then writes many times the necessary code. Each module here knows some
operations; all others are left to Numba.
"""

from __future__ import annotations

from collections.abc import Callable

from numba.core import types, typing

from physics.compiler.fused import array_elements, ranges, scalars, simd_types, tuples
from physics.compiler.fused.ablation import is_on

_LOWERING = (
    *((array_elements,) if is_on("array_elements") else ()),
    *((ranges,) if is_on("ranges") else ()),
    tuples,
    *((scalars,) if is_on("scalars") else ()),
    simd_types,
)
_TYPING = tuple(module for module in _LOWERING if hasattr(module, "signature"))


def signature_of(function: types.Function, context: typing.Context, args: tuple) -> typing.Signature | None:
    """Signature of `function` for types of arguments, or None to leave it to Numba.

    Parameters
    ----------
    function : types.Function
    context : typing.Context
    args : tuple of types.Type
    """
    key = function.typing_key
    for module in _TYPING:
        found = module.signature(key, context, args)
        if found is not None:
            return found
    return None


def lowering_of(function, sig: typing.Signature) -> Callable | None:
    """Return the function that lowers `function` for a signature, or None to leave it to Numba.

    Parameters
    ----------
    function : types.Function or str
    sig : typing.Signature

    Returns
    -------
    Callable, optional
        Of a context, a builder, the signature and the values of the arguments; what it returns is NotImplemented where
        Numba's way is taken after all.
    """
    key = function if isinstance(function, str) else getattr(function, "typing_key", None)
    for module in _LOWERING:
        found = module.lowering(key, sig)
        if found is not None:
            return found
    return None
