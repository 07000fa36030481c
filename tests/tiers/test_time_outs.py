"""Time-outs: a test that does not end fails with its name, also where SIGINT is ignored, and so do its processes."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from tests.tiers.child import SILENCE

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

ROOT = Path(__file__).parents[2]
pytestmark = pytest.mark.skipif(not hasattr(signal, "SIGALRM"), reason="no such signal")
pytest.importorskip("pytest_timeout")

STUBBORN = """
import os, signal, sys, time
for each in (signal.SIGINT, signal.SIGTERM):
    signal.signal(each, signal.SIG_IGN)
print(os.getpid(), file=open(sys.argv[1], "w"), flush=True)
time.sleep(600)
"""

CONFTEST = """
from tests.tiers import plugin

pytest_addoption, pytest_configure = plugin.add_options, plugin.configure
"""

TESTS = f"""
import subprocess, sys, time

import pytest

def test_waits_for_a_process():
    subprocess.run([sys.executable, "-c", {STUBBORN!r}, "pid"])

@pytest.mark.interpreted
def test_waits_without_a_compiler():
    time.sleep(600)

def test_comes_after():
    pass
"""

KERNEL = """
def test_in_a_kernel():
    sum(range(10**13))  # machine code: no handler of a signal is called before it returns
"""


def run(folder: Path, tests: str, settings: str) -> tuple[int, str]:
    """Exit status and output of pytest in a folder with this suite's tiers; SIGINT is ignored as in the background."""
    (folder / "conftest.py").write_text(CONFTEST)
    (folder / "test_them.py").write_text(tests)
    (folder / "pytest.ini").write_text(f"[pytest]\n{settings}\n")
    path = os.pathsep.join([str(ROOT), *filter(None, [os.environ.get("PYTHONPATH")])])
    environment = {name: text for name, text in os.environ.items() if name != "RIGID_ENV_COMPILER"}
    done = subprocess.run(
        [sys.executable, "-m", "pytest", "-rA", "-p", "no:cacheprovider"], cwd=folder, capture_output=True, text=True,
        env={**environment, "PYTHONPATH": path}, preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_IGN),
    )  # fmt: skip
    return done.returncode, done.stdout + done.stderr


def test_tests_that_do_not_end_fail_by_name_and_the_others_run(tmp_path):
    status, output = run(tmp_path, TESTS, "timeout = 5")
    assert status == pytest.ExitCode.TESTS_FAILED
    for name in ("test_waits_for_a_process", "test_waits_without_a_compiler"):
        assert f"FAILED test_them.py::{name} - Failed: Timeout" in output
    assert "PASSED test_them.py::test_comes_after" in output
    with pytest.raises(ProcessLookupError):  # it ignores what could be ignored
        os.kill(int((tmp_path / "pid").read_text()), 0)


def test_a_kernel_that_does_not_return_ends_the_process_and_its_test_is_named(tmp_path):
    status, output = run(tmp_path, KERNEL, "timeout = 1\nfaulthandler_timeout = 3\nfaulthandler_exit_on_timeout = true")
    assert status == 1
    assert "Timeout (0:00:03)!" in output
    assert "in test_in_a_kernel" in output


def test_this_suite_has_both():
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["pytest"]["ini_options"]
    assert 0 < settings["timeout"] < SILENCE < settings["faulthandler_timeout"]
    assert settings["faulthandler_exit_on_timeout"] is True
