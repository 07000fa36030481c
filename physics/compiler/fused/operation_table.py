"""Table of operations whose types and lowerings replace Numba's.

Numba tries a dozen templates for `a[i]`, and then writes several times the necessary instructions. The modules of the
table have signatures and lowerings for some operations; all others are left to Numba.
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
    """Signature of a call of a built-in function for these types of arguments; None if Numba must find it.

    Parameters
    ----------
    function : types.Function
        Numba's type of the function, such as that of `operator.getitem`.
    context : typing.Context
        Typing context.
    args : tuple of types.Type
        Types of the arguments.
    """
    key = function.typing_key
    for module in _TYPING:
        found = module.signature(key, context, args)
        if found is not None:
            return found
    return None


def lowering_of(function, sig: typing.Signature) -> Callable | None:
    """Find the function that lowers calls of a built-in function for a signature; None if Numba must lower them.

    Parameters
    ----------
    function : types.Function or str
        Numba's type of the function, or Numba's name of an operation such as "getiter".
    sig : typing.Signature
        Types of the result and of the arguments.

    Returns
    -------
    Callable, optional
        Takes a target context, a builder, the signature and the LLVM values of the arguments, and returns the LLVM
        value of the result; or NotImplemented, if Numba must lower the call.
    """
    key = function if isinstance(function, str) else getattr(function, "typing_key", None)
    for module in _LOWERING:
        found = module.lowering(key, sig)
        if found is not None:
            return found
    return None
