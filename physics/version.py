"""Version of rigid-env: of the source tree if it runs from one, else of the installed distribution."""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path

# Name of the distribution; the packages in it have other names.
NAME = "rigid-env"

UNKNOWN = "0+unknown"


@cache
def version() -> str:
    """Return the version of the distribution `NAME`: that of the source tree if there is one, else the installed one.

    If Python runs from a source tree, another version may be installed; so pyproject.toml comes first. `UNKNOWN` is
    returned where neither is found.
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
