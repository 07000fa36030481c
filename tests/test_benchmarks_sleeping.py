"""Sleep and flight, measured: that what is compared is what the rows say. No test asserts a time."""

import json

import pytest
import typer
from typer.testing import CliRunner

from benchmarks import sleeping


@pytest.mark.exhaustive
def test_a_quick_run_writes_what_it_found(tmp_path):
    app = typer.Typer()
    app.command()(sleeping.main)
    found = CliRunner().invoke(app, ["--quick", "--accuracy", "fast", "--json", str(tmp_path / "s.json")])
    assert found.exit_code == 0, found.output
    rows = {row["key"]: row for row in json.loads((tmp_path / "s.json").read_text())["rows"]}
    assert set(rows) == {
        "tower_10_in_one_call", "tower_10_a_call_each", "tower_50_in_one_call", "tower_50_a_call_each", "bare_flight",
        "large_box",
    }  # fmt: skip
    assert rows["bare_flight"]["notes"]["contacts"] == {"bare": 0, "in a large box": 0, "near walls": 0}


@pytest.mark.interpreted
def test_the_narrow_box_is_one_that_cannot_be_left_out_and_is_never_met():
    world = sleeping.flights("fast")["near walls"]
    radius = float(world.scene.bodies[0].bounding_radius(world.scene.bodies[0].dimensions))
    for _ in range(400):
        report = world.step(steps=5)
        assert abs(world.pos[0, 0, 0]) < 1e-9
        assert report.solves == 0
    assert 2.5**2 + 1.5**2 < sleeping.NARROW**2 < radius**2
