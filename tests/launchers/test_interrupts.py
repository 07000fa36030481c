"""Ctrl-C ends jobs in processes of this machine: those that run are interrupted, and no other one starts."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from benchmarks.processes import killed_after
from tests.launchers.slow_jobs import INTERRUPTED

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="signals")

LONG = 60.0  # far less than a job, far more than a start [s]


@contextmanager
def begun(folder: Path, *options: str) -> Iterator[subprocess.Popen]:
    """Five jobs, two at once, in a process group of their own, after two have begun."""
    command = [sys.executable, "-m", "tests.launchers.slow_jobs", str(folder), *options]
    process = subprocess.Popen(command, stderr=subprocess.PIPE, text=True, start_new_session=True)
    with process, killed_after(process, 2 * LONG):
        wait_until(lambda: len(files(folder, "begun")) == 2)
        yield process


def wait_until(is_there: Callable[[], bool]) -> None:
    limit = time.monotonic() + LONG
    while not is_there():
        assert time.monotonic() < limit
        time.sleep(0.02)


def files(folder: Path, ending: str) -> list[str]:
    return sorted(path.stem for path in folder.glob(f"*.{ending}"))


def test_ctrl_c_interrupts_running_jobs_and_starts_no_other(tmp_path):
    with begun(tmp_path) as process:
        os.killpg(process.pid, signal.SIGINT)
        told = process.stderr.readline()
        rest = process.stderr.read()
    assert told.startswith("stopping job 0, job 1; Ctrl-C again kills")
    assert rest == ""
    assert process.returncode == INTERRUPTED
    assert files(tmp_path, "begun") == files(tmp_path, "saved") == ["0", "1"]


def test_a_second_ctrl_c_kills_jobs_that_go_on(tmp_path):
    with begun(tmp_path, "--stubborn") as process:
        os.killpg(process.pid, signal.SIGINT)
        assert process.stderr.readline().startswith("stopping job 0, job 1")
        wait_until(lambda: len(files(tmp_path, "saved")) == 2)
        os.killpg(process.pid, signal.SIGINT)
        assert process.stderr.read() == ""
    assert process.returncode == INTERRUPTED
    assert files(tmp_path, "begun") == ["0", "1"]
