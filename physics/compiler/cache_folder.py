"""Folder of compiled kernels, named after a digest of all their sources.

Numba's disk cache checks only the file that defines a function. A kernel that calls a kernel of another file would
keep its old machine code after an edit of that file. Here an edit of any kernel's file leads to a new folder.
"""

from __future__ import annotations

import hashlib
import os
import stat
import tempfile
from functools import cache
from pathlib import Path

from physics.compiler.compiler_choice import COMPILER, FUSED
from physics.compiler.notices import warn


def is_checked() -> bool:
    """True if kernels check the indices of arrays: with the environment variable `NUMBA_BOUNDSCHECK=1`."""
    return os.environ.get("NUMBA_BOUNDSCHECK", "0") not in ("", "0")


WRITABLE_BY_OTHERS = stat.S_IWGRP | stat.S_IWOTH


def is_owned_by_user(status: os.stat_result) -> bool:
    """True if this user or root owns a file or folder, and nobody else may write to it.

    Parameters
    ----------
    status : os.stat_result
        Status of the file or folder. On systems without user numbers (Windows) every file passes.
    """
    if not hasattr(os, "getuid"):
        return True
    return status.st_uid in (os.getuid(), 0) and not status.st_mode & WRITABLE_BY_OTHERS


def _cache_root() -> Path | None:
    """Folder for all compiled kernels; None if no folder is usable.

    It is `NUMBA_CACHE_DIR` if that is set, else in the user's cache folder, else in the folder of temporary files.
    Whether other users may write there is checked later: by `fused` for each file (`fused.disk_cache`), by `numba` for
    the folder.
    """
    if os.environ.get("NUMBA_CACHE_DIR"):
        return Path(os.environ["NUMBA_CACHE_DIR"])
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


def source_digest(*folders: Path) -> str:
    """Hexadecimal digest of the names and contents of all Python files under `folders`."""
    digest = hashlib.sha256()
    for folder in folders:
        for path in sorted(folder.rglob("*.py")):
            digest.update(path.relative_to(folder.parent).as_posix().encode())
            digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


# Packages with kernels whose machine code does not depend on the place of installation.
PACKAGES = Path(__file__).parents[1].resolve(), Path(__file__).parents[2].resolve() / "rigid_env"

# Folders of all sources on which machine code may depend: the compilers and the kernels.
SOURCES = Path(__file__).parent, Path(__file__).parents[1] / "kernels"


@cache
def folder_name() -> str:
    """Name of the folder of machine code: a digest of the sources of all kernels, and the compiler with its options."""
    checked = "-checked" if is_checked() else ""
    if COMPILER != FUSED:
        return f"{source_digest(*SOURCES)}-{COMPILER}{checked}"
    from physics.compiler.fused.ablation import folder_suffix

    return source_digest(*SOURCES) + checked + folder_suffix()


@cache
def cache_dir() -> Path | None:
    """Folder of the machine code of these kernels by this compiler; None if no folder is usable.

    With None nothing is kept on disk, and each process compiles its kernels.
    """
    root = _cache_root()
    return None if root is None else root / folder_name()
