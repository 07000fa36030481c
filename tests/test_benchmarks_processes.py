"""Processes of benchmarks end: one that hangs is killed, whatever signals it ignores."""

from __future__ import annotations

import ast
import subprocess
import sys
from pathlib import Path

import pytest

from benchmarks.processes import killed_after, wait_for_end
from benchmarks.same_bits import Checkout

ROOT = Path(__file__).parents[1]
KILLED = -9
STUBBORN = """
import signal, time
for each in (signal.SIGINT, signal.SIGTERM):
    signal.signal(each, signal.SIG_IGN)
print("there", flush=True)
while True:
    time.sleep(1.0)
"""

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="signals")


def started() -> subprocess.Popen:
    """A process that ignores all that can be ignored."""
    process = subprocess.Popen([sys.executable, "-c", STUBBORN], stdout=subprocess.PIPE, text=True)
    assert process.stdout.readline() == "there\n"
    return process


def test_a_process_that_hangs_is_killed():
    with started() as process:
        process.terminate()
        assert wait_for_end(process, 0.2) == KILLED
    with started() as process, killed_after(process, 0.2):
        assert process.stdout.readline() == ""  # waited for as long as that
    assert process.returncode == KILLED


def test_a_process_that_answers_is_left_alone():
    with started() as process:
        with killed_after(process, 60.0):
            pass
        assert process.poll() is None
        process.kill()


def test_a_worker_that_gives_no_answer_is_killed_and_told(tmp_path):
    worker = tmp_path / "worker.py"
    worker.write_text(STUBBORN.replace('print("there", flush=True)\n', ""))
    checkout = Checkout(ROOT, worker=worker)
    checkout.patience = checkout.ending = 3.0
    checkout.ask("drop", "fast", 25)
    with pytest.raises(RuntimeError, match="ended with -9"):
        checkout.answer()
    with Checkout(ROOT, worker=worker) as unasked:
        unasked.ending = 3.0
    assert unasked._process.returncode == KILLED


def calls_without_time_out(path: Path) -> list[int]:
    """Lines of a file in which a process is run to its end, however long that takes."""
    calls = [node for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))) if isinstance(node, ast.Call)]
    return [call.lineno for call in calls
            if ast.unparse(call.func) in ("subprocess.run", "subprocess.check_output", "subprocess.check_call")
            and "timeout" not in {keyword.arg for keyword in call.keywords}]  # fmt: skip


def test_every_program_that_is_run_to_its_end_has_a_time_out():
    """Those that tests run have that of the test (`tests/tiers/test_time_outs.py`)."""
    files = [path for folder in ("benchmarks", "rigid_env", "agents") for path in (ROOT / folder).rglob("*.py")]
    assert len(files) > 100
    assert {str(path): lines for path in files if (lines := calls_without_time_out(path))} == {}
