"""Decision records: an imperative title, then Context, Decision and Consequences on one page, and whatever follows."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

RECORDS = sorted(Path(__file__).parents[2].glob("docs/decisions/[0-9]*.md"))
PAGE = 60  # lines of the three parts together


@pytest.mark.parametrize("path", RECORDS, ids=lambda path: path.stem)
def test_a_record_has_its_parts_in_order_on_one_page(path):
    text = path.read_text(encoding="utf-8")
    number = int(path.name.split("-")[0])
    assert text.startswith(f"# {number}. ")
    headings = re.findall(r"^## (.+)$", text, re.MULTILINE)
    assert headings[:3] == ["Context", "Decision", "Consequences"]
    end = text.find("\n## ", text.index("## Consequences") + 1)
    assert text.count("\n", 0, end if end >= 0 else len(text)) <= PAGE


def test_numbers_are_given_once_and_without_gaps():
    assert [int(path.name.split("-")[0]) for path in RECORDS] == list(range(1, len(RECORDS) + 1))
