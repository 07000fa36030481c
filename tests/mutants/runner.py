"""Run tests in copies of the sources, with a fault in them or without."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
import time
import xml.etree.ElementTree as ET
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from pathlib import Path
from queue import SimpleQueue
from typing import NamedTuple, TypeVar

from tests.mutants.mutant import ROOT, Mutant
from tests.mutants.results import BROKEN, KILLED, SURVIVED

T = TypeVar("T")

TIME_LIMIT = 600.0  # of the tests of one mutant [s]

# Beginnings of a failed assertion in pytest's report; any other exception may be a mutant that does not compile.
ASSERTIONS = ("AssertionError", "assert ", "Failed: ", "ExceptionGroup", "exceptiongroup.ExceptionGroup")

_PASSED, _FAILED = 0, 1  # exit statuses of pytest


class Verdict(NamedTuple):
    """Fate of a mutant: `KILLED`, `SURVIVED` or `BROKEN`, in how many seconds, and why."""

    verdict: str
    seconds: float
    reason: str


class Outcome(NamedTuple):
    """Result of a run of pytest: exit status, tests that were run, message of the first failure, and its output."""

    status: int
    ran: int
    failure: str
    output: str


class Copy:
    """Copy of the files that git tracks or does not ignore, with its own folder of compiled kernels.

    Parameters
    ----------
    folder : Path
    """

    def __init__(self, folder: Path):
        self._folder, self._process, self.is_stopped = folder, None, False
        command = ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"]
        listed = subprocess.run(
            command, cwd=ROOT, capture_output=True, check=True, text=True, timeout=TIME_LIMIT
        ).stdout
        for name in filter(None, listed.split("\0")):
            if (ROOT / name).is_file():
                (folder / name).parent.mkdir(parents=True, exist_ok=True)
                shutil.copy2(ROOT / name, folder / name)

    def judge(self, mutant: Mutant) -> Verdict:
        """Run the tests of a mutant with its fault; the copy is then as before."""
        path, begun = self._folder / mutant.path, time.perf_counter()
        before = path.read_text(encoding="utf-8")
        try:
            path.write_text(mutant.mutated(before), encoding="utf-8")
            verdict, reason = verdict_of(self.run(mutant.tests))
        except ValueError as error:
            verdict, reason = BROKEN, str(error)
        finally:
            path.write_text(before, encoding="utf-8")
        return Verdict(verdict, time.perf_counter() - begun, reason)

    def run(self, tests: Iterable[str]) -> Outcome:
        """Run tests up to the first that fails."""
        report = self._folder / "report.xml"
        report.unlink(missing_ok=True)
        command = [
            sys.executable, "-m", "pytest", "-x", "-q", "-p", "no:cacheprovider", "-p", "tests.mutants.no_shrinking",
            f"--junitxml={report}",
        ]  # fmt: skip
        # Bytecode is told apart by size and second of its source: a mutant would run that of the one before.
        environment = {
            **os.environ, "PYTHONPATH": str(self._folder), "NUMBA_CACHE_DIR": str(self._folder / "numba"),
            "PYTHONDONTWRITEBYTECODE": "1", "SDL_VIDEODRIVER": "dummy",
        }  # fmt: skip
        environment.pop("RIGID_ENV_COMPILER", None)
        self._process = subprocess.Popen(
            [*command, *tests], cwd=self._folder, env=environment, text=True, start_new_session=True,
            stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
        )  # fmt: skip
        if self.is_stopped:
            self.stop()
        try:
            output, _ = self._process.communicate(timeout=TIME_LIMIT)
        except subprocess.TimeoutExpired:
            self._kill()
            self._process.communicate()
            output = f"no end within {TIME_LIMIT:.0f} s"
        return Outcome(self._process.returncode, *_read_report(report), output)

    def stop(self) -> None:
        """End the tests that are running."""
        self.is_stopped = True
        if self._process is not None and self._process.poll() is None:
            self._kill()

    def _kill(self) -> None:
        with suppress(ProcessLookupError):
            os.killpg(self._process.pid, signal.SIGKILL)


def _read_report(path: Path) -> tuple[int, str]:
    """Number of tests that were run, and the message of the first failure in a report of pytest."""
    if not path.exists():
        return 0, ""
    cases = list(ET.parse(path).getroot().iter("testcase"))
    failures = [failure.get("message", "") for case in cases for failure in case.iter("failure")]
    return sum(case.find("skipped") is None for case in cases), failures[0] if failures else ""


def verdict_of(outcome: Outcome) -> tuple[str, str]:
    """Verdict and reason; only a failed assertion kills."""
    lines = outcome.output.strip().splitlines()
    last = lines[-1] if lines else "no output"
    if outcome.status == _PASSED:
        return (SURVIVED, "all tests passed") if outcome.ran else (BROKEN, f"no test ran: {last}")
    if outcome.status == _FAILED and outcome.failure.startswith(ASSERTIONS):
        return KILLED, outcome.failure.splitlines()[0][:120]
    return BROKEN, f"exit status {outcome.status}: {(outcome.failure or last).splitlines()[0][:200]}"


def in_copies(work: Callable[[Copy, T], None], items: Sequence[T], jobs: int, folder: Path) -> None:
    """Call `work` for each item with one of `jobs` copies under `folder`; Ctrl-C ends the tests that are running."""
    if not items:
        return
    copies = [Copy(folder / str(k)) for k in range(min(jobs, len(items)))]
    idle: SimpleQueue[Copy] = SimpleQueue()
    for copy in copies:
        idle.put(copy)

    def with_copy(item: T) -> None:
        copy = idle.get()
        try:
            work(copy, item)
        finally:
            idle.put(copy)

    pool = ThreadPoolExecutor(len(copies))
    try:
        for done in [pool.submit(with_copy, item) for item in items]:
            done.result()
    except BaseException:
        pool.shutdown(wait=False, cancel_futures=True)
        for copy in copies:
            copy.stop()
        raise
    finally:
        pool.shutdown()
