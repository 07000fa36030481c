"""Calls of kernels: a status that is not 0 is returned at once, since no kernel catches an exception.

Numba tells five kinds of status apart after each call, and asks for the message of an exception.
"""

from __future__ import annotations

from numba.core.callconv import CPUCallConv

from physics.compiler.fused.folding_builder import stack_slot


def call_kernel(context, builder, about, args):
    """Result of a call; an exception passes through.

    Parameters
    ----------
    context : numba.core.base.BaseContext
    builder : llvmlite.ir.IRBuilder
    about : numba.core.funcdesc.FunctionDescriptor
        Of the kernel that is called.
    args : sequence of llvmlite.ir.Value
    """
    convention, function = context.call_conv, context.declare_function(builder.module, about)
    words = context.get_arg_packer(about.argtypes).as_arguments(builder, args)
    result = stack_slot(builder, convention.get_return_type(about.restype).pointee)
    raised = convention._get_excinfo_argument(builder.function)
    status = builder.call(function, [result, raised, *words])
    with builder.if_then(builder.icmp_unsigned("!=", status, status.type(0))):
        builder.ret(status)
    return context.get_returned_value(builder, about.restype, builder.load(result))


class KernelCallConv(CPUCallConv):
    """Numba's convention; an exception of a user's function names the statement that raises it."""

    def return_user_exc(self, builder, exc, exc_args=None, loc=None, func_name=None):
        """Leave a function with an exception; its default place is the user's present statement."""
        if loc is None:
            loc, func_name = getattr(builder, "place", (None, func_name))
        super().return_user_exc(builder, exc, exc_args, loc, func_name)
