"""Name the folder of compiled kernels after all of their sources.

Numba's disk cache compares only the file in which a function stands. A kernel that calls a kernel of another file would
go on using the old machine code after that other file was edited. Here an edit anywhere among the kernels starts a
fresh folder.
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
    """True if indices are checked: `NUMBA_BOUNDSCHECK=1`."""
    return os.environ.get("NUMBA_BOUNDSCHECK", "0") not in ("", "0")


WRITABLE_BY_OTHERS = stat.S_IWGRP | stat.S_IWOTH


def is_owned_by_user(status: os.stat_result) -> bool:
    """True if only this user or root owns and can write a file or folder; always so without such users.

    Parameters
    ----------
    status : os.stat_result
    """
    if not hasattr(os, "getuid"):
        return True
    return status.st_uid in (os.getuid(), 0) and not status.st_mode & WRITABLE_BY_OTHERS


def _cache_root() -> Path | None:
    """`NUMBA_CACHE_DIR` if it is set, else the user's cache folder, else a temporary one; None if none is usable.

    `fused` looks at each file before it reads it (`fused.disk_cache`), `numba` at the folder.
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
    """Hexadecimal digest of every Python source under `folders`, names included."""
    digest = hashlib.sha256()
    for folder in folders:
        for path in sorted(folder.rglob("*.py")):
            digest.update(path.relative_to(folder.parent).as_posix().encode())
            digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


# Packages with kernels whose machine code does not depend on where they are installed.
PACKAGES = Path(__file__).parents[1].resolve(), Path(__file__).parents[2].resolve() / "rigid_env"

# All that machine code may depend on: these compilers, and every folder of kernels beside them.
SOURCES = Path(__file__).parent, Path(__file__).parents[1] / "kernels"


@cache
def folder_name() -> str:
    """Name of the folder, which identifies these kernels and their compiler."""
    checked = "-checked" if is_checked() else ""
    if COMPILER != FUSED:
        return f"{source_digest(*SOURCES)}-{COMPILER}{checked}"
    from physics.compiler.fused.ablation import folder_suffix

    return source_digest(*SOURCES) + checked + folder_suffix()


@cache
def cache_dir() -> Path | None:
    """Folder of the compiled kernels with these sources, and with or without checks of indices.

    None where there is no folder of this user's: then nothing is kept.
    """
    root = _cache_root()
    return None if root is None else root / folder_name()
