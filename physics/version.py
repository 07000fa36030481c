"""Version of the installed package, or of the sources."""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path

# Name of the distribution, which is not that of a package in it.
NAME = "rigid-env"

UNKNOWN = "0+unknown"


@cache
def version() -> str:
    """Version of `NAME`: from the sources' pyproject.toml if it lies beside this package, else from the installation.

    The sources come first: if they are on the path, an installed version may be another one.
    """
    return _of_sources(Path(__file__).parents[1] / "pyproject.toml") or _of_installation()


def _of_sources(path: Path) -> str | None:
    try:
        text = path.read_text(encoding="utf-8")
    except OSError:
        return None
    project = re.search(r"(?ms)^\[project\]$(.*?)(?=^\[|\Z)", text)
    found = dict(re.findall(r'(?m)^(name|version)\s*=\s*"([^"]*)"', project.group(1))) if project else {}
    return found.get("version") if found.get("name") == NAME else None


def _of_installation() -> str:
    from importlib import metadata  # not needed where the sources are

    try:
        return metadata.version(NAME)
    except metadata.PackageNotFoundError:
        return UNKNOWN
