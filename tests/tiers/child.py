"""Run tests in a process whose compiler is `python`; modules are handed to it one after another.

A line of JSON on its standard input names a module and its tests; a line of JSON on its standard output is the report
of one stage of one test.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from benchmarks.processes import killed_after, wait_for_end
from physics.compiler.compiler_choice import PYTHON, VARIABLE

SILENCE = 1600.0
"""Time without a report after which its process is killed [s]; the time-out of a test in pyproject.toml is shorter."""


class Child:
    """Hold such a process.

    Parameters
    ----------
    root : Path
        Folder of the project.
    """

    def __init__(self, root: Path):
        environment = {name: text for name, text in os.environ.items() if not name.startswith("PYTEST_")}
        environment[VARIABLE] = PYTHON
        self._process = subprocess.Popen(
            [sys.executable, "-m", "tests.tiers.child"],
            cwd=root,
            env=environment,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            encoding="utf-8",
        )

    def ask(self, module: str, tests: list[str], costs: str | None) -> None:
        """Have tests of a module run."""
        self._process.stdin.write(json.dumps({"module": module, "tests": tests, "costs": costs}) + "\n")
        self._process.stdin.flush()

    def read(self) -> dict | None:
        """Wait for the next report; None if the process has ended, or was killed after `SILENCE`."""
        with killed_after(self._process, SILENCE):
            line = self._process.stdout.readline()
        return json.loads(line) if line else None

    def end(self) -> None:
        """Let the process end; one that does not is killed."""
        self._process.stdin.close()
        self._process.stdout.close()
        wait_for_end(self._process)


class _Relay:
    """Select tests, and write each report as a line."""

    def __init__(self, tests: list[str], lines):
        self._tests, self._lines = set(tests), lines

    def pytest_collection_modifyitems(self, items):
        items[:] = [item for item in items if item.nodeid in self._tests]

    def pytest_configure(self, config):
        self._config = config

    def pytest_runtest_logreport(self, report):
        data = self._config.hook.pytest_report_to_serializable(config=self._config, report=report)
        self._lines.write(json.dumps(data) + "\n")
        self._lines.flush()


def serve() -> None:
    """Run what standard input asks for, until it is closed."""
    lines = os.fdopen(os.dup(sys.stdout.fileno()), "w", encoding="utf-8")
    sys.stdout.flush()
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)  # tests and pytest itself print as well
    asked = os.fdopen(os.dup(sys.stdin.fileno()), encoding="utf-8")
    for line in iter(asked.readline, ""):
        job = json.loads(line)
        costs = ["--costs", job["costs"]] if job["costs"] else []
        pytest.main([job["module"], "-p", "no:cacheprovider", *costs], plugins=[_Relay(job["tests"], lines)])


if __name__ == "__main__":
    serve()
