"""Models that others wrote: each file is of the kind that it is, and a scene that is another one is noticed."""

import json

import pytest
import typer
from typer.testing import CliRunner

import physics
from benchmarks import mjcf_files
from tests.physics.mjcf_texts import HILLS, HINGE, READ, box, floor, model

pytest.importorskip("mujoco", minversion="3.3.7")

FILES = {
    "a/read.xml": READ["keyframe"],
    "a/table.xml": model(box(), world='<geom name="t" type="hfield" hfield="h"/>', before=f"<asset>{HILLS}</asset>"),
    "b/bench.xml": model(
        box(), world=floor() + '<geom name="b" type="hfield" hfield="h"/>', before=f"<asset>{HILLS}</asset>"
    ),
    "b/leg.xml": model(box() + HINGE),
    "fixed.xml": f"<mujoco><worldbody>{floor()}</worldbody></mujoco>",
    "part.xml": "<mujocoinclude/>",
    "notes.txt": "no model",
}


@pytest.fixture
def folder(tmp_path):
    for name, text in FILES.items():
        path = tmp_path / "models" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
    return tmp_path / "models"


def run(*arguments):
    app = typer.Typer()
    app.command()(mjcf_files.main)
    found = CliRunner().invoke(app, [str(argument) for argument in arguments])
    assert found.exit_code == 0, found.output
    return found.output


def test_each_file_is_counted_once_with_its_reason(folder, tmp_path):
    output = run(folder, "--json", tmp_path / "found.json")
    assert "a/table.xml: line 4: <geom 't'> is a fixed hfield; allowed of the world are plane, box" in output
    assert "of 3 with free bodies alone 1 are read, 0 of them silently another" in output
    kept = json.loads((tmp_path / "found.json").read_text())
    assert kept["kinds"] == {"read": 1, "refused": 2, "other joints, too": 1, "no free body": 1, "no model": 1}
    assert kept["reasons"] == {"<geom> is a fixed hfield": 2}
    assert [row["file"] for row in kept["rows"]] == ["a/read.xml", "a/table.xml", "b/bench.xml"]
    assert str(tmp_path) not in (tmp_path / "found.json").read_text()


def test_a_scene_that_is_another_one_is_counted(folder, monkeypatch):
    other = physics.load_mjcf(folder / "a" / "read.xml")
    other = physics.Scene(other.bodies, other.walls, [physics.Gravity(), *other.effects[1:]])
    monkeypatch.setattr(mjcf_files.physics, "load_mjcf", lambda path: other)
    assert "3 are read, 3 of them silently another" in run(folder)
