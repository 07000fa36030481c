"""The page of hard cases, written from a result: tables, reasons and the command that made it."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
import typer
from typer.testing import CliRunner

from benchmarks import hard_cases_page, machine
from rigid_env.cli import app
from rigid_env.hard_cases import registry
from rigid_env.hard_cases.case import Case, Check, Setting
from rigid_env.lab.hard_cases.report import Report
from rigid_env.lab.hard_cases.run import Outcome, Status, run_case
from rigid_env.lab.measure.machine import write_json

ROOT = Path(__file__).parents[1]
RESULT = machine.RESULTS / "hard_cases.json"


def write_page(*arguments, code=0):
    program = typer.Typer()
    program.command()(hard_cases_page.main)
    found = CliRunner().invoke(program, [str(argument) for argument in arguments])
    assert found.exit_code == code, found.output
    return found.output


def holds(on: Setting):
    return [Check("a number", 1.0, 4.0, "m")]


def fails(on: Setting):
    return [Check("a number", 1.0, 4.0, "m"), Check("another", float("nan"), 4.0)]


def test_a_run_of_the_command_becomes_a_page(monkeypatch, tmp_path):
    cases = tuple(Case(k + 1, f"case-{k + 1}", "a case", "to hold", run) for k, run in enumerate((holds, fails)))
    monkeypatch.setattr(registry, "CASES", cases)
    result, page = tmp_path / "numbers.json", tmp_path / "docs" / "page.md"
    found = CliRunner().invoke(app, ["hard-cases", "--steps", "1e-3", "--json", str(result)])
    assert found.exit_code == 1, found.output
    write_page(result, page, "--picture", tmp_path / "docs" / "images" / "picture.png")
    content = page.read_text()
    assert f"rigid-env hard-cases 1 2 --accuracy balanced --steps 0.001 --json {result}" in content
    assert machine.headline(json.loads(result.read_text())["machine"]) in content
    assert "1 holds, 1 fails." in content
    assert "| 2 | `case-2`: a case | to hold | another: nan (≤ 4) | none | **fails** |" in content
    assert "- **2, case-2** (another: nan): not known yet." in content
    assert "| # | case | balanced, 1 ms | balanced, 10 ms |" in content
    assert "| 2 | case-2 | ✗ | ✗ |" in content
    assert "![Margin of every case at every step](images/picture.png)" in content


def test_other_engines_stand_beside_ours(monkeypatch, tmp_path):
    monkeypatch.setattr(registry, "CASES", (Case(1, "case-1", "a case", "to hold", holds, peers=True),))
    (case,), on = registry.find(), Setting()
    outcomes = [run_case(case, on), Outcome(case, "other", "default", 0.01, Status.FAILS, tuple(fails(on)))]
    result, page = tmp_path / "numbers.json", tmp_path / "page.md"
    write_json(result, Report((case,), outcomes=outcomes, is_complete=True).to_dict())
    write_page(result, page)
    content = page.read_text()
    assert "| # | case | rigid-env | other |" in content
    assert "| 1 | case-1 | ✓ balanced | ✗ another: nan (≤ 4) |" in content
    assert "--peers" in content.split("## Beside")[0]


def test_the_command_names_numbers_in_a_row_by_their_ends():
    report = Report(registry.find(("1", "2", "3", "5", "6", "9")), ("precise",), 0.02, is_thorough=False)
    line = "rigid-env hard-cases $(seq 1 3) 5 6 9 --accuracy precise --dt 0.02 --quick --json r.json"
    assert hard_cases_page.command(report, Path("r.json")) == line


def test_docs_have_the_tables_of_the_result_that_is_kept():
    report = hard_cases_page.read_report(json.loads(RESULT.read_text(encoding="utf-8")))
    page = (ROOT / "docs" / "hard-cases.md").read_text(encoding="utf-8")
    for table in (hard_cases_page.detail(report.details), hard_cases_page.grid(report.ours)):
        assert table in page


@pytest.mark.parametrize("name", ["hard_cases_peers", "hard_cases_one_body", "hard_cases_random"])
def test_results_that_are_kept_can_be_read(name, tmp_path):
    write_page(machine.RESULTS / f"{name}.json", tmp_path / "page.md")


def test_another_result_is_refused_by_name(tmp_path):
    output = write_page(machine.RESULTS / "tosses.json", tmp_path / "page.md", code=2)
    assert "hard-cases" in output
    assert not (tmp_path / "page.md").exists()
