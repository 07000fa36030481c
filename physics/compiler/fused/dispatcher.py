"""Dispatchers that compile kernels together: each kernel to LLVM IR once, all kernels of a step to machine code once.

Numba's own dispatcher optimises a kernel and compiles it to machine code as soon as its types are known. It does so
again in every caller, at up to a dozen levels of a step. Here a kernel has one of three roles:

- A *part* is called from other kernels. It is lowered to IR and no further.
- A *whole* is called from Python. It links all parts below it, is optimised and compiled to machine code, and is kept
  on disk.
- A *shared* kernel is compiled once per signature, with all parts below it, and kept on disk beside the wholes. All
  wholes call it by symbol.

Nothing outside a whole can call its parts, and the optimiser knows that. So it drops arguments that a part does not
read, and inlines a part with one caller. The workspace of bodies that touch is a hundred arrays of seven words each, of
which a part reads a dozen. With all of them on the stack calls would take a third of a step.

The optimiser cannot optimise across the call of a shared kernel. But without shared kernels each plan would compile its
own copy of the solvers. So a kernel is shared if it is large, does not depend on the plan, and takes long or is seldom
needed.

The symbol of a kernel is named after its function and the types of its arguments. Numba names a record type by a number
that counts the types of the process. So two processes could give the same symbol to machine code for two different
records, and a third process that loads both from disk would run the shared kernels of one in the other. Here each
symbol contains a digest of the types. The symbols of parts are internal to a whole (`code_libraries.WholeLibrary`).

`pipeline_class` is Numba's documented way to change the passes of a function. Private parts of Numba are used in
`code_libraries` and `disk_cache`.
"""

from __future__ import annotations

import hashlib

from numba.core import event, types
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import CompilerBase, Flags
from numba.core.compiler_lock import global_compiler_lock
from numba.core.compiler_machinery import LoweringPass, PassManager, register_pass
from numba.core.registry import CPUDispatcher
from numba.core.sigutils import normalize_signature
from numba.core.typed_passes import NativeLowering

from physics.compiler.fused.ablation import is_on
from physics.compiler.fused.code_libraries import KernelOrigin, PartLibrary, SharedLibrary, WholeLibrary
from physics.compiler.fused.disk_cache import SharedCache, WholeCache, register_library
from physics.compiler.fused.lowering import PartLowering, UserLowering, WholeLowering
from physics.compiler.fused.memoised_contexts import MemoisedTarget, memoised
from physics.compiler.fused.passes import kernel_passes, numbas_passes


class _Flags(Flags):
    """Numba's flags of a compilation, with a digest of the types of arguments that becomes part of the symbol."""

    types = ""

    def get_mangle_string(self):
        return super().get_mangle_string() + self.types


class _WholeCompiler(CompilerBase):
    """Compiler of a whole, a kernel that Python calls: it runs the passes of `kernel_passes` to a `WholeLibrary`."""

    library_class: type[JITCodeLibrary] = WholeLibrary
    is_entered = True  # True: the kernel gets an entry for calls from machine code outside of it, see `prepared_entry`

    def __init__(self, typingctx, targetctx, library, args, return_type, flags, local_types):
        flags = _Flags(flags)
        flags.types = hashlib.sha256(str(args).encode()).hexdigest()[:16]
        contexts = memoised(typingctx), MemoisedTarget(targetctx)
        super().__init__(*contexts, library, args, return_type, flags, local_types)
        self.state.flags.no_cfunc_wrapper = not self.is_entered

    def passes(self) -> PassManager:
        """Sequence of the passes that compile the kernel."""
        return kernel_passes(self.state, WholeLowering)

    def define_pipelines(self):
        state = self.state
        state.library = self.library_class(state.targetctx.codegen(), state.func_id.func_qualname)
        state.library.enable_object_caching()
        return [self.passes()]


@register_pass(mutates_CFG=False, analysis_only=True)
class _KeepAsPart(LoweringPass):
    """Last pass of the compilation of a part: it registers the part with Numba, so that other kernels can call it."""

    _name = "keep_as_part"

    def __init__(self):
        super().__init__()

    def run_pass(self, state):
        lowered = state["cr"]
        about = lowered.fndesc
        entry = register_library(state.targetctx, about, lowered.env, state.library)
        state["cr"] = lowered._replace(cfunc=entry)
        return True


class _PartCompiler(_WholeCompiler):
    """Compiler of a part, a kernel that other kernels call: it stops at LLVM IR."""

    library_class = PartLibrary
    is_entered = False

    def __init__(self, *arguments):
        super().__init__(*arguments)
        self.state.flags.no_cpython_wrapper = True
        self.state.flags.no_compile = True
        if not is_on("inlined_kernels"):
            self.state.flags.forceinline = False

    def passes(self):
        return kernel_passes(self.state, PartLowering, _KeepAsPart)


class _SharedCompiler(_PartCompiler):
    """Compiler of a shared kernel, whose symbol is the same in all processes."""

    library_class = SharedLibrary

    def define_pipelines(self):
        about = self.state.func_id
        about.unique_id = 0
        pipelines = super().define_pipelines()
        self.state.library.origin = KernelOrigin(about.modname, about.func_qualname, self.state.args)
        return pipelines


class _AnyPartCompiler(_PartCompiler):
    """Compiler of users' functions, which may contain any Python that Numba supports, by Numba's own passes."""

    def passes(self):
        return numbas_passes(self.state, {NativeLowering: UserLowering}, _KeepAsPart)


class _Part(CPUDispatcher):
    """Dispatcher of a kernel in its role as a part of other kernels."""

    def compile(self, sig):
        """Compile the kernel for the types `sig` of arguments, without the two timers of Numba; return its entry point.

        Numba starts these timers for each compilation; nested ones would report every call of LLVM to each other.
        """
        if not is_on("untimed_parts"):
            return super().compile(sig)
        args, return_type = normalize_signature(sig)
        if args not in self.overloads:
            about = {"dispatcher": self, "args": args, "return_type": return_type}
            with global_compiler_lock, self._compiling_counter, event.trigger_event("numba:compile", data=about):
                self.add_overload(self._compiler.compile(args, return_type))
        return self.overloads[args].entry_point


class _Shared(_Part):
    """Dispatcher of a shared kernel, which other kernels call and which has machine code of its own."""

    def enable_caching(self, folder=None):
        """Keep the machine code in files of this folder; None: nowhere."""
        self._cache = SharedCache(self.py_func, folder)

    def compile(self, sig):
        """Load the machine code for the types `sig` of arguments from disk, or compile it; return its entry point."""
        args, _ = normalize_signature(sig)
        if args not in self.overloads:
            with global_compiler_lock:
                kept = self._cache.load_overload(args, MemoisedTarget(self.targetctx))
                if kept is None:
                    self._compile_here(args)
                else:
                    self.add_overload(kept)
        return self.overloads[args].entry_point

    def _compile_here(self, args):
        """Compile the kernel for these types of arguments and keep it on disk, unless another process does so first."""
        with self._cache.one_process(args, self.targetctx):
            kept = self._cache.load_overload(args, MemoisedTarget(self.targetctx))
            if kept is None:
                super().compile(args)
                self._cache.save_overload(args, self.overloads[args])
            else:
                self.add_overload(kept)


PART_KIND = _Part, _PartCompiler
SHARED_KIND = (_Shared, _SharedCompiler) if is_on("shared_kernels") else PART_KIND
FOREIGN_KIND = CPUDispatcher, _AnyPartCompiler  # part that may contain any Python that Numba knows


class Kernel(CPUDispatcher):
    """Dispatcher of a kernel, compiled for the types of its arguments: a whole for Python, a part for other kernels.

    Parameters
    ----------
    function : Callable
        Python function to compile.
    local_types : dict, optional
        Types of local variables, which Numba passes; it must be empty.
    options : dict
        Options of `numba.njit`.
    called_as : tuple
        Role of the kernel when other kernels call it: `PART_KIND`, `FOREIGN_KIND` or `SHARED_KIND`.
    """

    part_pipeline = _PartCompiler

    def __init__(self, function, local_types=None, options=None, called_as=PART_KIND):
        super().__init__(function, local_types, options, pipeline_class=_WholeCompiler)
        dispatcher, compiler = called_as
        self._make_part = lambda: dispatcher(function, local_types, options, pipeline_class=compiler)
        self._part = self._make_part()

    def renew(self) -> None:
        """Discard the code compiled for other kernels, after a global that the function reads has changed."""
        self._part = self._make_part()
        MemoisedTarget.forget(types.Dispatcher(self))

    def enable_caching(self, folder=None):
        """Keep the machine code in files of this folder; None: nowhere."""
        self._cache = WholeCache(self.py_func, folder)
        if isinstance(self._part, _Shared):
            self._part.enable_caching(folder)

    def compile(self, sig):
        """Load the machine code for the types `sig` of arguments from disk, or compile it; return its entry point.

        If several processes need it at the same time, one compiles it and the others load its file.
        """
        args, _ = normalize_signature(sig)
        if args in self.overloads or not isinstance(self._cache, WholeCache):
            return super().compile(sig)
        with global_compiler_lock, self._cache.one_process(args, self.targetctx):
            return super().compile(sig)

    def stand(self, args: tuple) -> None:
        """Load or compile the code that other kernels call, for arguments of these types."""
        self._part.compile(args)

    def as_part(self, args: tuple):
        """Compile the kernel as a part, for these types of arguments; return Numba's result of the compilation.

        Raises
        ------
        Exception
            Numba's exception if the function cannot be compiled for these types.
        """
        self._part.compile(args)
        return self._part.overloads[args]

    def ready_entry(self, machine_code) -> int:
        """Address of the kernel's prepared entry (see the module `prepared_entry`).

        `machine_code` is a result of `compile`, which selects the types of the arguments. TypeError if the kernel
        returns a value.
        """
        with global_compiler_lock:  # no other thread may be linking machine code meanwhile
            made = next(made for made in self.overloads.values() if made.entry_point is machine_code)
            entry = made.library.get_pointer_to_function(made.fndesc.llvm_cfunc_wrapper_name)
        if entry == 0:
            raise TypeError(f"{self.py_func.__name__} returns {made.signature.return_type}; allowed is nothing")
        return entry

    def get_call_template(self, args, kws):
        """Numba's template for types of arguments, with which another kernel types a call of this kernel."""
        return self._part.get_call_template(args, kws)

    def get_overload(self, sig):
        """Numba's entry point, with which another kernel lowers a call of this kernel."""
        return self._part.get_overload(sig)
