"""Lowering of `t[k]` and `x in t` for tuples of numbers."""

from __future__ import annotations

import operator
from collections.abc import Callable

from llvmlite import ir
from numba.core import types, typing

from physics.compiler.fused.folding_builder import KernelBuilder, make_struct, member_type


def _is_numbers(type_: types.Type) -> bool:
    """True for the type of a number, or of a tuple of numbers, possibly nested."""
    if isinstance(type_, types.BaseTuple):
        return all(map(_is_numbers, type_.types))
    return isinstance(type_, types.Number)


def _choose(context, builder, sig, args):
    """Lower `t[k]`, with k counted from the front; only under NUMBA_BOUNDSCHECK=1 a k out of range raises an error."""
    if not isinstance(builder, KernelBuilder):
        return NotImplemented
    chosen = context.get_value_type(sig.return_type)
    offered = [_words(builder, builder.extract_value(args[0], k)) for k in range(len(sig.args[0]))]
    ends = [builder.append_basic_block(f"choice_{k}") for k in range(len(offered))]
    no_member, end = builder.append_basic_block("no_member"), builder.append_basic_block("chosen")
    switch = builder.switch(args[1], no_member)
    builder.position_at_end(no_member)
    if context.enable_boundscheck:
        context.call_conv.return_user_exc(builder, IndexError, ("tuple index out of range",))
    else:
        builder.unreachable()
    for k, block in enumerate(ends):
        switch.add_case(args[1].type(k), block)
        builder.position_at_end(block)
        builder.branch(end)
    builder.position_at_end(end)
    words = []
    for each in zip(*offered, strict=True):
        words.append(builder.phi(each[0].type))
        for word, block in zip(each, ends, strict=True):
            words[-1].add_incoming(word, block)
    return _put_together(builder, chosen, iter(words))


def _contains(context, builder, sig, args):
    """Lower `x in t` for a number x and a tuple t of numbers."""
    members, number = sig.args
    found = context.get_constant(types.boolean, False)
    for k, type_ in enumerate(members):
        equal = context.get_function(operator.eq, typing.signature(types.boolean, number, type_))
        found = builder.or_(found, equal(builder, (args[1], builder.extract_value(args[0], k))))
    return found


def _words(builder, value) -> list:
    """List all numbers of a tuple, nested tuples included, in order, as LLVM values."""
    if not isinstance(value.type, ir.Aggregate):
        return [value]
    return [word for k in range(len(value.type)) for word in _words(builder, builder.extract_value(value, k))]


def _put_together(builder, type_: ir.Type, words):
    """Make a tuple of this LLVM type, possibly nested, from an iterator over its numbers."""
    if not isinstance(type_, ir.Aggregate):
        return next(words)
    return make_struct(
        builder, type_, [_put_together(builder, member_type(type_, k), words) for k in range(len(type_))]
    )


def lowering(key, sig: typing.Signature) -> Callable | None:
    """Return the function that lowers the operation `key` if it is `t[k]` or `x in t` for tuples of numbers."""
    if len(sig.args) != 2 or not isinstance(sig.args[0], types.UniTuple):
        return None
    members, other = sig.args
    if key is operator.getitem:
        return _choose if _is_numbers(members) and isinstance(other, types.Integer) else None
    are_numbers = isinstance(members.dtype, types.Number) and isinstance(other, types.Number)
    return _contains if key is operator.contains and are_numbers else None
