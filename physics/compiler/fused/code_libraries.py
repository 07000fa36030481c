"""Code libraries of kernels: LLVM IR of parts, machine code of wholes and shared kernels (terms of `dispatcher`).

The private part of Numba used here is `JITCodeLibrary`, the IR of one function with the libraries that it calls.
"""

from __future__ import annotations

import importlib
from typing import NamedTuple

from llvmlite import binding as llvm
from numba.core import cgutils
from numba.core.codegen import CodeLibrary, JITCodeLibrary


class KernelOrigin(NamedTuple):
    """Origin of the machine code of a shared kernel: the kernel, and the types of its arguments.

    Parameters
    ----------
    module, name : str
        Names of the kernel and of its module.
    args : tuple of numba.types.Type
        Types of the arguments.
    """

    module: str
    name: str
    args: tuple

    def load(self) -> None:
        """Load the machine code of the kernel into memory, from disk or by compiling it."""
        getattr(importlib.import_module(self.module), self.name).stand(self.args)


class PartLibrary(JITCodeLibrary):
    """Library of a part, a kernel that other kernels call: its LLVM IR, neither linked nor optimised."""

    def add_ir_module(self, ir_module):
        """Take the LLVM module of the part; several wholes may link it, so its functions may be defined repeatedly."""
        for function in ir_module.functions:
            if not function.is_declaration:
                function.linkage = "linkonce_odr"
        self._final_module = llvm.parse_assembly(cgutils.normalize_ir_text(str(ir_module)))
        self._final_module.data_layout = self._codegen._data_layout

    def _get_module_for_linking(self):
        return self._final_module

    def finalize(self):
        self._finalized = True


class WholeLibrary(JITCodeLibrary):
    """Library of a whole, a kernel that Python calls: its IR is linked with that of all parts below it and optimised.

    The symbols of its parts are internal. Otherwise a process that loads two wholes from disk, made by two other
    processes, could run a part of one whole in the other where different parts have the same name.

    Attributes
    ----------
    called : tuple of KernelOrigin
        Shared kernels that the whole calls, directly or through its parts.
    """

    called: tuple[KernelOrigin, ...] = ()

    def finalize(self):
        below = _callers_first(self)
        self.called = tuple(each.origin for each in below if isinstance(each, SharedLibrary))
        self._linking_libraries = [each for each in below if not isinstance(each, SharedLibrary)]
        super().finalize()

    def _optimize_final_module(self):
        for function in self._final_module.functions:
            if function.linkage.name == "linkonce_odr" and not function.is_declaration:  # a part
                function.linkage = "internal"
        super()._optimize_final_module()


class SharedLibrary(WholeLibrary):
    """Library of a shared kernel: machine code that wholes call by symbol.

    Attributes
    ----------
    origin : KernelOrigin
        Kernel and types of arguments of the machine code.
    """

    origin: KernelOrigin

    def machine_code(self) -> bytes:
        """Machine code of the kernel as an object file, to be kept on disk."""
        self._ensure_finalized()
        return self._get_compiled_object()

    def take(self, machine_code: bytes) -> None:
        """Take over machine code that was read from disk, in the form that the method `machine_code` returns."""
        self.enable_object_caching()
        self._set_compiled_object(machine_code)
        self._finalize_final_module()


def _callers_first(whole: WholeLibrary) -> list[CodeLibrary]:
    """List the libraries of all kernels below `whole`, each once and after its callers.

    This order matters, since the linker drops functions that nothing calls yet.
    """
    callees_first: dict[CodeLibrary, None] = {}

    def visit(library):
        for callee in library._linking_libraries:
            if callee not in callees_first:
                if isinstance(callee, PartLibrary):
                    visit(callee)
                callees_first[callee] = None

    visit(whole)
    return list(reversed(callees_first))
