"""Machine code on disk: that of wholes, and that of kernels that stand (`linking`).

What is kept of either names the kernels that it calls and that stand: they are loaded before it.
"""

from __future__ import annotations

import importlib
from typing import NamedTuple

from numba import _dynfunc
from numba.core.caching import CompileResultCacheImpl, FunctionCache
from numba.core.compiler import compile_result
from numba.core.environment import Environment

from physics.kernels.codegen.libraries import StandingLibrary


class Origin(NamedTuple):
    """What machine code that stands was made of: a kernel, and the types of its arguments.

    Parameters
    ----------
    module, name : str
    args : tuple of numba.types.Type
    """

    module: str
    name: str
    args: tuple

    def load(self) -> None:
        """Have the machine code in memory."""
        getattr(importlib.import_module(self.module), self.name).stand(self.args)


class _KeptWhole(CompileResultCacheImpl):
    """A whole on disk: what it calls, and what Numba keeps."""

    def reduce(self, made):
        """What is written."""
        return made.library.called, super().reduce(made)

    def rebuild(self, target_context, payload):
        """The whole, from what was read."""
        called, kept = payload
        for origin in called:
            origin.load()
        return super().rebuild(target_context, kept)


class WholeCache(FunctionCache):
    """The wholes of one kernel."""

    _impl_class = _KeptWhole


class _KeptStanding(CompileResultCacheImpl):
    """Machine code that stands, on disk: without its IR, since nothing is linked with it."""

    def get_filename_base(self, fullname, abiflags):
        """Its file is not that of the whole of the same kernel."""
        return super().get_filename_base(fullname, abiflags) + "-standing"

    def reduce(self, made):
        """What is written."""
        library, about = made.library, made.fndesc
        code = library.machine_code()
        about.typemap = about.calltypes = None
        return library.called, library.origin, code, about, made.signature

    def rebuild(self, target_context, payload):
        """The kernel, from what was read."""
        called, origin, code, about, signature = payload
        for each in called:
            each.load()
        library = StandingLibrary(target_context.codegen(), about.qualname)
        library.called, library.origin = called, origin
        library.take(code)
        return compile_result(
            target_context=target_context, fndesc=about, library=library, signature=signature, objectmode=False,
            entry_point=made_known(target_context, about, Environment.from_fndesc(about), library),
        )  # fmt: skip


class StandingCache(FunctionCache):
    """The machine codes of one kernel that stands."""

    _impl_class = _KeptStanding


def made_known(target_context, about, environment, library):
    """Have Numba, which knows functions by their entry points, know a kernel under one that must not be called."""
    entry = _dynfunc.make_function(about.lookup_module(), about.qualname, "", 0, environment, (library,))
    target_context.insert_user_function(entry, about, [library])
    return entry
