"""Results of the benchmarks: where they are kept, with the machine, the versions and the commit in each."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from rigid_env.lab.measure.machine import describe, write_json
from rigid_env.lab.measure.timing import Row

RESULTS = Path(__file__).parent / "results"


def keep(name: str, rows: list[Row], path: Path | None = None, **settings) -> Path:
    """Write rows as JSON, to ``results/<name>.json`` unless a path is given; returns the path."""
    path = Path(path) if path else RESULTS / f"{name}.json"
    write_json(path, {"name": name, "settings": settings, "rows": [row.to_dict() for row in rows]})
    return path


def headline(found: dict | None = None) -> str:
    """One line on a machine and a commit, to print over a table; by default those of this process.

    Parameters
    ----------
    found : dict, optional
        The ``machine`` of a result.
    """
    found = found or describe()
    git = found["git"]
    commit = "no commit" if git is None else git["commit"][:10] + (" + changes" if git["is_dirty"] else "")
    return f"{found['processor']}, {found['cores']} cores, Python {found['python']}, {commit}, {found['date']}"


def markdown_table(head: Sequence[str], rows: Sequence[Sequence]) -> str:
    """A table of a page; bars in cells are escaped."""
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join("| " + " | ".join(str(cell).replace("|", "\\|") for cell in line) + " |" for line in lines)
