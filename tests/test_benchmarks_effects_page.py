"""The table of costs in a page, written from a result of `rigid-env effects`."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
import typer
from typer.testing import CliRunner

from benchmarks import effects_page, machine

ROOT = Path(__file__).parents[1]
RESULT = machine.RESULTS / "effects.json"
BEGIN, END = effects_page.BEGIN, effects_page.END


def run(*arguments, code=0):
    program = typer.Typer()
    program.command()(effects_page.main)
    found = CliRunner().invoke(program, [str(argument) for argument in arguments])
    assert found.exit_code == code, found.output
    return " ".join(found.output.replace("│", " ").split())


def test_the_table_takes_the_place_of_the_old_one(tmp_path):
    page = tmp_path / "page.md"
    page.write_text(f"before\n{BEGIN}\nold\n{END}\nafter\n")
    run(RESULT, page)
    text = page.read_text()
    assert text.startswith(f"before\n{BEGIN}\n")
    assert text.endswith(f"{END}\nafter\n")
    assert "old" not in text
    row = next(row for row in json.loads(RESULT.read_text())["rows"] if row["key"] == "drag")
    alone, added = 1e9 / row["peer"]["median"], row["notes"]["added_ns_per_step"]
    assert f"| drag | {alone:.0f} | {added:.0f} | 16 |" in text


def test_docs_have_the_times_of_the_result_that_is_kept():
    """Bytes follow the layout of parameters, and are counted by tests."""
    table = effects_page.table(json.loads(RESULT.read_text(encoding="utf-8"))["rows"])
    page = (ROOT / "docs" / "effects.md").read_text(encoding="utf-8")
    part = page.split(BEGIN)[1].split(END)[0]
    assert [line.split("|")[:4] for line in table.splitlines()] == [
        line.split("|")[:4] for line in part.splitlines() if line.startswith("|")
    ]


@pytest.mark.parametrize("lacking", ["lines", "an effect"])
def test_a_page_that_would_lose_something_is_left_alone(lacking, tmp_path):
    page, result = tmp_path / "page.md", tmp_path / "some.json"
    page.write_text("no such lines" if lacking == "lines" else f"{BEGIN}\nkept\n{END}\n")
    content = json.loads(RESULT.read_text())
    result.write_text(json.dumps({"rows": content["rows"][1:]} if lacking == "an effect" else content))
    before = page.read_text()
    output = run(result, page, code=2)
    assert ("pages with the lines" if lacking == "lines" else "without gravity; a page is written for all") in output
    assert page.read_text() == before
