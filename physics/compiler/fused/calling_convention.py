"""Calling convention between kernels: a function returns its value instead of a status.

A function compiled by Numba writes its result to an address that its caller passes, and returns a status. The caller
reads the status, passes an exception on, and reads the result. Kernels raise no exceptions; only users' functions may.
So here a part returns its value. A part that may raise is lowered again in Numba's convention, and so are its callers,
which pass the exception on.
"""

from __future__ import annotations

from llvmlite import ir
from numba.core import cgutils
from numba.core.callconv import RETCODE_OK, CPUCallConv, excinfo_ptr_t
from numba.core.funcdesc import PythonFunctionDescriptor

from physics.compiler.fused.folding_builder import stack_slot


class MayRaise(Exception):
    """Error while lowering a function that should return its value, but may raise an exception or return None."""


def returns_value(function) -> bool:
    """True if an LLVM function, or a descriptor of one, returns its value instead of a status."""
    return getattr(function, "returns_value", False)


class ValueDescriptor(PythonFunctionDescriptor):
    """Numba's descriptor of a compiled function, for one that returns its value instead of a status."""

    __slots__ = ()
    returns_value = True


def declare_value_function(context, module: ir.Module, about) -> ir.Function:
    """Declare a function that returns its value, in an LLVM module that defines or calls it; return the declaration.

    Parameters
    ----------
    context : numba.core.base.BaseContext
        Target context.
    module : llvmlite.ir.Module
        Module of the declaration.
    about : ValueDescriptor
        Name and types of the function.
    """
    packer = context.get_arg_packer(about.argtypes)
    result = context.data_model_manager[about.restype].get_return_type()
    function = cgutils.get_or_insert_function(
        module, ir.FunctionType(result, packer.argument_types), about.mangled_name
    )  # fmt: skip
    packer.assign_names(function.args, [f"arg.{name}" for name in about.args])
    if about.inline:
        function.attributes.add("alwaysinline")
    function.returns_value = True
    return function


def call_value_function(context, builder, about, args):
    """Write a call of the function that `about` describes; return its result as an LLVM value.

    An exception of the function leaves the calling function, too, since no kernel catches one.
    """
    words = context.get_arg_packer(about.argtypes).as_arguments(builder, args)
    if returns_value(about):
        result = builder.call(declare_value_function(context, builder.module, about), words)
        return context.get_returned_value(builder, about.restype, result)
    convention, function = context.call_conv, context.declare_function(builder.module, about)
    result = stack_slot(builder, convention.get_return_type(about.restype).pointee)
    convention.must_give_status(builder)
    raised = convention._get_excinfo_argument(builder.function)
    status = builder.call(function, [result, raised, *words])
    with builder.if_then(builder.icmp_unsigned("!=", status, status.type(0))):
        builder.ret(status)
    return context.get_returned_value(builder, about.restype, builder.load(result))


class ValueCallConv(CPUCallConv):
    """Calling convention with both kinds of function: those that return a status, as Numba's, or their value."""

    def must_give_status(self, builder: ir.IRBuilder) -> None:
        """Raise MayRaise if the function that `builder` writes returns its value, and so cannot report an exception."""
        if returns_value(builder.function):
            raise MayRaise(builder.function.name)

    def get_arguments(self, func):
        """Arguments of a kernel in its LLVM function, without Numba's two in front for result and exception."""
        return func.args if returns_value(func) else super().get_arguments(func)

    def return_value(self, builder, retval):
        """Write the instructions that return `retval` from the function that `builder` writes."""
        if returns_value(builder.function):
            builder.ret(retval)
        else:
            super().return_value(builder, retval)

    def return_user_exc(self, builder, exc, exc_args=None, loc=None, func_name=None):
        """Write the instructions that leave a function with the exception `exc`.

        By default the exception names the line of the user's present statement.
        """
        self.must_give_status(builder)
        if loc is None:
            loc, func_name = getattr(builder, "place", (None, func_name))
        super().return_user_exc(builder, exc, exc_args, loc, func_name)

    def return_dynamic_user_exc(self, builder, *about, **more):
        """Write the instructions that leave a function with an exception whose arguments are computed at run time."""
        self.must_give_status(builder)
        super().return_dynamic_user_exc(builder, *about, **more)

    def return_status_propagate(self, builder, status):
        """Write the instructions that leave a function if `status` says that a function it called raised an error."""
        if status.code is not RETCODE_OK:
            self.must_give_status(builder)
            super().return_status_propagate(builder, status)

    def _return_errcode_raw(self, builder, code):
        self.must_give_status(builder)
        super()._return_errcode_raw(builder, code)

    def call_function(self, builder, callee, resty, argtys, args, attrs=None):
        """Write a call for Numba's lowering, which expects a status and a result; return both."""
        if not returns_value(callee):
            return super().call_function(builder, callee, resty, argtys, args, attrs)
        words = self.context.get_arg_packer(argtys).as_arguments(builder, args)
        result = self.context.get_returned_value(builder, resty, builder.call(callee, words))
        no_exception = cgutils.get_null_value(excinfo_ptr_t)
        return self._get_return_status(builder, RETCODE_OK, no_exception), result
