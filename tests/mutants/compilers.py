"""Mutants of the compilers of kernels."""

from __future__ import annotations

from tests.mutants.mutant import Mutant

_COMPILER, _TESTS = "physics/compiler/", "tests/"


def _mutant(name: str, fault: str, path: str, old: str, new: str, test: str) -> Mutant:
    """Mutant of a compiler with one test."""
    return Mutant(name, fault, _COMPILER + path, old, new, (_TESTS + test,))


COMPILERS = [
    _mutant(
        "compile-checksum",
        "The checksum of a kept kernel is not checked.",
        "fused/cache_files.py",
        "if data[: len(MAGIC)] != MAGIC or _checksum(purpose, data[head:]) != data[len(MAGIC) : head]:",
        "if data[: len(MAGIC)] != MAGIC:",
        "kernels/test_disk.py::test_a_file_for_another_purpose_is_damaged",
    ),
    _mutant(
        "compile-owner",
        "A kept kernel is read although others may write to its file.",
        "cache_folder.py",
        "return status.st_uid in (os.getuid(), 0) and not status.st_mode & WRITABLE_BY_OTHERS",
        "return status.st_uid in (os.getuid(), 0)",
        "kernels/test_disk.py::test_a_file_that_others_may_write_is_not_unpickled",
    ),
    _mutant(
        "compile-digest",
        "The digest of the sources leaves out their subfolders.",
        "cache_folder.py",
        'sorted(folder.rglob("*.py"))',
        'sorted(folder.glob("*.py"))',
        "kernels/test_compiler.py::test_digest_changes_with_any_edit_and_any_rename",
    ),
    _mutant(
        "compile-range",
        "A loop that counts downwards does not run.",
        "fused/ranges.py",
        "left = builder.sub(stop, start) if stride > 0 else builder.sub(start, stop)",
        "left = builder.sub(stop, start)",
        "kernels/test_codegen.py::test_loops_with_steps_that_are_written_down",
    ),
]
