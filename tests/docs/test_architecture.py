"""The map of the folders against the folders, and against the import contracts."""

from __future__ import annotations

import re
import sys
from pathlib import Path

import pytest

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")


def listed(heading: str) -> list[str]:
    """Folders in the table below a heading, from top to bottom."""
    part = PAGE.split(f"## {heading}", 1)[1].split("\n## ", 1)[0]
    return re.findall(r"^\| `(\w+)` \|", part, re.M)


@pytest.mark.parametrize(
    ("heading", "folder"),
    [("`physics`: ", "physics"), ("`physics/kernels`: ", "physics/kernels"), ("`rigid_env`", "rigid_env")],
)
def test_it_lists_every_folder_in_the_order_of_the_levels(heading, folder):
    folders = {path.parent.name for path in (ROOT / folder).glob("*/__init__.py")}
    assert set(listed(heading)) == folders
    contracts = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["importlinter"][
        "contracts"
    ]
    (levels,) = (each["layers"] for each in contracts if each.get("containers") == [folder.replace("/", ".")])
    assert listed(heading) == [name for name in levels if name in folders]


def test_files_that_it_names_are_there():
    named = re.findall(r"`((?:physics|rigid_env)/[\w/]+\.py)`", PAGE)
    assert len(named) >= 7
    assert [name for name in named if not (ROOT / name).is_file()] == []
