"""Atomic changes and reads of an array that threads share without a lock, as instructions of the processor."""

from __future__ import annotations

import platform

from llvmlite import ir
from numba.core import types
from numba.extending import intrinsic

from physics.compiler.fused.array_elements import element_pointer
from physics.compiler.fused.folding_builder import WORD, word_constant
from physics.compiler.fused.prepared_entry import WORD_SIZE

# What a processor is told that waits for another one, where there is such an instruction.
_PAUSES = {
    "x86_64": ("llvm.x86.sse2.pause", ()), "AMD64": ("llvm.x86.sse2.pause", ()),
    "aarch64": ("llvm.aarch64.hint", (1,)), "arm64": ("llvm.aarch64.hint", (1,)),
}  # fmt: skip


def _pointer(context, builder, sig, args):
    """Pointer to table[row, column], from the first three arguments."""
    return element_pointer(context, builder, sig.args[0], args[0], sig.args[1:3], args[1:3])


def _word(context, builder, sig, args, k):
    return context.cast(builder, args[k], sig.args[k], types.int64)


def _changed_by(operation: str):
    """Return the lowering of a change by a number, which returns the old value of the element."""

    def lower(context, builder, sig, args):
        number = _word(context, builder, sig, args, 3)
        return builder.atomic_rmw(operation, _pointer(context, builder, sig, args), number, "seq_cst")

    return lower


@intrinsic
def atomic_add(typing_context, table, row, column, number):
    """table[row, column] += number; returns the old value."""
    return types.int64(table, row, column, number), _changed_by("add")


@intrinsic
def atomic_exchange(typing_context, table, row, column, number):
    """table[row, column] = number; returns the old value."""
    return types.int64(table, row, column, number), _changed_by("xchg")


@intrinsic
def compare_exchange(typing_context, table, row, column, expected, number):
    """table[row, column] = number if it equals `expected`; returns whether it did."""

    def lower(context, builder, sig, args):
        expected, number = (_word(context, builder, sig, args, k) for k in (3, 4))
        place = _pointer(context, builder, sig, args)
        return builder.extract_value(builder.cmpxchg(place, expected, number, "seq_cst"), 1)

    return types.boolean(table, row, column, expected, number), lower


@intrinsic
def atomic_load(typing_context, table, row, column):
    """table[row, column] as it is now."""

    def lower(context, builder, sig, args):
        return builder.load_atomic(_pointer(context, builder, sig, args), "acquire", WORD_SIZE)

    return types.int64(table, row, column), lower


@intrinsic
def spin_pause(typing_context):
    """Wait for a moment."""

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
    """Call the system's function at the address, without arguments, and return its result; -1 if the address is 0."""

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
