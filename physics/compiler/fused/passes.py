"""Passes of the compilation of a kernel: Numba's, without those that kernels do not need.

Numba's own passes look for closures, comprehensions, `with`, `raise`, array expressions and functions that Numba
inlines; kernels have none of them, and a kernel that does fails to compile. After most passes Numba also determines
where each variable is alive, which is needed only to release variables (`physics.compiler.fused.lowering`). Users'
functions go through all of Numba's passes.
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
    """Base of passes with a single method `change(state)`, which changes the state of the compilation."""

    def __init__(self):
        super().__init__()

    def run_pass(self, state):
        self.change(state)
        return True


class _Interpreter(Interpreter):
    """Translator of byte code to Numba's intermediate code, with the only corrections that kernels need.

    These are the corrections for calls with `*`.
    """

    def post_process(self, peepholes, func_ir):
        """Correct calls with `*`, but not `with`, `try`, dictionaries, and calls with many keywords."""
        return super().post_process([peep_hole_list_to_tuple], func_ir)


@register_pass(mutates_CFG=True, analysis_only=False)
class _FromByteCode(_Plain):
    """Pass that translates the byte code of a function to Numba's intermediate code."""

    _name = "kernel_from_byte_code"

    def change(self, state):
        state.func_ir = _Interpreter(state.func_id).interpret(state.bc)


@register_pass(mutates_CFG=True, analysis_only=False)
class _Rewrites(_Plain):
    """Pass with Numba's rewrites before type inference, such as that of a constant subscript."""

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
    """Pass that renames variables so that each is assigned only once (single assignment form)."""

    _name = "kernel_single_assignment"

    def change(self, state):
        state.func_ir = reconstruct_ssa(state.func_ir)
        state.func_ir._definitions = build_definitions(state.func_ir.blocks)


@register_pass(mutates_CFG=False, analysis_only=False)
class _Types(_Plain):
    """Pass that infers the types of variables and calls."""

    _name = "kernel_types"

    def change(self, state):
        infer_types(state)


@register_pass(mutates_CFG=True, analysis_only=False)
class _NoPhis(PreLowerStripPhis):
    """Pass that replaces phi nodes by assignments at the ends of the branches that join."""

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
    """Sequence of the passes of a kernel; an error of a pass is raised unchanged.

    Parameters
    ----------
    at_last : type
        Passes at the end: the lowering to LLVM IR, and those that follow it.
    """

    def __init__(self, *at_last: type):
        super().__init__("nopython")
        for each in (*_TYPING_PASSES, *at_last):
            self.add_pass(each, each.__name__)
        self.finalize()

    def run(self, state):
        """Run all passes on the state of a compilation, without Numba's checks of all types between them."""
        for each, _ in self.passes:
            one = _pass_registry.get(each).pass_inst
            one.analysis = self._analysis
            one.run_pass(state)


def numbas_passes(state, own: dict[type, type], *after_lowering: type) -> PassManager:
    """Make the sequence of Numba's own passes, with some of them replaced.

    Parameters
    ----------
    state : numba.core.compiler.StateDict
        State of the compilation.
    own : dict
        Dictionary from passes of Numba to their replacements; `NativeLowering` must be among its keys.
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
    """Make the sequence of passes that compile a kernel.

    Parameters
    ----------
    state : numba.core.compiler.StateDict
        State of the compilation.
    lowering : type
        Pass of the lowering to LLVM IR.
    *after_lowering : type
        Passes that follow the lowering.
    """
    if is_on("passes"):
        return _own_passes(lowering, *after_lowering, NoPythonBackend)
    return numbas_passes(state, {NativeLowering: lowering, NopythonTypeInference: _Types}, *after_lowering)
