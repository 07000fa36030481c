"""Building the wheel and the sdist of this checkout, and virtual environments to try them in."""

from __future__ import annotations

import os
import subprocess
import sys
import tarfile
import venv
import zipfile
from pathlib import Path

ROOT = Path(__file__).parents[2]
PACKAGES = ("physics", "rigid_env", "agents")

# Besides the packages, for tests, pages and measurements; `pyproject.toml` names them for the sdist.
SOURCE_FOLDERS = ("tests", "docs", "benchmarks", "examples")
SOURCE_FILES = ("README.md", "CHANGELOG.md", "LICENSE", "constraints.txt", "pyproject.toml")
MAYBE_THERE = (".ci", ".github")  # an installed sdist of an earlier version has none
LEFT_OUT = ("__pycache__", ".hypothesis", ".pytest_cache", ".ruff_cache")


def build(target: str, folder: Path, root: Path = ROOT) -> Path:
    """Build ``wheel`` or ``sdist`` of the sources in `root`, without the network."""
    done = subprocess.run(
        [sys.executable, "-m", "hatchling", "build", "-t", target, "-d", str(folder)],
        capture_output=True, text=True, cwd=root, timeout=300,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    (made,) = folder.glob("*.whl" if target == "wheel" else "*.tar.gz")
    return made


def files_of(archive: Path) -> set[str]:
    """Names in a wheel, or in an sdist without its first folder."""
    if archive.suffix == ".whl":
        with zipfile.ZipFile(archive) as content:
            return set(content.namelist())
    with tarfile.open(archive) as content:
        return {entry.name.partition("/")[2] for entry in content if entry.isfile()}


def files_in(*folders: str) -> set[str]:
    """Files of the checkout in these folders, caches left out."""
    found = (path for folder in folders for path in (ROOT / folder).rglob("*") if path.is_file())
    return {
        path.relative_to(ROOT).as_posix()
        for path in found
        if path.suffix != ".pyc" and not set(LEFT_OUT).intersection(path.relative_to(ROOT).parts)
    }


def unpack(sdist: Path, folder: Path) -> Path:
    """Unpack an sdist into a folder: the folder of its sources."""
    with tarfile.open(sdist) as content:
        if hasattr(tarfile, "data_filter"):
            content.extractall(folder, filter="data")
        else:
            content.extractall(folder)
    (made,) = folder.iterdir()
    return made


class Environment:
    """A virtual environment of its own, outside the repository, and an empty folder to work in.

    Parameters
    ----------
    folder : Path
        Where both are made.
    """

    def __init__(self, folder: Path):
        self.home, self.work = folder / "venv", folder / "work"
        venv.create(self.home, with_pip=True)
        self.work.mkdir(parents=True)
        self.programs = self.home / ("Scripts" if os.name == "nt" else "bin")

    def install(self, *words: str) -> None:
        """Install with the versions of `constraints.txt`."""
        constraints = str(ROOT / "constraints.txt")
        done = self.run("python", "-m", "pip", "install", "-q", "-c", constraints, *words, timeout=1800)
        assert done.returncode == 0, done.stderr[-3000:]

    def run(self, program: str, *words: str, timeout: float = 1200) -> subprocess.CompletedProcess:
        """Run a program of the environment in the empty folder; nothing of the checkout is on the path."""
        given = {**os.environ, "SDL_VIDEODRIVER": "dummy"}
        for name in ("PYTHONPATH", "VIRTUAL_ENV", "COLUMNS"):
            given.pop(name, None)
        return subprocess.run(
            [str(self.programs / program), *words],
            capture_output=True, text=True, cwd=self.work, env=given, timeout=timeout,
        )  # fmt: skip
