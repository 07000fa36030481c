"""Numba's passes over a kernel before lowering, without those that kernels do not need.

Numba's own pipeline looks for closures, comprehensions, `with`, `raise`, array expressions and functions inlined by
it, none of which a kernel has, and determines after most passes which variable lives where, which nobody asks for
where no variable has to be released (`physics.compiler.fused.lowering`). A kernel that does have one of them
fails to compile. What users write goes through Numba's own pipeline.
"""

from __future__ import annotations

from functools import cache

from numba.core.compiler import DefaultPassBuilder
from numba.core.compiler_machinery import FunctionPass, PassManager, _pass_registry, register_pass
from numba.core.interpreter import Interpreter, peep_hole_list_to_tuple
from numba.core.ir_utils import build_definitions
from numba.core.rewrites import rewrite_registry
from numba.core.ssa import reconstruct_ssa
from numba.core.typed_passes import (
    AnnotateTypes,
    NativeLowering,
    NoPythonBackend,
    NopythonTypeInference,
    PreLowerStripPhis,
)
from numba.core.untyped_passes import DeadBranchPrune, FixupArgs, RewriteSemanticConstants

from physics.compiler.fused.ablation import is_on
from physics.compiler.fused.type_inference import infer_types


class _Plain(FunctionPass):
    """A pass that is one function of the state."""

    def __init__(self):
        super().__init__()

    def run_pass(self, state):
        self.change(state)
        return True


class _Interpreter(Interpreter):
    """Pass from byte code to Numba's own code, with only those corrections that calls with `*` need."""

    def post_process(self, peepholes, func_ir):
        """Leave out corrections for `with`, `try`, dictionaries, and calls with many keywords."""
        return super().post_process([peep_hole_list_to_tuple], func_ir)


@register_pass(mutates_CFG=True, analysis_only=False)
class _FromByteCode(_Plain):
    """Pass that makes Numba's own code of a function."""

    _name = "kernel_from_byte_code"

    def change(self, state):
        state.func_ir = _Interpreter(state.func_id).interpret(state.bc)


@register_pass(mutates_CFG=True, analysis_only=False)
class _Rewrites(_Plain):
    """Numba's rewrites before inference, such as that of a constant subscript."""

    _name = "kernel_rewrites"

    def change(self, state):
        blocks = state.func_ir.blocks
        for make in rewrite_registry.rewrites["before-inference"]:
            rewrite = make(state)
            for label in list(blocks):
                while rewrite.match(state.func_ir, blocks[label], state.typemap, state.calltypes):
                    blocks[label] = rewrite.apply()


@register_pass(mutates_CFG=True, analysis_only=False)
class _SingleAssignment(_Plain):
    """Pass after which each variable is assigned once."""

    _name = "kernel_single_assignment"

    def change(self, state):
        state.func_ir = reconstruct_ssa(state.func_ir)
        state.func_ir._definitions = build_definitions(state.func_ir.blocks)


@register_pass(mutates_CFG=False, analysis_only=False)
class _Types(_Plain):
    """Pass that finds types of variables and targets of calls."""

    _name = "kernel_types"

    def change(self, state):
        infer_types(state)


@register_pass(mutates_CFG=True, analysis_only=False)
class _NoPhis(PreLowerStripPhis):
    """Pass that replaces phi nodes by assignments at the ends of the joining branches."""

    _name = "kernel_no_phis"

    def run_pass(self, state):
        state.func_ir = self._strip_phi_nodes(state.func_ir)
        state.func_ir._definitions = build_definitions(state.func_ir.blocks)
        return True


_TYPING_PASSES = (
    _FromByteCode,
    FixupArgs,
    RewriteSemanticConstants,
    DeadBranchPrune,
    _Rewrites,
    _SingleAssignment,
    DeadBranchPrune,
    _Types,
    _NoPhis,
    AnnotateTypes,
)


class KernelPasses(PassManager):
    """Sequence of a kernel's passes; errors keep the words of the pass that raises them.

    Parameters
    ----------
    at_last : type
        The lowering to LLVM, and what follows it.
    """

    def __init__(self, *at_last: type):
        super().__init__("nopython")
        for each in (*_TYPING_PASSES, *at_last):
            self.add_pass(each, each.__name__)
        self.finalize()

    def run(self, state):
        """Run pass after pass, without Numba's list of all types between them."""
        for each, _ in self.passes:
            one = _pass_registry.get(each).pass_inst
            one.analysis = self._analysis
            one.run_pass(state)


def numbas_passes(state, own: dict[type, type], *after_lowering: type) -> PassManager:
    """Numba's own pipeline, with some passes replaced by ours.

    Parameters
    ----------
    state : numba.core.compiler.StateDict
    own : dict
        Passes of ours by those of Numba; one for `NativeLowering` is among them.
    *after_lowering : type
        Passes that follow the lowering.
    """
    pipeline = DefaultPassBuilder.define_nopython_pipeline(state)
    pipeline.passes = [(own.get(each, each), about) for each, about in pipeline.passes]
    for each in after_lowering:
        pipeline.add_pass_after(each, own[NativeLowering])
    pipeline.finalize()
    return pipeline


@cache
def _own_passes(*at_last: type) -> KernelPasses:
    return KernelPasses(*at_last)


def kernel_passes(state, lowering: type, *after_lowering: type) -> PassManager:
    """Passes of a kernel.

    Parameters
    ----------
    state : numba.core.compiler.StateDict
    lowering : type
        The lowering to LLVM.
    *after_lowering : type
        Passes that follow it.
    """
    if is_on("passes"):
        return _own_passes(lowering, *after_lowering, NoPythonBackend)
    return numbas_passes(state, {NativeLowering: lowering, NopythonTypeInference: _Types}, *after_lowering)
