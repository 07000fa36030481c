"""Programs in prepared processes end as they would from a shell."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests import prepared


def ended(code: str, folder: Path, **limit: float) -> tuple[int, str]:
    """Exit status and output of a program."""
    (file := folder / "program.py").write_text(code, encoding="utf-8")
    return prepared.run(file, folder, **limit)


def test_output_and_success_are_told(tmp_path):
    assert ended("import os\nprint(__name__, len(os.listdir()))\n", tmp_path) == (0, "__main__ 2\n")


def test_an_error_is_told_with_its_line(tmp_path):
    status, output = ended("x = 1\ny = physics\n", tmp_path)
    assert status == 1
    assert "line 2" in output
    assert "NameError: name 'physics' is not defined" in output


def test_an_exit_status_is_kept(tmp_path):
    assert ended("raise SystemExit(3)\n", tmp_path)[0] == 3


def test_what_a_program_does_not_import_is_not_registered(tmp_path):
    status, output = ended("import gymnasium as gym\ngym.make('rigid_env/BlockReach-v0')\n", tmp_path)
    assert status == 1
    assert "NamespaceNotFound" in output


def test_a_program_that_does_not_end_is_ended(tmp_path):
    with pytest.raises(TimeoutError, match=r"program\.py took longer than 0\.5 s"):
        ended("while True:\n    pass\n", tmp_path, timeout=0.5)
