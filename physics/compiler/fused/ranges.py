"""Counting loops in as few instructions as possible; Numba tests each range for a step of zero."""

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
    """`range(stop)`, `range(start, stop)` or `range(start, stop, step)`."""
    start, stop, step = (
        (word_constant(0), args[0], word_constant(1)) if len(args) == 1 else (*args, word_constant(1))[:3]
    )
    return make_struct(builder, context.get_value_type(sig.return_type), [start, stop, step])


def _iterate(context, builder, sig, args):
    """Make an iterator over a range: places of its next number and of the remaining count, its end, its step."""
    start, stop, step = (builder.extract_value(args[0], k) for k in range(3))
    stride = known_integer(step)
    if not stride:
        return NotImplemented
    members = stack_slot(builder, WORD), stop, step, stack_slot(builder, WORD)
    builder.store(start, members[0])
    left = builder.sub(stop, start) if stride > 0 else builder.sub(start, stop)  # none is left if it is negative
    if abs(stride) > 1:
        left = builder.sdiv(builder.add(left, word_constant(abs(stride) - 1)), word_constant(abs(stride)))
    builder.store(left, members[3])
    return make_struct(builder, context.get_value_type(sig.return_type), members)


def _advance(context, builder, sig, args):
    """Next number, and whether there is one."""
    following, step, left = (builder.extract_value(args[0], k) for k in (0, 2, 3))
    number, left_before = builder.load(following), builder.load(left)
    builder.store(builder.add(number, step, flags=NO_SIGNED_WRAP), following)
    builder.store(builder.sub(left_before, word_constant(1), flags=NO_SIGNED_WRAP), left)
    valid = builder.icmp_signed(">", left_before, word_constant(0))
    return make_struct(builder, context.get_value_type(sig.return_type), [number, valid])


def lowering(key, sig: typing.Signature) -> Callable | None:
    """Return the function that lowers a range of words, the start of a loop over it, or its next number."""
    if key is range:
        return _count if sig.return_type == types.range_state64_type else None
    if key == "getiter":
        return _iterate if sig.args == (types.range_state64_type,) else None
    if key == "iternext":
        return _advance if sig.args == (types.range_iter64_type,) else None
    return None
