"""The one decorator for all kernels, and where their compiled code is kept.

Numba's disk cache compares only the file in which a function stands. A kernel
that calls a kernel of *another* file would therefore go on using the old
machine code after that other file was edited. Here the cache lives in a folder
named after the content of all kernel sources together, so that an edit
anywhere among them starts a fresh cache.
"""

from __future__ import annotations

import hashlib
import os
import tempfile
from functools import cache
from pathlib import Path

from numba.core import config

from physics.kernels.compile.fused.ablation import folder_suffix
from physics.kernels.compile.fused.cache_files import warn
from physics.kernels.compile.fused.dispatcher import FOREIGN_KIND, PART_KIND, SHARED_KIND, Kernel


def _cache_root() -> Path | None:
    """`NUMBA_CACHE_DIR` if the user set one, else the user's cache folder, else a temporary one; None if none is his.

    Files in it are looked at one by one before they are read (`fused.disk_cache`), wherever they are.
    """
    if config.CACHE_DIR:
        return Path(config.CACHE_DIR)
    if os.name == "nt":
        base = Path(os.environ.get("LOCALAPPDATA", Path.home()))
    else:
        base = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    user = os.getuid() if hasattr(os, "getuid") else "user"
    for root in (base / "rigid-env", Path(tempfile.gettempdir()) / f"rigid-env-{user}"):
        try:
            root.mkdir(mode=0o700, parents=True, exist_ok=True)
            if hasattr(os, "getuid") and root.stat().st_uid not in (os.getuid(), 0):
                warn(f"{root} belongs to another user: kernels are not kept there")
            elif os.access(root, os.W_OK):
                return root
        except OSError:
            continue
    return None


def source_digest(folder: Path) -> str:
    """Hexadecimal digest of every Python source under `folder`, names included."""
    digest = hashlib.sha256()
    for path in sorted(folder.rglob("*.py")):
        digest.update(path.relative_to(folder).as_posix().encode())
        digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


# All that machine code may depend on: every folder of kernels, not only the one of this file.
SOURCES = Path(__file__).parents[1]


@cache
def folder_name() -> str:
    """Name of the folder: what tells these kernels from all others."""
    return source_digest(SOURCES) + ("-checked" if config.BOUNDSCHECK else "") + folder_suffix()


@cache
def cache_dir() -> Path | None:
    """Folder of the compiled kernels that belong to exactly these kernel sources, and check their indices or do not.

    None where there is no folder of this user's: then nothing is kept.
    """
    root = _cache_root()
    return None if root is None else root / folder_name()


# What all kernels have in common; see `kernel`.
OPTIONS = {"error_model": "numpy", "nogil": True, "_nrt": False}

# For `numba.extending.overload`: what it chooses is a part of the kernel that calls it, with no call left.
OVERLOAD_OPTIONS = {**OPTIONS, "forceinline": True, "pipeline_class": Kernel.part_pipeline}


def _make(function, called_as=PART_KIND, **options):
    """A `Kernel` of `function`; without a compiler the function itself."""
    if config.DISABLE_JIT:
        return function
    options = {"nopython": True, "boundscheck": None, **OPTIONS, **options}
    return Kernel(function, options=options, called_as=called_as)


def _compile(function, called_as=PART_KIND, **options):
    compiled = _make(function, called_as, **options)
    if not config.DISABLE_JIT:
        compiled.enable_caching(cache_dir())
    return compiled


def kernel(function):
    """Compile `function` in nopython mode; cached on disk, IEEE semantics, the GIL released.

    `error_model="numpy"` makes a division by zero an inf and not an exception
    (no exception path inside a kernel); there is no `fastmath`, so results do
    not depend on how the optimiser reorders a sum. A product in a sum is rounded
    with it, which is said for each (`folding_builder.fused_multiply_add`). Without Numba's run
    time (`_nrt`) there are no reference counts to keep, nor can a kernel allocate:
    arrays are lent to it, and views of the workspace need no owner.

    An index counts from the front of its axis, unless it is a literal: nothing asks whether it is negative. Under
    `NUMBA_BOUNDSCHECK=1` one that is outside its axis raises IndexError.

    Switches among the arguments are passed as ``None`` (off) or ``True`` (on):
    Numba prunes a branch on ``x is None`` while compiling, in every callee, so
    that what is off is not in the machine code at all.

    A variable of a kernel with branches is not named after another one with digits behind, as x1 and x12 are: Numba may
    take one for the other, and then cannot compile it (`tests/kernels/test_variable_names.py`).

    That it is not inlined is said, because Numba would have it inlined where the first caller that it is compiled for
    is, and with it all that it calls, a copy for each call.
    """
    return _compile(function, forceinline=False)


def cold_kernel(function):
    """`kernel` for what a step hardly ever needs: a call is left of it.

    LLVM copies a function that is called from one place into its caller, however long it is. What always runs there
    then has fewer registers for its numbers, and moves them to the stack and back.
    """
    function.is_cold = True
    return kernel(function)


def shared_kernel(function):
    """`kernel` with machine code of its own, which all plans call: see `physics.kernels.compile.fused.dispatcher`."""
    return _compile(function, SHARED_KIND, forceinline=False)


def inlined(function):
    """`kernel` for what is a few instructions long, or is called from one place: no call is left of it."""
    return _compile(function, forceinline=True)


def runtime_kernel(function):
    """`inlined` without a place of its own on disk: made at run time, or by a user, and kept with what calls it."""
    return _make(function, FOREIGN_KIND, forceinline=True)


def user_kernel(function):
    """`runtime_kernel` for a user's function: indices may count from the end; one outside raises IndexError."""
    return _make(function, FOREIGN_KIND, forceinline=True, boundscheck=True)
