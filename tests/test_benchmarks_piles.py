"""Growing piles: the arithmetic of the exponent, and that what is counted is what is there. No test asserts a time."""

import json

import pytest
import typer
from typer.testing import CliRunner

from benchmarks import piles, settling
from physics import scenes


def test_the_exponent_is_that_of_the_law_it_is_given():
    samples = [settling.Sample(n, float(n), 3e-6 * n**1.25) for n in (10, 100, 1000)]
    assert piles.exponent(samples) == pytest.approx(1.25, abs=1e-12)


def run(*arguments):
    app = typer.Typer()
    app.command()(piles.main)
    return CliRunner().invoke(app, ["--quick", *arguments])


@pytest.mark.exhaustive
def test_a_quick_run_writes_what_it_found(tmp_path):
    found = run("--json", str(tmp_path / "p.json"), "--plot", str(tmp_path / "p.png"))
    assert found.exit_code == 0, found.output
    kept = json.loads((tmp_path / "p.json").read_text())
    assert [s["bodies"] for s in kept["broad_phase"]] == list(piles.QUICK_SPREADS)
    assert all(s["seconds"] > 0 for s in kept["piles"] + kept["falling"] + kept["broad_phase"])
    assert [s["steps"] for s in kept["falling"]] == [piles.QUICK_LIMIT] * 2  # what falls for less than 1 s lies not yet
    assert all(s["fastest"] > settling.LIES for s in kept["falling"])
    assert set(kept["exponents"]) == {"piles", "falling", "broad_phase"}
    assert (tmp_path / "p.png").stat().st_size > 0


def test_the_peer_takes_the_same_steps_of_the_same_piles(tmp_path):
    pytest.importorskip("mujoco")
    found = run("--peer", "--json", str(tmp_path / "p.json"), "--plot", str(tmp_path / "p.png"))
    assert found.exit_code == 0, found.output
    kept = json.loads((tmp_path / "p.json").read_text())
    assert set(kept["peers"]) == {f"MuJoCo, {solver}" for solver in piles.SOLVERS}
    for peer in kept["peers"].values():
        assert set(peer["exponents"]) == {"piles", "falling"}
        for kind in ("piles", "falling"):
            assert [s["bodies"] for s in peer[kind]] == list(piles.QUICK_PILES)
            assert [s["steps"] for s in peer[kind]] == [s["steps"] for s in kept[kind]]
        # From the second of 3 s on nearly all of them are on the floor, four corners each, in both engines.
        assert all(s["found"] >= 3.5 * s["bodies"] for s in peer["piles"])
        assert all(s["unconverged"] is None for s in peer["piles"])


def test_without_mujoco_the_peer_is_refused_before_anything_is_measured(monkeypatch):
    monkeypatch.setattr(piles.mujoco_scene, "is_installed", lambda: False)
    found = run("--peer")
    assert found.exit_code == 2
    assert "rigid-env[bench]" in found.output
    assert "contacts" not in found.output


def test_what_was_measured_is_kept_when_a_run_is_stopped(tmp_path, monkeypatch):
    monkeypatch.setattr(piles, "spread", stop)
    assert run("--json", str(tmp_path / "p.json")).exit_code != 0
    kept = json.loads((tmp_path / "p.json").read_text())
    assert [s["bodies"] for s in kept["piles"]] == list(piles.QUICK_PILES)


def stop(count):
    raise KeyboardInterrupt


def test_a_pile_lies_once_nothing_of_it_was_fast_for_long_enough():
    falling, lying = settling.settle(2, settling.Ours(scenes.heap(2), "fast"), 4000)
    assert settling.LIES_FOR < falling.steps < 4000
    assert falling.fastest <= settling.LIES
    assert lying.steps == settling.LIES_FOR
    assert lying.found >= 8.0  # two cubes flat on the floor, four corners each, or more where they touch
