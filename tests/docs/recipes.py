"""Recipes of `docs/extending.md`, carried out from their text on a copy of the packages.

A Python block that begins with ``# new file: PATH`` is that file, and one that begins with ``# proof.py`` the program
that proves the recipe. A diff block begins with ``--- PATH``; its hunks, between lines ``@@``, have no line numbers:
what a hunk keeps and takes away stands exactly once in the file.
"""

from __future__ import annotations

import re
import shutil
from pathlib import Path

from tests.docs.snippets import ROOT

PAGE = ROOT / "docs" / "extending.md"
PACKAGES = ("physics", "rigid_env", "agents")
NEW_FILE = "# new file: "
PROOF = "# proof.py"
BLOCK = re.compile(r"^```(python|diff)\n(.*?)^```$", re.MULTILINE | re.DOTALL)


def titles() -> list[str]:
    """Headings of the recipes, in their order."""
    return re.findall(r"^## (Recipe .+)$", PAGE.read_text(encoding="utf-8"), re.MULTILINE)


def text_of(title: str) -> str:
    """Text of a recipe, from its heading to the next one."""
    return PAGE.read_text(encoding="utf-8").split(f"\n## {title}\n", 1)[1].split("\n## ", 1)[0]


def copy_packages(folder: Path) -> None:
    """Copy the sources of the packages into a folder."""
    for name in PACKAGES:
        shutil.copytree(ROOT / name, folder / name, ignore=shutil.ignore_patterns("__pycache__"))


def apply(title: str, folder: Path) -> list[str]:
    """Carry out a recipe in a copy of the packages: the paths that it writes."""
    paths = []
    for language, code in BLOCK.findall(text_of(title)):
        first, _, rest = code.partition("\n")
        if language == "diff":
            path = first.removeprefix("--- ")
            write(folder / path, changed((folder / path).read_text(encoding="utf-8"), rest, path))
        elif first.startswith(NEW_FILE):
            path = first.removeprefix(NEW_FILE)
            assert not (folder / path).exists(), f"{path} is there already"
            write(folder / path, rest)
        else:
            continue
        paths.append(path)
    return paths


def write(path: Path, text: str) -> None:
    """Write a source file."""
    path.write_text(text, encoding="utf-8")


def changed(text: str, hunks: str, path: str) -> str:
    """A file's text with the hunks of a diff applied."""
    for hunk in hunks.split("@@\n"):
        lines = [line or " " for line in hunk.splitlines()]
        old = "".join(f"{line[1:]}\n" for line in lines if line[0] in " -")
        new = "".join(f"{line[1:]}\n" for line in lines if line[0] in " +")
        places = [match.start() for match in re.finditer(f"^{re.escape(old)}", text, re.MULTILINE)]
        assert len(places) == 1, f"{path} has {len(places)} places of\n{old}"
        text = text[: places[0]] + new + text[places[0] + len(old) :]
    return text


def proof(title: str) -> str:
    """The program that proves a recipe."""
    (code,) = [code for _, code in BLOCK.findall(text_of(title)) if code.startswith(PROOF)]
    return code
