"""The glossary against the tree: paths, identifiers, sources, and the order of its terms."""

from __future__ import annotations

import ast
import re
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
PAGE = (DOCS / "glossary.md").read_text(encoding="utf-8")
STAGES = (
    "broad phase",
    "narrow phase",
    "time of impact",
    "friction cone projection",
    "Delassus matrix",
    "warm start",
    "restitution",
    "midpoint step",
    "position correction",
    "free rotation",
    "island",
    "sleeping",
)
LONGEST_MEANING = 25  # words


def tables() -> dict[str, list[list[str]]]:
    """Rows of the table below each heading, as lists of cells, without the two lines of its head."""
    found = {}
    for part in PAGE.split("\n## ")[1:]:
        heading, _, text = part.partition("\n")
        lines = [line for line in text.splitlines() if line.startswith("|")]
        found[heading] = [[cell.strip() for cell in re.split(r"(?<!\\)\|", line)[1:-1]] for line in lines[2:]]
    return found


TABLES = tables()
SUBJECTS = {heading: rows for heading, rows in TABLES.items() if rows and len(rows[0]) == 5}
ROWS = [row for rows in SUBJECTS.values() for row in rows]


def paths_and_names(cell: str) -> tuple[list[str], list[str]]:
    """Paths and identifiers in the backticks of a cell."""
    quoted = re.findall(r"`([^`]+)`", cell)
    return [text for text in quoted if "/" in text], [text for text in quoted if "/" not in text]


@cache
def names_defined(path: str) -> frozenset[str]:
    """Functions, classes, constants and members that a file defines."""
    found = set()
    for node in ast.walk(ast.parse((ROOT / path).read_text(encoding="utf-8"))):
        if isinstance(node, (ast.FunctionDef, ast.ClassDef)):
            found.add(node.name)
        elif isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
            found.add(node.id)
    return frozenset(found)


def test_every_subject_has_a_table_of_five_columns():
    assert len(SUBJECTS) == 8
    assert all(len(row) == 5 and all(row) for row in ROWS)


def test_paths_are_there():
    named = re.findall(r"`((?:physics|rigid_env|agents|benchmarks)/[\w/.]+)`", PAGE)
    assert len(named) > len(ROWS)
    assert [path for path in named if not (ROOT / path).exists()] == []


@pytest.mark.parametrize("row", ROWS, ids=lambda row: row[0])
def test_a_term_has_a_file_that_defines_the_names_beside_it(row):
    paths, names = paths_and_names(row[3])
    assert paths
    assert [name for name in names if not any(name in names_defined(path) for path in paths)] == []


def test_terms_are_unique_and_sorted_in_their_table():
    terms = [row[0].casefold() for row in ROWS]
    assert [term for term in terms if terms.count(term) > 1] == []
    for rows in [*SUBJECTS.values(), TABLES["Sources"]]:
        first = [row[0].casefold() for row in rows]
        assert first == sorted(first)


def test_meanings_are_short():
    assert [row[0] for row in ROWS if len(row[2].split()) > LONGEST_MEANING] == []


def is_known(source: str) -> bool:
    """True if a source is in the list, or is a section of the theory, a decision or a page."""
    if found := re.fullmatch(r"theory §(\d+)", source):
        return f"\n## {found[1]}. " in (DOCS / "theory.md").read_text(encoding="utf-8")
    if found := re.fullmatch(r"decision (\d+)", source):
        return len(list((DOCS / "decisions").glob(f"{int(found[1]):04}-*.md"))) == 1
    if source.startswith("docs/"):
        return (ROOT / source).is_file()
    work = re.sub(r", (?:[IV]+ )?(?:§|ch\. )[\w.]+$", "", source)
    return work in [row[0] for row in TABLES["Sources"]]


def test_every_term_has_a_known_source_and_every_source_a_term():
    cited = {source for row in ROWS for source in row[4].split("; ")}
    assert [source for source in cited if not is_known(source)] == []
    assert [row[0] for row in TABLES["Sources"] if not any(source.startswith(row[0]) for source in cited)] == []


@pytest.mark.parametrize("stage", STAGES)
def test_a_stage_is_found(stage):
    """In the first table with a kernel in each of its files, and in the glossary with the same."""
    (found,) = (row for row in TABLES["Find a stage of a step"] if row[0] == stage)
    (term,) = (row for row in ROWS if row[0] == stage)
    kernels = re.findall(r"`([\w/.]+)` `(\w+)`", " ".join(found[1:]))
    assert kernels
    assert [path for path, name in kernels if name not in names_defined(path)] == []
    paths, names = paths_and_names(term[3])
    assert [kernel for kernel in kernels if kernel[0] not in paths or kernel[1] not in names] == []
