"""Processors of this machine: number that the process may use, and addresses of system functions for its threads."""

from __future__ import annotations

import ctypes
import math
import os
from collections.abc import Iterator
from functools import cache
from pathlib import Path


def usable(root: Path = Path("/")) -> int:
    """Count the processors that the process may use at once, from its affinity and its container's quota.

    Parameters
    ----------
    root : Path
        Root of the file system, whose files of control groups are read.

    Returns
    -------
    int
        At least 1; a quota of one and a half processors counts as 2.
    """
    bound = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    share = quota(root)
    return bound if share >= bound else max(1, math.ceil(share))


def quota(root: Path = Path("/")) -> float:
    """Number of processors that Linux's control groups grant the process, possibly a fraction; inf without a limit.

    A group's limit holds for the groups inside it. Version 2 writes it in `cpu.max`, version 1 in `cpu.cfs_quota_us`.
    """
    return min((_share(folder) for folder in _groups(root)), default=math.inf)


def _groups(root: Path) -> Iterator[Path]:
    """Iterate over the folders of the control groups of the process, outer groups included."""
    mounts = root / "sys/fs/cgroup"
    for line in _text(root / "proc/self/cgroup").splitlines():
        _, names, place = line.split(":", 2)
        if names and "cpu" not in names.split(","):
            continue
        for name in (names, "cpu", "cpu,cpuacct") if names else ("", "unified"):
            base = mounts / name
            inner = base / place.lstrip("/")
            yield from (folder for folder in (inner, *inner.parents) if folder == base or base in folder.parents)


def _share(group: Path) -> float:
    """Number of processors that the limit of one control group grants; inf without a limit."""
    limit, period = (*_text(group / "cpu.max").split(), "", "")[:2]
    if not period:
        limit, period = _text(group / "cpu.cfs_quota_us"), _text(group / "cpu.cfs_period_us")
    try:
        share = int(limit) / int(period)
    except (ValueError, ZeroDivisionError):
        return math.inf
    return share if share > 0 else math.inf


def _text(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8").strip()
    except OSError:
        return ""


def giving_way() -> int:
    """Address of the system function that yields the processor to another thread; 0 if there is none."""
    return _address("SwitchToThread" if os.name == "nt" else "sched_yield")


def telling() -> int:
    """Address of the system function that returns the number of the calling thread's processor; 0 if there is none."""
    return _address("GetCurrentProcessorNumber" if os.name == "nt" else "sched_getcpu")


@cache
def _address(name: str) -> int:
    try:
        library = ctypes.WinDLL("kernel32") if os.name == "nt" else ctypes.CDLL(None)
        return ctypes.cast(getattr(library, name), ctypes.c_void_p).value or 0
    except (AttributeError, OSError):
        return 0
