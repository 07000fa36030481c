"""How kernels are compiled together: each to LLVM IR once, all of them to machine code once.

Left to itself Numba optimises a kernel and makes machine code of it as soon as it is typed, and then once more in
every caller it is linked into, up to a dozen levels of a step. Here a kernel that is called from another one is a
*part*: lowered to IR and no further. Only a *whole*, which Python calls, links all parts below it, is optimised and
becomes machine code; it alone is kept on disk.

In a whole nobody else can call a part, and the optimiser is told so: it leaves out what a part does not read of its
arguments, and a part with one caller becomes part of that. The scratch of many bodies is a hundred arrays of seven
words each, and a part that is handed it reads a dozen: with all of them on the stack calls took a third of a step.

A symbol is named after its function and the types of its arguments. Numba names a record type by a number that counts
the types of the process: machine code made in two processes, for two records of the same number, would have the same
names in it, and a third process that loads both from disk would run the parts of one in the other. Here a digest of the
types is part of each name.

`pipeline_class` is Numba's documented way to have a function compiled otherwise; what is not public of Numba here is
`JITCodeLibrary`, the IR of one function with the libraries that it calls.
"""

from __future__ import annotations

import hashlib
from functools import cache

from llvmlite import binding as llvm
from numba import _dynfunc
from numba.core import cgutils, event
from numba.core.codegen import CodeLibrary, JITCodeLibrary
from numba.core.compiler import CompilerBase, DefaultPassBuilder, Flags
from numba.core.compiler_lock import global_compiler_lock
from numba.core.compiler_machinery import LoweringPass, PassManager, register_pass
from numba.core.registry import CPUDispatcher
from numba.core.sigutils import normalize_signature
from numba.core.typed_passes import NativeLowering, NoPythonBackend

from physics.kernels.codegen.lowering import PartLowering, WholeLowering
from physics.kernels.codegen.passes import KernelPasses
from physics.kernels.codegen.remember import RememberingTarget, remembering


class _PartLibrary(JITCodeLibrary):
    """IR of one part, neither linked nor optimised."""

    def add_ir_module(self, ir_module):
        """Take the module in: every whole that calls the part has the same one."""
        for function in ir_module.functions:
            if not function.is_declaration:
                function.linkage = "linkonce_odr"
        self._final_module = llvm.parse_assembly(cgutils.normalize_ir_text(str(ir_module)))
        self._final_module.data_layout = self._codegen._data_layout

    def _get_module_for_linking(self):
        return self._final_module

    def finalize(self):
        self._finalized = True


class _WholeLibrary(JITCodeLibrary):
    """IR of a whole, linked with that of every part below it before it is optimised."""

    def finalize(self):
        self._linking_libraries = _callers_first(self)
        super().finalize()

    def _optimize_final_module(self):
        for function in self._final_module.functions:
            if function.linkage.name == "linkonce_odr" and not function.is_declaration:  # a part
                function.linkage = "internal"
        super()._optimize_final_module()


def _callers_first(whole: _WholeLibrary) -> list[CodeLibrary]:
    """Every library below `whole` once, after all that call it: the linker drops what nobody has called so far."""
    callees_first: dict[CodeLibrary, None] = {}

    def visit(library):
        for callee in library._linking_libraries:
            if callee not in callees_first:
                if isinstance(callee, _PartLibrary):
                    visit(callee)
                callees_first[callee] = None

    visit(whole)
    return list(reversed(callees_first))


class _Flags(Flags):
    """Flags of a compilation that are equal when the same ones are set alike.

    Numba looks them up for each subscript it types; comparing the two dozen that are not set took a fifth of all time.
    What it puts into the names of symbols for them also tells the types of the arguments.
    """

    types = ""

    def values(self):
        return self._values

    def get_mangle_string(self):
        return super().get_mangle_string() + self.types


@cache
def _passes(*at_last: type) -> KernelPasses:
    return KernelPasses(*at_last)


class _WholeCompiler(CompilerBase):
    """Passes of ours, into a library of ours."""

    library_class: type[JITCodeLibrary] = _WholeLibrary
    is_entered = True  # from outside: see `ready`

    def __init__(self, typingctx, targetctx, library, args, return_type, flags, local_types):
        flags = _Flags(flags)
        flags.types = hashlib.sha256(str(args).encode()).hexdigest()[:16]
        contexts = remembering(typingctx), RememberingTarget(targetctx)
        super().__init__(*contexts, library, args, return_type, flags, local_types)
        self.state.flags.no_cfunc_wrapper = not self.is_entered

    def passes(self) -> PassManager:
        """To be run one after another."""
        return _passes(WholeLowering, NoPythonBackend)

    def define_pipelines(self):
        state = self.state
        state.library = self.library_class(state.targetctx.codegen(), state.func_id.func_qualname)
        state.library.enable_object_caching()
        return [self.passes()]


@register_pass(mutates_CFG=False, analysis_only=True)
class _KeepAsPart(LoweringPass):
    """Make the IR known to Numba, which knows functions by their entry points, under one that must not be called."""

    _name = "keep_as_part"

    def __init__(self):
        super().__init__()

    def run_pass(self, state):
        lowered = state["cr"]
        about = lowered.fndesc
        entry = _dynfunc.make_function(about.lookup_module(), about.qualname, "", 0, lowered.env, (state.library,))
        state.targetctx.insert_user_function(entry, about, [state.library])
        state["cr"] = lowered._replace(cfunc=entry)
        return True


class _PartCompiler(_WholeCompiler):
    """Up to the IR."""

    library_class = _PartLibrary
    is_entered = False

    def __init__(self, *arguments):
        super().__init__(*arguments)
        self.state.flags.no_cpython_wrapper = True
        self.state.flags.no_compile = True

    def passes(self):
        return _passes(PartLowering, _KeepAsPart, NoPythonBackend)


class _AnyPartCompiler(_PartCompiler):
    """For a function of which nothing is known: all that Numba's own pipeline does."""

    def passes(self):
        pipeline = DefaultPassBuilder.define_nopython_pipeline(self.state)
        pipeline.add_pass_after(_KeepAsPart, NativeLowering)
        pipeline.finalize()
        return pipeline


class _Part(CPUDispatcher):
    """A kernel that other kernels call."""

    def compile(self, sig):
        """Have it compiled for the types of its arguments, without the two clocks that Numba starts for each: they tell
        each other of every call of LLVM, as many of them as calls are nested."""
        args, return_type = normalize_signature(sig)
        if args not in self.overloads:
            about = {"dispatcher": self, "args": args, "return_type": return_type}
            with global_compiler_lock, self._compiling_counter, event.trigger_event("numba:compile", data=about):
                self.add_overload(self._compiler.compile(args, return_type))
        return self.overloads[args].entry_point


class Kernel(CPUDispatcher):
    """A function compiled for the types of its arguments: a whole for Python, a part for other kernels.

    Parameters
    ----------
    function : Callable
    local_types : dict, optional
        Must be empty; Numba passes it.
    options : dict
        Numba's options, as of `numba.njit`.
    is_foreign : bool
        It may be more than a kernel is: a closure, a comprehension. Such a function is only called from kernels.
    """

    part_pipeline = _PartCompiler

    def __init__(self, function, local_types=None, options=None, is_foreign=False):
        super().__init__(function, local_types, options, pipeline_class=_WholeCompiler)
        dispatcher, compiler = (CPUDispatcher, _AnyPartCompiler) if is_foreign else (_Part, _PartCompiler)
        self._part = dispatcher(function, local_types, options, pipeline_class=compiler)

    def ready_entry(self, machine_code) -> int:
        """Address of the entry for other machine code (`ready`) of what `compile` gave; it must return nothing."""
        made = next(made for made in self.overloads.values() if made.entry_point is machine_code)
        entry = made.library.get_pointer_to_function(made.fndesc.llvm_cfunc_wrapper_name)
        if entry == 0:
            raise TypeError(f"{self.py_func.__name__} returns {made.signature.return_type}; allowed is nothing")
        return entry

    def get_call_template(self, args, kws):
        """How another kernel calls this one."""
        return self._part.get_call_template(args, kws)

    def get_overload(self, sig):
        """What another kernel calls."""
        return self._part.get_overload(sig)
