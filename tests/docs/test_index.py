"""The index of the pages lists each page and each decision, once."""

from __future__ import annotations

import re

from tests.docs.snippets import ROOT

INDEX = ROOT / "docs" / "README.md"
ENTRY = re.compile(r"\[([^]]+)\]\(([^)]+)\)")


def test_each_page_is_listed_once():
    listed = [target for _, target in ENTRY.findall(INDEX.read_text(encoding="utf-8")) if not target.startswith("..")]
    pages = {path.relative_to(INDEX.parent).as_posix() for path in INDEX.parent.rglob("*.md")} - {INDEX.name}
    of_environments = {page for page in pages if page.startswith("environments/")}  # their own list has these
    assert sorted(listed) == sorted(pages - of_environments | {"environments/README.md"})


def test_decisions_are_listed_by_their_titles_in_order():
    listed = [
        (title, target) for title, target in ENTRY.findall(INDEX.read_text(encoding="utf-8")) if "decisions/" in target
    ]
    records = sorted((INDEX.parent / "decisions").glob("*.md"))
    titles = [path.read_text(encoding="utf-8").splitlines()[0].removeprefix("# ") for path in records]
    assert listed == [(title, f"decisions/{path.name}") for title, path in zip(titles, records)]


def test_the_readme_leads_to_the_index():
    assert "(docs/README.md)" in (ROOT / "README.md").read_text(encoding="utf-8")
