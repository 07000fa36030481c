"""Growing piles: the arithmetic of the exponent, and that what is counted is what is there. No test asserts a time."""

import json

import pytest
from typer.testing import CliRunner

from benchmarks import piles


def test_the_exponent_is_that_of_the_law_it_is_given():
    samples = [piles.Sample(n, float(n), 3e-6 * n**1.25) for n in (10, 100, 1000)]
    assert piles.exponent(samples) == pytest.approx(1.25, abs=1e-12)


def test_a_quick_run_writes_what_it_found(tmp_path):
    import typer

    app = typer.Typer()
    app.command()(piles.main)
    found = CliRunner().invoke(app, ["--quick", "--json", str(tmp_path / "p.json"), "--plot", str(tmp_path / "p.png")])
    assert found.exit_code == 0, found.output
    kept = json.loads((tmp_path / "p.json").read_text())
    assert [s["bodies"] for s in kept["broad_phase"]] == list(piles.QUICK_SPREADS)
    assert all(s["seconds"] > 0 for s in kept["piles"] + kept["falling"] + kept["broad_phase"])
    assert [s["steps"] for s in kept["falling"]] == [piles.QUICK_LIMIT] * 2  # what falls for less than 1 s lies not yet
    assert all(s["fastest"] > piles.LIES for s in kept["falling"])
    assert (tmp_path / "p.png").stat().st_size > 0


def test_a_pile_lies_once_nothing_of_it_was_fast_for_long_enough():
    falling, lying = piles.pile(2, 4000, "fast")
    assert piles.LIES_FOR < falling.steps < 4000
    assert falling.fastest <= piles.LIES
    assert lying.steps == piles.LIES_FOR
    assert lying.found >= 8.0  # two cubes flat on the floor, four corners each, or more where they touch
