"""Record the cost of each test: `python -m pytest --costs FILE`, then `python -m tests.costs FILE`.

A line of JSON for each test: its wall time and CPU time [s], the CPU time of processes that it started and that ended
[s], and the kernels it had compiled in its own process: their number, their CPU time [s], and the entry kernels among
them. `python -m tests.costs FILE` prints the sums by file, the longest tests, and the shares.
"""

from __future__ import annotations

import json
import resource
import sys
import time
from collections import Counter, defaultdict
from pathlib import Path

import pytest
from numba.core import event


class _Compilations(event.Listener):
    """Listen to Numba: kernels compiled, their CPU time, and the names of entry kernels."""

    def __init__(self):
        self.kernels, self.seconds, self.entries = 0, 0.0, Counter()
        self._depth, self._begun = 0, 0.0

    def on_start(self, what):
        """Count a kernel, and start the clock at the outermost."""
        self.kernels += 1
        self._depth += 1
        if self._depth == 1:
            self._begun = time.process_time()
            self.entries[what.data["dispatcher"].py_func.__name__] += 1

    def on_end(self, what):
        """Stop the clock."""
        self._depth -= 1
        if self._depth == 0:
            self.seconds += time.process_time() - self._begun


STEPS = ("step_worlds", "step_events", "step_linked", "step_many")
"""Entry kernels of a step: each compilation of one is a plan."""


def _child_seconds() -> float:
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


class CostRecorder:
    """Append a line to `path` for each test."""

    def __init__(self, path: Path):
        self._path = path

    @pytest.hookimpl(wrapper=True, tryfirst=True)
    def pytest_runtest_protocol(self, item, nextitem):
        """Run a test with its fixtures, and write down its cost."""
        compilations = _Compilations()
        event.register("numba:compile", compilations)
        begun = time.perf_counter(), time.process_time(), _child_seconds()
        try:
            outcome = yield
        finally:
            event.unregister("numba:compile", compilations)
        if not getattr(item, "is_relayed", False):  # else its own process writes the line
            self._write(item.nodeid, begun, compilations)
        return outcome

    def _write(self, test: str, begun: tuple[float, float, float], compilations: _Compilations) -> None:
        line = {
            "test": test,
            "wall": round(time.perf_counter() - begun[0], 3),
            "cpu": round(time.process_time() - begun[1], 3),
            "children": round(_child_seconds() - begun[2], 3),
            "kernels": compilations.kernels,
            "compiling": round(compilations.seconds, 3),
            "entries": dict(compilations.entries),
        }
        with self._path.open("a", encoding="utf-8") as file:
            file.write(json.dumps(line) + "\n")


def report(path: Path, longest: int = 40) -> None:
    """Print sums by file and the longest tests of a recorded run."""
    rows = [json.loads(line) for line in path.read_text(encoding="utf-8").splitlines()]
    files: dict[str, list[dict]] = defaultdict(list)
    for row in rows:
        files[row["test"].split("::")[0]].append(row)

    def show(name: str, of: list[dict]) -> None:
        wall, cpu, children, compiling = (
            sum(row[key] for row in of) for key in ("wall", "cpu", "children", "compiling")
        )
        entries = sum(sum(row["entries"].values()) for row in of)
        print(f"{wall:8.1f} {cpu:8.1f} {children:8.1f} {compiling:9.1f} {entries:7d} {len(of):6d}  {name}")

    plans = sum(row["entries"].get(name, 0) for row in rows for name in STEPS)
    print(f"{plans} plans were compiled in the processes of tests")
    print("    wall      cpu children compiling entries  tests")
    show("all", rows)
    for name, of in sorted(files.items(), key=lambda pair: -sum(row["wall"] for row in pair[1])):
        show(name, of)
    print(f"\nthe {longest} longest tests")
    for row in sorted(rows, key=lambda row: -row["wall"])[:longest]:
        show(row["test"], [row])


if __name__ == "__main__":
    report(Path(sys.argv[1]), *map(int, sys.argv[2:]))
