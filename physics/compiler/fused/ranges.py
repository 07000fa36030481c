"""Lowering of loops over `range` to few instructions: Numba's lowering tests each range for a step of zero."""

from __future__ import annotations

from collections.abc import Callable

from numba.core import types, typing

from physics.compiler.fused.folding_builder import (
    NO_SIGNED_WRAP,
    WORD,
    known_integer,
    make_struct,
    stack_slot,
    word_constant,
)


def _count(context, builder, sig, args):
    """Lower `range(stop)`, `range(start, stop)` or `range(start, stop, step)`: start, stop and step as a structure."""
    start, stop, step = (
        (word_constant(0), args[0], word_constant(1)) if len(args) == 1 else (*args, word_constant(1))[:3]
    )
    return make_struct(builder, context.get_value_type(sig.return_type), [start, stop, step])


def _iterate(context, builder, sig, args):
    """Lower the start of a loop over a range: make its iterator.

    The iterator has the address of the next number, the end, the step, and the address of the remaining count.
    """
    start, stop, step = (builder.extract_value(args[0], k) for k in range(3))
    stride = known_integer(step)
    if not stride:
        return NotImplemented
    members = stack_slot(builder, WORD), stop, step, stack_slot(builder, WORD)
    builder.store(start, members[0])
    left = builder.sub(stop, start) if stride > 0 else builder.sub(start, stop)  # negative for an empty range
    if abs(stride) > 1:
        left = builder.sdiv(builder.add(left, word_constant(abs(stride) - 1)), word_constant(abs(stride)))
    builder.store(left, members[3])
    return make_struct(builder, context.get_value_type(sig.return_type), members)


def _advance(context, builder, sig, args):
    """Lower the step of a loop over a range: the pair of the next number and whether it is valid."""
    following, step, left = (builder.extract_value(args[0], k) for k in (0, 2, 3))
    number, left_before = builder.load(following), builder.load(left)
    builder.store(builder.add(number, step, flags=NO_SIGNED_WRAP), following)
    builder.store(builder.sub(left_before, word_constant(1), flags=NO_SIGNED_WRAP), left)
    valid = builder.icmp_signed(">", left_before, word_constant(0))
    return make_struct(builder, context.get_value_type(sig.return_type), [number, valid])


def lowering(key, sig: typing.Signature) -> Callable | None:
    """Return the function that lowers the operation `key` if it is one on ranges of 64-bit words, else None."""
    if key is range:
        return _count if sig.return_type == types.range_state64_type else None
    if key == "getiter":
        return _iterate if sig.args == (types.range_state64_type,) else None
    if key == "iternext":
        return _advance if sig.args == (types.range_iter64_type,) else None
    return None
