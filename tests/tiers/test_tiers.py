"""The tiers of this suite: tests that are left out, and tests that run in a process without a compiler."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]

CONFTEST = """
from tests.tiers import plugin

pytest_addoption, pytest_configure = plugin.add_options, plugin.configure
"""

TESTS = """
import os

import pytest

from physics.kernels.compile.compiler_choice import COMPILER

@pytest.mark.interpreted
@pytest.mark.parametrize("name", ["a b", "c::d", "é"])
def test_interpreted(name):
    print("said by the test")
    assert COMPILER == "python"

@pytest.mark.interpreted
def test_fails():
    assert COMPILER == "as it is here"

@pytest.mark.interpreted
@pytest.mark.xfail(strict=True)
def test_fails_as_expected():
    assert COMPILER == "as it is here"

@pytest.mark.interpreted
def test_skips():
    pytest.skip("for a reason")

def test_compiled():
    assert COMPILER != "python"

@pytest.mark.exhaustive
def test_left_out():
    assert COMPILER != "python"
"""

DYING = """
import os

import pytest

@pytest.mark.interpreted
def test_ends_its_process():
    os._exit(3)

@pytest.mark.interpreted
def test_comes_after():
    pass
"""


def run(folder: Path, tests: str, *options: str, **variables: str) -> str:
    """Output of pytest over a file of tests, in a folder with this suite's tiers."""
    (folder / "conftest.py").write_text(CONFTEST, encoding="utf-8")
    (folder / "test_them.py").write_text(tests, encoding="utf-8")
    environment = {name: text for name, text in os.environ.items() if name != "RIGID_ENV_COMPILER"}
    path = os.pathsep.join([str(ROOT), *filter(None, [os.environ.get("PYTHONPATH")])])
    environment |= {"PYTHONPATH": path, "PYTHONIOENCODING": "utf-8", **variables}
    command = [sys.executable, "-m", "pytest", "-rA", "-p", "no:cacheprovider", *options]
    done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, encoding="utf-8")
    return done.stdout


def counts(output: str) -> dict[str, int]:
    """Numbers of the last line: passed, failed, ..."""
    return {word: int(number) for number, word in re.findall(r"(\d+) (\w+)", output.splitlines()[-1])}


@pytest.mark.parametrize("options", [(), ("-n", "1", "--dist", "loadfile")], ids=["alone", "xdist"])
def test_the_default_tier_leaves_out_and_interprets(options, tmp_path):
    output = run(tmp_path, TESTS, *options)
    expected = {"passed": 4, "failed": 1, "skipped": 1, "xfailed": 1}
    assert {name: counts(output)[name] for name in expected} == expected
    assert "test_left_out" not in output
    assert "said by the test" in output
    assert "FAILED test_them.py::test_fails - AssertionError" in output
    assert "for a reason" in output


def test_a_folder_may_end_with_an_interpreted_test(tmp_path):
    """Fixtures of a folder are taken down before the tests of the next folder."""
    for name, mark in (("first", ""), ("second", "@pytest.mark.interpreted\n")):
        (tmp_path / "a").mkdir(exist_ok=True)
        (tmp_path / "a" / f"test_{name}.py").write_text(f"import pytest\n\n{mark}def test_{name}():\n    pass\n")
    (tmp_path / "b").mkdir()
    (tmp_path / "b" / "test_third.py").write_text("def test_third():\n    pass\n")
    assert counts(run(tmp_path, "def test_last():\n    pass\n"))["passed"] == 4


def test_exhaustive_runs_all_of_them_compiled(tmp_path):
    output = run(tmp_path, TESTS, "--exhaustive")
    assert "PASSED test_them.py::test_left_out" in output
    assert (counts(output)["passed"], counts(output)["failed"]) == (2, 4)


@pytest.mark.exhaustive
def test_a_compiler_that_is_chosen_runs_all_tests_here(tmp_path):
    output = run(tmp_path, TESTS, RIGID_ENV_COMPILER="python")
    assert counts(output)["failed"] == 2  # the one that must, and the one that wants a compiler


def test_a_process_that_ends_fails_its_test_alone(tmp_path):
    output = run(tmp_path, DYING)
    assert "FAILED test_them.py::test_ends_its_process - the process of interpreted tests" in output
    assert "PASSED test_them.py::test_comes_after" in output
