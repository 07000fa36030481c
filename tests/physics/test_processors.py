"""A container's quota counts: made-up files of control groups, of both versions."""

from __future__ import annotations

import math
import os
from pathlib import Path

import pytest

from physics.parallel import processors

V1, V2 = "5:memory:/\n4:cpu,cpuacct:{}\n1:name=systemd:/\n", "0::{}\n"


def made_up(root: Path, groups: str, files: dict[str, str]) -> Path:
    """A system in which the process is in these groups."""
    for name, text in {"proc/self/cgroup": groups, **files}.items():
        path = root / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text + "\n", encoding="utf-8")
    return root


@pytest.mark.parametrize(
    ("groups", "files", "share"),
    [
        (V2.format("/"), {}, math.inf),
        (V2.format("/"), {"sys/fs/cgroup/cpu.max": "max 100000"}, math.inf),
        (V2.format("/"), {"sys/fs/cgroup/cpu.max": "150000 100000"}, 1.5),
        (V2.format("/"), {"sys/fs/cgroup/unified/cpu.max": "50000 100000"}, 0.5),
        (V2.format("/a/b"), {"sys/fs/cgroup/a/b/cpu.max": "max 100000", "sys/fs/cgroup/a/cpu.max": "30 10"}, 3.0),
        (V2.format("/a/b"), {"sys/fs/cgroup/a/b/cpu.max": "10 10", "sys/fs/cgroup/a/cpu.max": "30 10"}, 1.0),
        (V2.format("/host/a"), {"sys/fs/cgroup/cpu.max": "20 10"}, 2.0),  # mounted at the container's own group
        (V2.format("/a"), {"sys/fs/cgroup/b/cpu.max": "20 10"}, math.inf),  # another group's
        (V2.format("/"), {"sys/fs/cgroup/cpu.max": "no number"}, math.inf),
        (V2.format("/"), {"sys/fs/cgroup/cpu.max": "10 0"}, math.inf),
        (
            V1.format("/box"),
            {
                "sys/fs/cgroup/cpu,cpuacct/box/cpu.cfs_quota_us": "250000",
                "sys/fs/cgroup/cpu,cpuacct/box/cpu.cfs_period_us": "100000",
            },
            2.5,
        ),
        (
            "1:cpu:/\n0::/\n",
            {"sys/fs/cgroup/cpu/cpu.cfs_quota_us": "-1", "sys/fs/cgroup/cpu/cpu.cfs_period_us": "100000"},
            math.inf,
        ),
        (
            "1:memory:/\n",
            {"sys/fs/cgroup/memory/cpu.cfs_quota_us": "1", "sys/fs/cgroup/memory/cpu.cfs_period_us": "1"},
            math.inf,
        ),
    ],
)
def test_quota(groups, files, share, tmp_path):
    assert processors.quota(made_up(tmp_path, groups, files)) == share


def test_no_control_groups(tmp_path):
    assert processors.quota(tmp_path) == math.inf


@pytest.mark.parametrize(("limit", "count"), [("max", 4), ("900000", 4), ("150000", 2), ("100000", 1), ("1000", 1)])
def test_affinity_and_quota_count(limit, count, tmp_path, monkeypatch):
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: {0, 2, 3, 5}, raising=False)
    root = made_up(tmp_path, V2.format("/"), {"sys/fs/cgroup/cpu.max": f"{limit} 100000"})
    assert processors.usable(root) == count


def test_giving_way_has_an_address():
    """On every system that the tests run on; without one a thread that waits only pauses."""
    assert processors.giving_way() != 0
