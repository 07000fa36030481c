"""Calls that are prepared in memory, made by a kernel, and their exceptions, raised in that kernel.

`prepared_entry` is the other end of such a call: the entry of the kernel that is called.
"""

from __future__ import annotations

from numba.core import types
from numba.core.callconv import excinfo_ptr_t
from numba.extending import intrinsic

from physics.compiler.fused.folding_builder import WORD, word_constant
from physics.compiler.fused.prepared_entry import ENTRY_TYPE, STATUS_TYPE, WORD_SIZE

# Columns of a table of prepared calls: addresses of a kernel's entry and of its arguments; status and exception of the
# last call.
JOB_ENTRY, JOB_ARGUMENTS, JOB_STATUS, JOB_EXCEPTION, JOB_SIZE = range(5)
JOB_BYTES = JOB_SIZE * WORD_SIZE


@intrinsic
def enter_prepared(typing_context, job):
    """Make the prepared call in the row of a table at the address `job`; return its status, not 0 after an exception.

    Status and exception are also written into the row.
    """

    def lower(context, builder, sig, args):
        row = builder.inttoptr(args[0], WORD.as_pointer())
        entry, arguments = (builder.load(builder.gep(row, [word_constant(k)])) for k in (JOB_ENTRY, JOB_ARGUMENTS))
        raised = builder.bitcast(builder.gep(row, [word_constant(JOB_EXCEPTION)]), ENTRY_TYPE.args[1])
        code = builder.call(
            builder.inttoptr(entry, ENTRY_TYPE.as_pointer()), [builder.inttoptr(arguments, ENTRY_TYPE.args[0]), raised]
        )
        code = builder.sext(code, WORD)
        builder.store(code, builder.gep(row, [word_constant(JOB_STATUS)]))
        return code

    return types.int64(types.int64), lower


@intrinsic
def raise_prepared(typing_context, code, raised):
    """Leave the calling kernel with the exception at the address `raised`, unless the status `code` is 0."""

    def lower(context, builder, sig, args):
        code, place = builder.trunc(args[0], STATUS_TYPE), context.call_conv._get_excinfo_argument(builder.function)
        with builder.if_then(builder.icmp_unsigned("!=", code, STATUS_TYPE(0))):
            builder.store(builder.inttoptr(args[1], excinfo_ptr_t), place)
            builder.ret(code)
        return context.get_dummy_value()

    return types.none(types.int64, types.int64), lower
