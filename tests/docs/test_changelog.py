"""The changelog: one line an entry, and links that lead somewhere."""

from __future__ import annotations

import re
from pathlib import Path

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
LONGEST_ENTRY = 130  # characters


def test_each_line_is_blank_a_heading_or_an_entry():
    for line in PAGE.splitlines():
        is_entry = line.startswith("- ") and line.endswith(".") and len(line) <= LONGEST_ENTRY
        assert not line or re.match(r"#{1,4} \S", line) or is_entry, line


def test_links_lead_to_files():
    for path in re.findall(r"\]\(([^):#]+)\)", PAGE):
        assert (ROOT / path).exists(), path
