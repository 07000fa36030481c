"""Lowering of `max`, `min`, `int` and powers of numbers in place; Numba compiles a function for each signature."""

from __future__ import annotations

import operator
from collections.abc import Callable

from numba.core import types, typing
from numba.cpython.builtins import do_minmax

from physics.compiler.fused.folding_builder import known_integer


def _maximum(context, builder, sig, args):
    """Lower `max` of numbers: a later number replaces an earlier one if it is larger, so that a NaN in front stays."""
    return do_minmax(context, builder, sig.args, args, operator.gt)


def _minimum(context, builder, sig, args):
    return do_minmax(context, builder, sig.args, args, operator.lt)


def _to_integer(context, builder, sig, args):
    """Lower `int(x)`, which rounds towards zero."""
    return context.cast(builder, args[0], sig.args[0], sig.return_type)


def _power(context, builder, sig, args):
    """Lower `x ** n` for a constant n > 0 to the products that Numba's loop would make, in the same order."""
    base, exponent = args[0], known_integer(args[1])
    if not exponent or exponent < 0:
        return NotImplemented
    result = None
    while exponent:
        if exponent & 1:
            result = base if result is None else builder.fmul(result, base)
        exponent >>= 1
        base = builder.fmul(base, base) if exponent else base
    return result


_SCALAR_FUNCTIONS = {max: _maximum, min: _minimum, int: _to_integer}


def _are_numbers(args) -> bool:
    return all(isinstance(each, (types.Integer, types.Float)) for each in args)


def signature(key, context, args) -> typing.Signature | None:
    """Signature of the operation `key` for types `args` if it is `max`, `min` or `int` of numbers, else None."""
    if key not in _SCALAR_FUNCTIONS or (len(args) == 1) != (key is int):
        return None
    args = tuple(map(types.unliteral, args))
    if not _are_numbers(args):
        return None
    if key is int:
        return typing.signature(args[0] if isinstance(args[0], types.Integer) else types.intp, *args)
    return typing.signature(context.unify_types(*args), *args)


def lowering(key, sig: typing.Signature) -> Callable | None:
    """Return the function that lowers the operation `key` if it is one of this module, else None."""
    if key in _SCALAR_FUNCTIONS and _are_numbers(sig.args):
        return _SCALAR_FUNCTIONS[key]
    if key is operator.pow and isinstance(sig.args[0], types.Float) and isinstance(sig.args[1], types.Integer):
        return _power
    return None
