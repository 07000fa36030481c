"""Files of machine code. A file is read only if it is complete, made for this kernel, and written by this user.

A cache file is unpickled, which can run any code, and its machine code is then run. So a file begins with a digest of
its content and of its purpose: the kernel, its sources and the types of arguments. It is read only if it belongs to
this user or to root, and nobody else may write to it. The opened file itself is checked, so that links do not matter.
The caller replaces a damaged file and says so. If files cannot be written, machine code stays in memory.

The name of a file is a digest of its purpose, so there is no index that two processes could both write.
"""

from __future__ import annotations

import hashlib
import os
import pickle
import uuid
from contextlib import suppress
from pathlib import Path

from physics.compiler.cache_folder import is_owned_by_user

MAGIC = b"rigid-env kernel 1\n"
DIGEST_SIZE = 32  # [bytes]


class DamagedFileError(Exception):
    """Error about a cache file whose content is not the one that was written."""


class ForeignFileError(Exception):
    """Error about a cache file that another user wrote, or could have written."""


def _checksum(purpose: bytes, content: bytes) -> bytes:
    return hashlib.blake2b(content, digest_size=DIGEST_SIZE, key=hashlib.sha256(purpose).digest()).digest()


def read_cache_file(path: Path, purpose: bytes):
    """Read and unpickle a cache file that was written for this purpose; return None if the file does not exist.

    Raises
    ------
    DamagedFileError, ForeignFileError
        The file must not be used; the message is the reason.
    OSError
        The file cannot be read.
    """
    try:
        file = open(path, "rb")  # noqa: SIM115 (closed below)
    except (FileNotFoundError, NotADirectoryError):
        return None
    with file:
        if not is_owned_by_user(os.fstat(file.fileno())):
            raise ForeignFileError("other users may write to it")
        data = file.read()
    head = len(MAGIC) + DIGEST_SIZE
    if data[: len(MAGIC)] != MAGIC or _checksum(purpose, data[head:]) != data[len(MAGIC) : head]:
        raise DamagedFileError("it is empty" if not data else "it is not what was written")
    return pickle.loads(data[head:])


def write_cache_file(path: Path, purpose: bytes, pickled: bytes) -> None:
    """Write pickled content for a purpose to a cache file, which appears complete or not at all.

    Other users may read the file if the umask allows it.

    Raises
    ------
    OSError
        The file cannot be written. Nothing has changed then.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    if path.is_dir():
        path.rename(path.with_name(f"{path.name}.{uuid.uuid4().hex[:8]}.damaged"))
    temporary = path.with_name(f"{path.name}.tmp.{uuid.uuid4().hex[:16]}")
    try:
        descriptor = os.open(temporary, os.O_WRONLY | os.O_CREAT | os.O_EXCL | getattr(os, "O_BINARY", 0), 0o644)
        with open(descriptor, "wb") as file:
            file.write(MAGIC + _checksum(purpose, pickled) + pickled)
        temporary.replace(path)
    except BaseException:
        with suppress(OSError):
            temporary.unlink()
        raise
