"""Atomic operations on tables of int64 that threads share without a lock, as instructions of the processor."""

from __future__ import annotations

import platform

from llvmlite import ir
from numba.core import types
from numba.extending import intrinsic

from physics.compiler.fused.array_elements import element_pointer
from physics.compiler.fused.folding_builder import WORD, word_constant
from physics.compiler.fused.prepared_entry import WORD_SIZE

# LLVM's name and arguments of the instruction for a short wait in a loop, on processors that have one.
_PAUSES = {
    "x86_64": ("llvm.x86.sse2.pause", ()), "AMD64": ("llvm.x86.sse2.pause", ()),
    "aarch64": ("llvm.aarch64.hint", (1,)), "arm64": ("llvm.aarch64.hint", (1,)),
}  # fmt: skip


def _pointer(context, builder, sig, args):
    """Pointer to the element table[row, column], where `args` begins with table, row and column."""
    return element_pointer(context, builder, sig.args[0], args[0], sig.args[1:3], args[1:3])


def _word(context, builder, sig, args, k):
    return context.cast(builder, args[k], sig.args[k], types.int64)


def _changed_by(operation: str):
    """Make the lowering of an atomic change of an element by a number; the change returns the old value.

    `operation` is LLVM's name of the change, such as ``add``.
    """

    def lower(context, builder, sig, args):
        number = _word(context, builder, sig, args, 3)
        return builder.atomic_rmw(operation, _pointer(context, builder, sig, args), number, "seq_cst")

    return lower


@intrinsic
def atomic_add(typing_context, table, row, column, number):
    """Add `number` to table[row, column] atomically; return the old value."""
    return types.int64(table, row, column, number), _changed_by("add")


@intrinsic
def atomic_exchange(typing_context, table, row, column, number):
    """Set table[row, column] to `number` atomically; return the old value."""
    return types.int64(table, row, column, number), _changed_by("xchg")


@intrinsic
def compare_exchange(typing_context, table, row, column, expected, number):
    """Set table[row, column] to `number` if it equals `expected`, atomically; return whether it did."""

    def lower(context, builder, sig, args):
        expected, number = (_word(context, builder, sig, args, k) for k in (3, 4))
        place = _pointer(context, builder, sig, args)
        return builder.extract_value(builder.cmpxchg(place, expected, number, "seq_cst"), 1)

    return types.boolean(table, row, column, expected, number), lower


@intrinsic
def atomic_load(typing_context, table, row, column):
    """Read table[row, column] atomically: the value last written by any thread."""

    def lower(context, builder, sig, args):
        return builder.load_atomic(_pointer(context, builder, sig, args), "acquire", WORD_SIZE)

    return types.int64(table, row, column), lower


@intrinsic
def spin_pause(typing_context):
    """Pause the processor for a moment, in a loop that waits for another thread."""

    def lower(context, builder, sig, args):
        if platform.machine() in _PAUSES:
            name, numbers = _PAUSES[platform.machine()]
            numbers = [ir.Constant(ir.IntType(32), number) for number in numbers]
            function_type = ir.FunctionType(ir.VoidType(), [number.type for number in numbers])
            builder.call(builder.module.declare_intrinsic(name, (), function_type), numbers)
        return context.get_dummy_value()

    return types.none(), lower


@intrinsic
def call_address(typing_context, address):
    """Call the system function at an address, without arguments; return its result, or -1 if the address is 0."""

    def lower(context, builder, sig, args):
        function, before = ir.FunctionType(ir.IntType(32), []).as_pointer(), builder.basic_block
        with builder.if_then(builder.icmp_signed("!=", args[0], word_constant(0))):
            answer = builder.sext(builder.call(builder.inttoptr(args[0], function), []), WORD)
            asking = builder.basic_block
        result = builder.phi(WORD)
        result.add_incoming(word_constant(-1), before)
        result.add_incoming(answer, asking)
        return result

    return types.int64(types.int64), lower
