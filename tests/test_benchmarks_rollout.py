"""Rollouts and snapshots, measured: a quick run writes its rows, and both sides had the same bits."""

import json

import pytest
import typer
from typer.testing import CliRunner

from benchmarks import rollout


@pytest.mark.exhaustive
def test_a_quick_run_writes_what_it_found(tmp_path):
    app = typer.Typer()
    app.command()(rollout.main)
    found = CliRunner().invoke(app, ["--quick", "--json", str(tmp_path / "r.json")])
    assert found.exit_code == 0, found.output
    rows = {row["key"]: row for row in json.loads((tmp_path / "r.json").read_text())["rows"]}
    assert set(rows) == {
        "all_1_thread", "all_2_threads", "last_1_thread", "last_2_threads", "save_8", "save_over_8", "restore_8",
        "save_1", "save_over_1", "restore_1",
    }  # fmt: skip
    assert rows["all_1_thread"]["notes"]["bytes"] > rows["last_1_thread"]["notes"]["bytes"]


def test_both_sides_keep_the_same_bits():
    pair = rollout.Pair(rollout.QUICK, "balanced", 2, False)
    pair.rollout()
    pair.loop()
    assert pair.are_the_same()
    pair.wrenches[0, 0, 0, 0] += 1.0
    pair.loop()
    assert not pair.are_the_same()
