"""The benchmark of rays: both engines see the same, and a difference is noticed."""

from __future__ import annotations

import json
import subprocess
import sys

import numpy as np
import pytest

pytest.importorskip("mujoco")

from benchmarks import machine, rays


@pytest.mark.parametrize("name", ["lidar", "scattered"])
def test_both_engines_hit_the_same_points(name):
    what, ways = rays.scene(), rays.directions(name)
    assert ways.shape == (rays.RAYS, 3)
    assert np.abs(np.linalg.norm(ways, axis=1) - 1).max() < 1e-15
    ours, theirs = rays.Ours(what, ways), rays.Theirs(what, ways)
    theirs.cast()
    found = rays.differences(ours, theirs)
    assert found["other_hits"] == 0
    assert 0.5 * rays.RAYS < found["hits"] < rays.RAYS
    assert found["distance"] <= rays.AGREEMENT
    assert found["normal"] <= 1e-6  # MuJoCo's normals of grazed ellipsoids


def test_another_hit_and_another_distance_are_noticed():
    what, ways = rays.scene(), rays.directions("scattered")
    ours, theirs = rays.Ours(what, ways), rays.Theirs(what, ways)
    theirs.cast()
    hit = int(np.flatnonzero(theirs.geom >= 0)[0])
    theirs.distance[hit] += 1e-6
    theirs.geom[np.flatnonzero(theirs.geom >= 0)[1]] = -1
    found = rays.differences(ours, theirs)
    assert found["other_hits"] == 1
    assert found["distance"] == pytest.approx(1e-6, rel=1e-3)


def test_the_page_has_the_numbers_of_the_kept_result():
    kept = json.loads((machine.RESULTS / "rays.json").read_text())
    page = (machine.RESULTS.parents[1] / "docs" / "queries.md").read_text(encoding="utf-8")
    for row in kept["rows"]:
        ours, peer, ratio = (row[name]["median"] for name in ("ours", "peer", "ratio"))
        assert f"| {ours / 1e6:.2f} | {peer / 1e6:.2f} | {ratio:.1f} |" in page
        assert row["notes"]["distance"] <= rays.AGREEMENT
        assert row["notes"]["other_hits"] == 0


@pytest.mark.exhaustive
def test_it_measures_and_writes(tmp_path):
    out = tmp_path / "rays.json"
    command = [sys.executable, "-m", "benchmarks.rays", "--repeats", "2", "--json", str(out)]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    found = json.loads(out.read_text())
    assert [row["key"] for row in found["rows"]] == ["lidar", "scattered"]
    assert all(row["ratio"]["median"] > 1 and row["notes"]["other_hits"] == 0 for row in found["rows"])
