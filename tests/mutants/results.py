"""Verdicts that are kept from run to run, by mutant and digest."""

from __future__ import annotations

import json
import threading
from pathlib import Path

from rigid_env.terminal import Column, Table, number_columns
from tests.mutants.mutant import ROOT, Mutant

KILLED, SURVIVED, BROKEN = "killed", "survived", "broken"

FILE = ROOT / "benchmarks" / "results" / "mutants.json"


class Results:
    """Verdicts in a file, which is whole at any time.

    Parameters
    ----------
    path : Path
    """

    def __init__(self, path: Path = FILE):
        self._path, self._lock = path, threading.Lock()
        self.rows: dict[str, dict] = json.loads(path.read_text(encoding="utf-8"))["rows"] if path.exists() else {}

    def of(self, mutant: Mutant) -> dict | None:
        """Return the kept row of a mutant; None where mutant, source or tests have changed since."""
        row = self.rows.get(mutant.name)
        return row if row is not None and row["digest"] == mutant.digest() else None

    def keep(self, mutant: Mutant, verdict: str, seconds: float, reason: str) -> None:
        """Write down a verdict."""
        row = {"digest": mutant.digest(), "verdict": verdict, "seconds": round(seconds, 1), "reason": reason}
        with self._lock:
            self.rows[mutant.name] = row
            self._write()

    def forget_others(self, names: set[str]) -> None:
        """Drop the rows of mutants that are no longer in the list."""
        with self._lock:
            if gone := self.rows.keys() - names:
                self.rows = {name: row for name, row in self.rows.items() if name not in gone}
                self._write()

    def _write(self) -> None:
        rows = dict(sorted(self.rows.items()))
        partial = self._path.with_suffix(".partial")
        partial.write_text(json.dumps({"name": "mutants", "rows": rows}, indent=1) + "\n", encoding="utf-8")
        partial.replace(self._path)

    def table(self, mutants: list[Mutant]) -> Table:
        """Make a table of mutants with their verdicts."""
        rows = [self.of(mutant) for mutant in mutants]
        counts = {verdict: sum(row is not None and row["verdict"] == verdict for row in rows)
                  for verdict in (KILLED, SURVIVED, BROKEN)}  # fmt: skip
        counts["not run"] = rows.count(None)
        seconds = sum(row["seconds"] for row in rows if row is not None)
        caption = f"{len(mutants)} mutants: " + ", ".join(f"{count} {name}" for name, count in counts.items())
        columns = [Column("mutant", is_whole=True), Column("verdict", is_whole=True), *number_columns("s"), "fault"]
        found = Table(columns, "mutants", f"{caption}; {seconds:.0f} s")
        for mutant, row in zip(mutants, rows):
            verdict, took = ("not run", "") if row is None else (row["verdict"], f"{row['seconds']:.1f}")
            found.add_row(mutant.name, verdict, took, mutant.fault)
        return found
