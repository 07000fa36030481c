"""Caches on disk of the machine code of wholes and shared kernels (terms of `dispatcher`).

A file lists the shared kernels that its code calls; these are loaded first.
"""

from __future__ import annotations

import hashlib
import inspect
import sys
from contextlib import AbstractContextManager, nullcontext
from functools import cache, cached_property
from pathlib import Path

import numba
from numba import _dynfunc
from numba.core.compiler import CompileResult, compile_result
from numba.core.environment import Environment
from numba.core.serialize import dumps

from physics.compiler.cache_folder import PACKAGES, SOURCES, is_owned_by_user, source_digest
from physics.compiler.fused import cache_files
from physics.compiler.fused.code_libraries import SharedLibrary
from physics.compiler.fused.one_process import one_process
from physics.compiler.notices import warn, warn_once


class _Cache:
    """Cache of one kernel's machine code on disk, a file for each signature; it replaces Numba's cache.

    Parameters
    ----------
    function : Callable
        Python function of the kernel.
    folder : Path or None
        Folder of the files; None: nothing is kept.
    """

    kind = ""

    def __init__(self, function, folder: Path | None):
        self._function, self._source = function, Path(inspect.getfile(function))
        self.cache_path = folder
        self._is_enabled = folder is not None and self._source.exists()  # a function typed into a shell has no file

    def enable(self):
        """Use the disk, if there is a folder and the function is from a file."""
        self._is_enabled = self.cache_path is not None and self._source.exists()

    def disable(self):
        """Stop using the disk: neither load nor keep machine code."""
        self._is_enabled = False

    def flush(self):
        """Delete all files of this kernel."""
        for path in self.cache_path.glob(f"{self._name}.*.nbc") if self._is_enabled else ():
            path.unlink(missing_ok=True)

    def load_overload(self, sig, target_context):
        """Load the machine code for the types `sig` of arguments; None if no usable file exists.

        Numba's own cache would refresh the target context first, which imports SciPy and takes four times as long as
        loading a step. That is not needed: machine code of kernels uses nothing of the context, as kernels have no run
        time of Numba (`_nrt` in `backend`). If a kernel must be compiled, `CompilerBase` refreshes the context.
        """
        if not self._is_enabled:
            return None
        path, purpose = self._place(sig, target_context.codegen())
        try:
            payload = cache_files.read_cache_file(path, purpose)
            return None if payload is None else self.rebuild(target_context, payload)
        except cache_files.ForeignFileError as reason:
            warn_once("foreign", f"{path} is not read, since {reason}: kernels are compiled in memory")
        except Exception as error:  # any fault of the file: the kernel is compiled instead
            warn(f"{path} is damaged ({type(error).__name__}: {str(error)[:200]}): compiled anew")
        return None

    def one_process(self, sig, target_context) -> AbstractContextManager[None]:
        """Context manager in which no other process compiles the kernel for the types `sig` of arguments.

        See the module `one_process`. It does nothing if nothing is kept on disk, or if the file exists.
        """
        if not self._is_enabled:
            return nullcontext()
        path, _ = self._place(sig, target_context.codegen())
        return nullcontext() if path.is_file() else one_process(path)

    def save_overload(self, sig, made):
        """Write the compiled kernel `made` for the types `sig` of arguments to disk, if that is possible."""
        if not self._is_enabled or made.library.has_dynamic_globals:
            return
        path, purpose = self._place(sig, made.codegen)
        if path.is_file() and not is_owned_by_user(path.stat()):
            return  # another user's file, which must not be replaced
        try:
            cache_files.write_cache_file(path, purpose, dumps(self.reduce(made)))
        except OSError as error:
            about = (
                f"kernels cannot be kept in {self.cache_path} ({error.strerror or error}): each process compiles them"
            )
            warn_once("unwritable", about)

    @cached_property
    def _name(self) -> str:
        name = f"{self._source.stem}.{self._function.__qualname__}".replace("<", "").replace(">", "")
        return f"{name}-{self._function.__code__.co_firstlineno}{self.kind}"

    @cached_property
    def _about(self) -> bytes:
        """Digests of everything but argument types and processor on which the machine code depends."""
        function = self._function
        around = dumps(tuple(cell.cell_contents for cell in function.__closure__)) if function.__closure__ else b""
        versions = (sys.version_info[:3], sys.abiflags if hasattr(sys, "abiflags") else "", numba.__version__)
        parts = (repr(versions).encode(), _place_of(self._source), self._name.encode(),
                 _digest_of_file(self._source), function.__code__.co_code, around)  # fmt: skip
        return b"".join(hashlib.sha256(part).digest() for part in parts)

    def _place(self, sig, codegen) -> tuple[Path, bytes]:
        """File of the machine code for the types `sig` of arguments, and its purpose (`cache_files`)."""
        purpose = self._about + repr((str(sig), codegen.magic_tuple())).encode()
        return self.cache_path / f"{self._name}.{hashlib.sha256(purpose).hexdigest()[:24]}.nbc", purpose


@cache
def _place_of(source: Path) -> bytes:
    """Identify the place of a source file, since files with equal content may import different modules.

    A file in one of `PACKAGES` is identified by its path within the package and by a digest of its folder, so that the
    place of installation does not matter. For files in `SOURCES`, `cache_folder.folder_name` has that digest already.
    """
    source = source.resolve()
    for package in PACKAGES:
        if source.is_relative_to(package):
            is_in_name = any(source.is_relative_to(folder.resolve()) for folder in SOURCES)
            around = "" if is_in_name else source_digest(source.parent)
            return f"{package.name}/{source.relative_to(package).as_posix()} {around}".encode()
    return str(source).encode()


@cache
def _digest_of_file(path: Path) -> bytes:
    return hashlib.sha256(path.read_bytes()).digest()


class WholeCache(_Cache):
    """Cache of a kernel as Python calls it; a file holds the origins of its shared kernels, and Numba's data."""

    def reduce(self, made):
        """Content of the file for the compiled kernel `made`."""
        return made.library.called, made._reduce()

    def rebuild(self, target_context, payload):
        """Make the compiled kernel from the content of its file, after loading the shared kernels that it calls."""
        called, kept = payload
        for origin in called:
            origin.load()
        return CompileResult._rebuild(target_context, *kept)


class SharedCache(_Cache):
    """Cache of a kernel as a shared one; a file holds its machine code, but no LLVM IR, which nobody links later."""

    kind = "-standing"  # suffix that distinguishes its files from those of the whole of the same kernel

    def reduce(self, made):
        """Content of the file for the compiled kernel `made`."""
        library, about = made.library, made.fndesc
        code = library.machine_code()
        about.typemap = about.calltypes = None
        return library.called, library.origin, code, about, made.signature

    def rebuild(self, target_context, payload):
        """Make the compiled kernel from the content of its file, after loading the shared kernels that it calls."""
        called, origin, code, about, signature = payload
        for each in called:
            each.load()
        library = SharedLibrary(target_context.codegen(), about.qualname)
        library.called, library.origin = called, origin
        library.take(code)
        return compile_result(
            target_context=target_context, fndesc=about, library=library, signature=signature, objectmode=False,
            entry_point=register_library(target_context, about, Environment.from_fndesc(about), library),
        )  # fmt: skip


def register_library(target_context, about, environment, library):
    """Register a part or shared kernel with Numba, so that other kernels can call it; return its entry point.

    Numba identifies compiled functions by their entry points. The entry point made here serves only as such an
    identity; it must not be called.
    """
    entry = _dynfunc.make_function(about.lookup_module(), about.qualname, "", 0, environment, (library,))
    target_context.insert_user_function(entry, about, [library])
    return entry
