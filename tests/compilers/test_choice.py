"""Choice of the compiler: by name, by what is installed, and with one line that says why."""

from __future__ import annotations

import ast
import os
import subprocess
import sys
from pathlib import Path

import pytest

import physics
from physics.compiler.compiler_choice import FUSED, NUMBA, PYTHON, TESTED_RELEASES, VARIABLE, choose_compiler

ROOT = Path(physics.__file__).parents[1]
TESTED = "{}.{}.1".format(*TESTED_RELEASES[-1])


@pytest.mark.parametrize(
    ("environment", "installed", "compiler"),
    [
        ({}, TESTED, FUSED),
        ({VARIABLE: ""}, TESTED, FUSED),
        ({VARIABLE: "numba"}, TESTED, NUMBA),
        ({VARIABLE: "python"}, "0.61.2", PYTHON),
        ({"NUMBA_DISABLE_JIT": "1"}, TESTED, PYTHON),
        ({"NUMBA_DISABLE_JIT": "1", VARIABLE: "python"}, TESTED, PYTHON),
        ({VARIABLE: "python"}, "", PYTHON),
        ({"NUMBA_DISABLE_JIT": "0"}, TESTED, FUSED),
        ({VARIABLE: "numba"}, "0.99.0rc1", NUMBA),
    ],
)
def test_chosen_without_a_word(environment, installed, compiler):
    assert choose_compiler(environment, installed) == (compiler, None)


@pytest.mark.parametrize("installed", ["0.61.2", "0.67.0", "0.69.0", "1.0", "0.690.0rc1"])
def test_another_release_of_numba_is_named_once(installed):
    compiler, warning = choose_compiler({}, installed)
    assert compiler == NUMBA
    assert f"Numba {installed} is installed" in warning
    assert "two to three times" in warning
    compiler, warning = choose_compiler({VARIABLE: FUSED}, installed)
    assert compiler == FUSED
    assert installed in warning


def test_without_a_compiler_python_runs_kernels():
    compiler, warning = choose_compiler({}, "")
    assert compiler == PYTHON
    assert "not installed" in warning
    compiler, warning = choose_compiler({"NUMBA_DISABLE_JIT": "1", VARIABLE: "numba"}, TESTED)
    assert compiler == PYTHON
    assert "RIGID_ENV_COMPILER=numba is not followed" in warning


def test_an_unknown_compiler_is_refused():
    with pytest.raises(ValueError, match=r"RIGID_ENV_COMPILER is 'gcc'; allowed are fused, numba, python"):
        choose_compiler({VARIABLE: "gcc"}, TESTED)


def imported(compiler: str) -> set[str]:
    program = "import physics, sys; print(*sys.modules)"
    environment = {**os.environ, VARIABLE: compiler, "PYTHONPATH": str(ROOT)}
    done = subprocess.run([sys.executable, "-c", program], env=environment, capture_output=True, text=True, check=True)
    assert done.stderr == ""
    return set(done.stdout.split())


def test_python_needs_no_numba_and_numba_no_private_part():
    private = "physics.compiler.fused"
    in_python, in_numba = imported(PYTHON), imported(NUMBA)
    assert "numba" not in in_python
    assert "numba" in in_numba
    assert not any(name.startswith(private) for name in in_python | in_numba)


def names_of_numba(path: Path) -> list[str]:
    """Names that a source imports of Numba and LLVM."""
    found = []
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found += [each.name for each in node.names]
        elif isinstance(node, ast.ImportFrom) and node.level == 0:
            found += [f"{node.module}.{each.name}" for each in node.names]
    return [name for name in found if name.split(".")[0] in ("numba", "llvmlite")]


def test_only_the_private_part_imports_what_is_private():
    """Public are `numba` itself, what it names without an underscore, and `numba.extending`."""
    public = {"numba", "numba.njit", "numba.types", "numba.config", "numba.TypingError"}
    for package in ("physics", "rigid_env", "agents"):
        for path in (ROOT / package).rglob("*.py"):
            if "fused" in path.parts:
                continue
            private = [n for n in names_of_numba(path) if n not in public and not n.startswith("numba.extending.")]
            assert private == [], path
