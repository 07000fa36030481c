"""Calling convention between kernels: arguments by value, and a return value in place of a status.

A function compiled by Numba writes its result to a place of its caller, and returns a status. The caller reads the
status, passes an exception on, and reads the result. Kernels raise no exceptions; only functions of users may. Here a
part returns its value. A part that may raise is lowered again in Numba's way, and so are its callers, so that the
exception gets through.
"""

from __future__ import annotations

from llvmlite import ir
from numba.core import cgutils
from numba.core.callconv import RETCODE_OK, CPUCallConv, excinfo_ptr_t
from numba.core.funcdesc import PythonFunctionDescriptor

from physics.compiler.fused.folding_builder import stack_slot


class MayRaise(Exception):
    """Error of a kernel that should return its value, but may raise an exception, or return None for a number."""


def returns_value(function) -> bool:
    """True if a function, or its descriptor, returns its value instead of a status."""
    return getattr(function, "returns_value", False)


class ValueDescriptor(PythonFunctionDescriptor):
    """Descriptor of a function that returns its value."""

    __slots__ = ()
    returns_value = True


def declare_value_function(context, module: ir.Module, about) -> ir.Function:
    """Declare a function that returns its value, in a module that defines or calls it.

    Parameters
    ----------
    context : numba.core.base.BaseContext
    module : llvmlite.ir.Module
    about : ValueDescriptor
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
    """Result of a call; an exception passes through, since no kernel catches one."""
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
    """Numba's convention, and the one of functions that return their value."""

    def must_give_status(self, builder: ir.IRBuilder) -> None:
        """Raise MayRaise if the function under construction returns its value."""
        if returns_value(builder.function):
            raise MayRaise(builder.function.name)

    def get_arguments(self, func):
        """Return the kernel's own arguments among a function's arguments."""
        return func.args if returns_value(func) else super().get_arguments(func)

    def return_value(self, builder, retval):
        """Leave a function with a value."""
        if returns_value(builder.function):
            builder.ret(retval)
        else:
            super().return_value(builder, retval)

    def return_user_exc(self, builder, exc, exc_args=None, loc=None, func_name=None):
        """Leave a function with an exception; its default place is the user's present statement."""
        self.must_give_status(builder)
        if loc is None:
            loc, func_name = getattr(builder, "place", (None, func_name))
        super().return_user_exc(builder, exc, exc_args, loc, func_name)

    def return_dynamic_user_exc(self, builder, *about, **more):
        """Leave a function with an exception whose arguments are computed."""
        self.must_give_status(builder)
        super().return_dynamic_user_exc(builder, *about, **more)

    def return_status_propagate(self, builder, status):
        """Leave a function with the exception of a call, if it raised one."""
        if status.code is not RETCODE_OK:
            self.must_give_status(builder)
            super().return_status_propagate(builder, status)

    def _return_errcode_raw(self, builder, code):
        self.must_give_status(builder)
        super()._return_errcode_raw(builder, code)

    def call_function(self, builder, callee, resty, argtys, args, attrs=None):
        """Status and result of a call by Numba's lowering."""
        if not returns_value(callee):
            return super().call_function(builder, callee, resty, argtys, args, attrs)
        words = self.context.get_arg_packer(argtys).as_arguments(builder, args)
        result = self.context.get_returned_value(builder, resty, builder.call(callee, words))
        no_exception = cgutils.get_null_value(excinfo_ptr_t)
        return self._get_return_status(builder, RETCODE_OK, no_exception), result
