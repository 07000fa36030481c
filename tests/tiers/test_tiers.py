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

from physics.compiler.compiler_choice import COMPILER

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


FIRST = "def test_{}():\n    pass\n"
SECOND = f"import pytest\n\n@pytest.mark.interpreted\n{FIRST}"
FILES = {
    "test_them.py": TESTS,
    "test_dying.py": DYING,
    # fixtures of a folder that ends with an interpreted test are taken down before the tests of the next folder
    "a/test_first.py": FIRST.format("first"),
    "a/test_second.py": SECOND.format("second"),
    "b/test_third.py": FIRST.format("third"),
}


def run(folder: Path, *options: str, **variables: str) -> str:
    """Output of pytest over some files of tests, in a folder with this suite's tiers."""
    for name, code in {"conftest.py": CONFTEST, **FILES}.items():
        (folder / name).parent.mkdir(exist_ok=True)
        (folder / name).write_text(code, encoding="utf-8")
    environment = {name: text for name, text in os.environ.items() if name != "RIGID_ENV_COMPILER"}
    path = os.pathsep.join([str(ROOT), *filter(None, [os.environ.get("PYTHONPATH")])])
    environment |= {"PYTHONPATH": path, "PYTHONIOENCODING": "utf-8", **variables}
    command = [sys.executable, "-m", "pytest", "-rA", "-p", "no:cacheprovider", *options]
    done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, encoding="utf-8")
    return done.stdout


def counts(output: str) -> dict[str, int]:
    """Numbers of the last line: passed, failed, ..."""
    return {word: int(number) for number, word in re.findall(r"(\d+) (\w+)", output.splitlines()[-1])}


@pytest.mark.parametrize(
    "options",
    [(), pytest.param(("-n", "1", "--dist", "loadfile"), marks=pytest.mark.exhaustive)],
    ids=["alone", "xdist"],
)
def test_the_default_tier_leaves_out_and_interprets(options, tmp_path):
    output = run(tmp_path, *options)
    expected = {"passed": 8, "failed": 2, "skipped": 1, "xfailed": 1}
    assert {name: counts(output).get(name) for name in expected} == expected
    assert "error" not in counts(output)
    assert "test_left_out" not in output
    assert "said by the test" in output
    assert "FAILED test_them.py::test_fails - AssertionError" in output
    assert "for a reason" in output
    # a process that ends fails its test alone
    assert "FAILED test_dying.py::test_ends_its_process - the process of" in output
    assert "PASSED test_dying.py::test_comes_after" in output


def test_exhaustive_runs_all_of_them_compiled(tmp_path):
    output = run(tmp_path, "--exhaustive", "test_them.py")
    assert "PASSED test_them.py::test_left_out" in output
    assert (counts(output)["passed"], counts(output)["failed"]) == (2, 4)


@pytest.mark.exhaustive
def test_a_compiler_that_is_chosen_runs_all_tests_here(tmp_path):
    output = run(tmp_path, "test_them.py", RIGID_ENV_COMPILER="python")
    assert counts(output)["failed"] == 2  # the one that must, and the one that wants a compiler
