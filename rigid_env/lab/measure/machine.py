"""Describe the machine and the versions of a measurement, for its result file."""

from __future__ import annotations

import datetime
import json
import math
import os
import platform
import subprocess
from importlib import metadata
from pathlib import Path

import physics
from physics.parallel import processors

PACKAGES = (
    "rigid-env", "numpy", "scipy", "numba", "llvmlite", "gymnasium", "mujoco", "pybullet", "drake",
    "pygame-ce", "stable-baselines3", "matplotlib",
)  # fmt: skip

# Changes in this folder of results do not count as changes of the checkout.
RESULTS = "benchmarks/results"
GIT = 60.0  # longest time of a git command; after that its result is left out [s]


def describe() -> dict:
    """Machine, versions of packages, commit and date, as a dict for JSON."""
    return {
        "date": datetime.datetime.now(datetime.timezone.utc).isoformat(timespec="seconds"),
        "system": platform.platform(),
        "processor": processor(),
        "cores": usable_cores(),
        "load_average": os.getloadavg()[0] if hasattr(os, "getloadavg") else None,
        "python": platform.python_version(),
        "versions": {name: version(name) for name in PACKAGES},
        "git": git_state(Path(physics.__file__).parent),
    }


def processor() -> str:
    """Name of the processor, from the system."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        return platform.processor()
    names = [line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.processor()


def usable_cores() -> int:
    """Number of cores that this process may use, by its affinity and the quota of its container."""
    return processors.usable()


def version(package: str) -> str | None:
    """Installed version of a distribution, or None if it is not installed."""
    try:
        return metadata.version(package)
    except metadata.PackageNotFoundError:
        return None


def git_state(folder: Path) -> dict | None:
    """Commit of the sources in `folder` and whether the checkout differs from it; None outside a checkout."""
    try:
        if not _git(folder, "ls-files", "__init__.py"):
            return None
        root = Path(_git(folder, "rev-parse", "--show-toplevel"))
        changes = _git(root, "status", "--porcelain", "--", ".", f":(exclude){RESULTS}")
        return {"commit": _git(root, "rev-parse", "HEAD"), "is_dirty": bool(changes)}
    except (OSError, subprocess.SubprocessError):
        return None


def _git(folder: Path, *arguments: str) -> str:
    command = ["git", "-C", str(folder), *arguments]
    done = subprocess.run(command, capture_output=True, text=True, check=True, timeout=GIT)
    return done.stdout.strip()


def write_json(path: str | Path | None, content: dict) -> None:
    """Write a result as JSON, with a description of the machine under ``machine``; makes missing folders.

    Numbers that are not finite become null, since JSON has none. Without a path nothing is written.
    """
    if path is None:
        return
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    text = json.dumps({**_finite(content), "machine": describe()}, indent=2, allow_nan=False)
    path.write_text(text + "\n", encoding="utf-8")


def _finite(content):
    """Copy of JSON content with None in place of numbers that are not finite."""
    if isinstance(content, dict):
        return {key: _finite(value) for key, value in content.items()}
    if isinstance(content, (list, tuple)):
        return [_finite(value) for value in content]
    return None if isinstance(content, float) and not math.isfinite(content) else content
