"""`benchmarks.accuracy`: the program over `rigid_env.lab.measure.accuracy` writes what it measured."""

from __future__ import annotations

import json

import pytest
import typer
from typer.testing import CliRunner

from benchmarks import accuracy
from rigid_env.lab.measure.accuracy import QUICK


@pytest.mark.exhaustive
def test_the_program_writes_what_it_measured(tmp_path):
    app = typer.Typer()
    app.command()(accuracy.main)
    file = tmp_path / "accuracy.json"
    result = CliRunner().invoke(app, ["vertex", "--quick", "--json", str(file)])
    assert result.exit_code == 0, result.output
    found = json.loads(file.read_text())
    assert {"processor", "versions", "git"} <= set(found["machine"])
    rows = found["rows"]
    assert {row["case"] for row in rows} == {"vertex"}
    assert len(rows) == len(QUICK.accuracies) * len(QUICK.steps)
    assert all(row["us"] > 0 and row["error"] >= 0 for row in rows)
    assert CliRunner().invoke(app, ["nothing"]).exit_code != 0
    assert CliRunner().invoke(app, ["vertex", "--peers", "nobody"]).exit_code != 0
