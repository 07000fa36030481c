"""Code libraries of kernels: IR of parts, machine code of entry kernels and shared ones (`dispatcher`).

The private part of Numba used here is `JITCodeLibrary`, the IR of one function with the libraries that it calls.
"""

from __future__ import annotations

import importlib
from typing import NamedTuple

from llvmlite import binding as llvm
from numba.core import cgutils
from numba.core.codegen import CodeLibrary, JITCodeLibrary


class KernelOrigin(NamedTuple):
    """Origin of shared machine code: a kernel, and the types of its arguments.

    Parameters
    ----------
    module, name : str
    args : tuple of numba.types.Type
    """

    module: str
    name: str
    args: tuple

    def load(self) -> None:
        """Load the machine code into memory."""
        getattr(importlib.import_module(self.module), self.name).stand(self.args)


class PartLibrary(JITCodeLibrary):
    """IR of one part, neither linked nor optimised."""

    def add_ir_module(self, ir_module):
        """Add a module; it is the same in every whole that calls the part."""
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
    """IR of a whole, linked with that of every part below it before it is optimised.

    Its parts are its own. Two wholes on disk may have parts of one name that differ, made by two processes; a third
    process that loads both would run one part in both.

    Attributes
    ----------
    called : tuple of KernelOrigin
        The kernels that stand, of those below it.
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
    """Machine code of a shared kernel, called by symbol.

    Attributes
    ----------
    origin : KernelOrigin
        What it was made of.
    """

    origin: KernelOrigin

    def machine_code(self) -> bytes:
        """Machine code in its form on disk."""
        self._ensure_finalized()
        return self._get_compiled_object()

    def take(self, machine_code: bytes) -> None:
        """Take machine code from disk."""
        self.enable_object_caching()
        self._set_compiled_object(machine_code)
        self._finalize_final_module()


def _callers_first(whole: WholeLibrary) -> list[CodeLibrary]:
    """Every library below `whole` once, after all of its callers: the linker drops uncalled functions."""
    callees_first: dict[CodeLibrary, None] = {}

    def visit(library):
        for callee in library._linking_libraries:
            if callee not in callees_first:
                if isinstance(callee, PartLibrary):
                    visit(callee)
                callees_first[callee] = None

    visit(whole)
    return list(reversed(callees_first))
