"""The comparison of two commits: a commit equals itself, and a changed number is found."""

import json
import shutil
from pathlib import Path

import pytest
import typer
from typer.testing import CliRunner

from benchmarks import bit_scenes, same_bits

ROOT = Path(__file__).parents[1]


def run(*arguments):
    app = typer.Typer()
    app.command()(same_bits.main)
    return CliRunner().invoke(app, ["--scene", "kick", "--preset", "fast", "--steps", "25", *map(str, arguments)])


@pytest.mark.exhaustive
def test_a_commit_has_the_bits_of_itself(tmp_path):
    found = run(ROOT, "--json", tmp_path / "bits.json")
    assert found.exit_code == 0, found.output
    assert "1 of 1 runs of 25 steps have the same bits" in found.output
    assert json.loads((tmp_path / "bits.json").read_text())["runs"] == {"kick fast": "same"}


@pytest.mark.exhaustive
def test_another_density_of_the_air_is_another_result(tmp_path):
    shutil.copytree(ROOT / "physics", tmp_path / "physics", ignore=shutil.ignore_patterns("__pycache__"))
    fields = tmp_path / "physics" / "scene" / "force_fields.py"
    text = fields.read_text()
    assert "AIR_DENSITY = 1.225" in text
    fields.write_text(text.replace("AIR_DENSITY = 1.225", "AIR_DENSITY = 1.2250001"))
    found = run(tmp_path)
    assert found.exit_code == 1, found.output
    assert "kick fast: differs by" in found.output


def test_a_run_that_ends_with_an_error_is_told_from_one_that_does_not():
    state = {"digest": "a", "state": [1.0]}
    assert same_bits.verdict(state, {"error": "ValueError"}) == "runs, was ValueError"
    assert same_bits.verdict({"error": "ValueError"}, {"error": "ValueError"}) == "same"


def test_every_scene_is_accepted():
    assert len(bit_scenes.SCENES) == 24
    for make in bit_scenes.SCENES.values():
        make()
