"""Time of pictures: that every picture is drawn and measured. No test asserts a time."""

import json

import pytest
import typer
from typer.testing import CliRunner

from benchmarks import pixels

pytest.importorskip("pygame")


@pytest.mark.exhaustive
def test_a_quick_run_writes_what_it_found(tmp_path):
    app = typer.Typer()
    app.command()(pixels.main)
    found = CliRunner().invoke(app, ["--quick", "--json", str(tmp_path / "p.json")])
    assert found.exit_code == 0, found.output
    rows = json.loads((tmp_path / "p.json").read_text())["rows"]
    assert [row["key"] for row in rows] == ["observation", "video", "pile"]
    assert all(len(row["ours"]["samples"]) == pixels.QUICK_REPEATS for row in rows)
    assert [row["target"] for row in rows] == [1.0, None, 30.0]


@pytest.mark.interpreted
def test_the_pile_has_all_the_shapes():
    world = pixels.mixed_heap(1)
    assert {body.kind for body in world.scene.bodies} == {"block", "sphere", "ellipsoid"}
    assert world.body_count == pixels.BODIES
