"""Lowering of a kernel's statements to LLVM IR, without Numba's reference counts.

Kernels own no memory (`physics.compiler.decorators`), so no variable must be released. Numba's lowering reads the old
value of a variable before each assignment, and reads and clears it at the end of its life; for an array these are seven
words. A third of all instructions would only do this.

In single assignment form a variable that is assigned once can be an LLVM value without memory, since its assignment
comes before each use. Numba makes it such a value only if it is used in a single block. Here it always is one.
"""

from __future__ import annotations

from collections import Counter

from numba.core import ir
from numba.core.compiler_machinery import register_pass
from numba.core.lowering import Lower
from numba.core.typed_passes import NativeLowering

from physics.compiler.fused.ablation import is_on
from physics.compiler.fused.calling_convention import MayRaise, ValueDescriptor
from physics.compiler.fused.folding_builder import kernel_builder, stack_slot
from physics.compiler.fused.prepared_entry import write_prepared_entry


class _Values(Lower):
    """Numba's lowering of a function, but without stack slots for variables assigned once, and without releases."""

    def _find_singly_assigned_variable(self):
        times = Counter(
            each.target.name for block in self.blocks.values() for each in block.body if isinstance(each, ir.Assign)
        )
        self._singly_assigned_vars = {name for name, count in times.items() if count == 1}
        self._blk_local_varmap = {}

    def loadvar(self, name):
        """LLVM value of the variable `name`."""
        value = self._blk_local_varmap.get(name)
        if value is not None:
            return value
        # this block, which uses the variable, is lowered before the block that assigns it
        self._singly_assigned_vars.discard(name)
        return self.builder.load(self.getvar(name))

    def alloca_lltype(self, name, lltype, datamodel=None):
        """Reserve memory for the variable `name`, which is assigned more than once; return its address."""
        return stack_slot(self.builder, lltype)

    def storevar(self, value, name, argidx=None):
        """Assign an LLVM value to the variable `name`."""
        if name in self._singly_assigned_vars:
            self._blk_local_varmap[name] = value
        else:
            self.builder.store(value, self.getvar(name))

    def delvar(self, name):
        """Ignore the end of a variable's life: kernels count no references."""


class _KernelLower(_Values if is_on("lowering") else Lower):
    """Lowering of a kernel with `kernel_builder`, and with a prepared entry for machine code."""

    def setup_function(self, fndesc):
        """Declare the function, and make the builder of its body."""
        super().setup_function(fndesc)
        self.builder = kernel_builder(self.entry_block)
        self.call_helper = self.call_conv.init_call_helper(self.builder)
        if is_on("cold_kernels") and getattr(self.func_ir.func_id.func, "is_cold", False):  # `decorators.cold_kernel`
            self.function.attributes.add("noinline")

    def create_cfunc_wrapper(self):
        """Write the prepared entry (`prepared_entry`) instead of Numba's wrapper for C."""
        write_prepared_entry(self.context, self.library, self.fndesc)

    def lower_block(self, block):
        """Lower the statements of a block; the error of an unsupported statement is raised unchanged."""
        self._cur_ir_block = block
        for each in block.body:
            self.loc = each.loc
            if isinstance(each, ir.Assign):
                name = each.target.name
                self.storevar(self.lower_assign(self.typeof(name), each), name)
            else:
                self.lower_inst(each)

    if is_on("scalars"):

        def lower_binop(self, resty, expr, op):
            """Lower an operation on two values; a constant among them reaches `scalars` as a constant."""
            context, builder = self.context, self.builder
            function = context.typing_context.resolve_value_type(op)
            sig = function.get_call_type(context.typing_context, self.fndesc.calltypes[expr].args, {})
            operands = [
                context.cast(builder, self.loadvar(each.name), self.typeof(each.name), type_)
                for each, type_ in zip((expr.lhs, expr.rhs), sig.args, strict=True)
            ]
            value = context.get_function(function, sig)(builder, operands)
            return context.cast(builder, value, sig.return_type, resty)


class _ValueLower(_KernelLower):
    """Lowering of a function that returns its value instead of a status."""

    def setup_function(self, fndesc):
        """Declare the function as one that returns its value."""
        fndesc.__class__ = ValueDescriptor
        super().setup_function(fndesc)


class _UserLower(Lower):
    """Lowering of a user's function, which notes the present statement for the lines of exceptions."""

    def lower_inst(self, inst):
        """Lower a statement, and note its line."""
        self.builder.place = self.loc, self.func_ir.func_id.func_name
        super().lower_inst(inst)


@register_pass(mutates_CFG=True, analysis_only=False)
class UserLowering(NativeLowering):
    """Pass that lowers a user's function to LLVM IR; an exception that the function raises names its line."""

    _name = "users_lowering"
    lowering_class = _UserLower


@register_pass(mutates_CFG=True, analysis_only=False)
class WholeLowering(NativeLowering):
    """Pass that lowers a kernel to LLVM IR, for calls from Python; it returns a status."""

    _name = "whole_lowering"
    lowering_class = _KernelLower


@register_pass(mutates_CFG=True, analysis_only=False)
class PartLowering(WholeLowering):
    """Pass that lowers a kernel to LLVM IR, for calls from other kernels; it returns its value if it cannot raise."""

    _name = "part_lowering"
    lowering_class = _ValueLower

    def run_pass(self, state):
        """Lower a kernel to a function that returns its value, or a status if it may raise an exception.

        With checked indices all kernels return a status.
        """
        if is_on("calling_convention") and not state.targetctx.enable_boundscheck:
            try:
                return super().run_pass(state)
            except MayRaise:
                pass
        return WholeLowering.run_pass(_WITH_STATUS, state)


_WITH_STATUS = WholeLowering()
