"""Code blocks of the README and the pages of `docs`, and the comments that say which are not run.

A comment before a block, ``<!-- not run: REASON -->``, keeps it from being run.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

import pytest

from tests import prepared

ROOT = Path(__file__).parents[2]
PAGES = (ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md")))
BLOCK = re.compile(r"^```(\w+)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
SKIP = re.compile(r"<!-- not run: (.+?) -->\s*\Z")


@dataclass(frozen=True)
class Block:
    """A block of a page.

    Attributes
    ----------
    page : Path
    line : int
        Of its first line of code, counted from 1.
    language, code : str
    skipped : str
        Why it is not run; "" if it is.
    """

    page: Path
    line: int
    language: str
    code: str
    skipped: str


def blocks(page: Path, language: str) -> list[Block]:
    """The blocks of a page in a language, in their order."""
    text = page.read_text(encoding="utf-8")
    found = []
    for match in BLOCK.finditer(text):
        if match[1] == language:
            skip = SKIP.search(text, 0, match.start())
            line = text.count("\n", 0, match.start(2)) + 1
            found.append(Block(page, line, match[1], match[2], skip[1] if skip else ""))
    return found


def program(page: Path) -> str:
    """The blocks of a page, each on its own lines of the page, so that an error names the line in it."""
    lines: list[str] = []
    for block in blocks(page, "python"):
        if not block.skipped:
            lines += [""] * (block.line - 1 - len(lines)) + block.code.splitlines()
    return "\n".join(lines) + "\n"


def run(code: str, page: Path, folder: Path) -> None:
    """Run code of a page in a new process, in an empty folder within `folder`; it must end without an error."""
    if "stable_baselines3" in code:
        pytest.importorskip("stable_baselines3")
    (empty := folder / "empty").mkdir()
    file = folder / page.name.replace(".md", ".py")
    file.write_text(code, encoding="utf-8")
    status, output = prepared.run(file, empty)
    assert status == 0, f"{name_of(page)}:\n{output}"


def links(page: Path) -> list[str]:
    """Links and pictures of a page that lead to files, without the place in them."""
    text = BLOCK.sub("", page.read_text(encoding="utf-8"))
    targets = re.findall(r"\]\(([^)\s]+)\)", text)
    return [target.partition("#")[0] for target in targets if not re.match(r"[a-z]+:|#", target)]


def pages_with(language: str) -> list[Path]:
    """Pages that have a block in a language."""
    return [page for page in PAGES if blocks(page, language)]


def name_of(page: Path) -> str:
    """A page as the tests call it."""
    return page.relative_to(ROOT).as_posix()
