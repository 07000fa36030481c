"""A pile that grows: that each layer falls onto the one before, and that what is counted is there. No test asserts a
time.
"""

import json

import numpy as np
import pytest
import typer
from typer.testing import CliRunner

from benchmarks import growing, settling


def run(*arguments):
    app = typer.Typer()
    app.command()(growing.main)
    return CliRunner().invoke(app, ["--quick", *arguments])


def test_a_layer_begins_above_all_that_is_there():
    bodies = []
    for layer in range(3):
        before, bodies = bodies, growing.grown(bodies, layer)
        assert len(bodies) == 25 * (layer + 1)
        new = np.array([body.pos for body in bodies[len(before) :]])
        assert np.linalg.norm(new[:, None] - new, axis=-1)[~np.eye(25, dtype=bool)].min() > growing.DIAGONAL
        top = max((body.pos[1] for body in before), default=-growing.DIAGONAL / 2)
        # Whatever their attitudes: half a diagonal above its centre, half a diagonal below theirs.
        assert new[:, 1].min() - growing.DIAGONAL / 2 >= top + growing.DIAGONAL / 2


def test_the_pile_goes_on_where_it_was():
    for scene, pile in growing.grow(2, "fast"):
        pile.advance(30)
        if len(scene.bodies) == 25:
            first = growing.bodies_of(pile.world)
    assert len(scene.bodies) == 50
    for body, was in zip(scene.bodies, first):
        np.testing.assert_array_equal(body.pos, was.pos)
        np.testing.assert_array_equal(body.linvel, was.linvel)
        np.testing.assert_array_equal(body.angvel, was.angvel)


def test_only_what_is_deep_is_fitted():
    law = [settling.Sample(25 * k, 100.0 * k, 1e-5 * k**1.07) for k in (4, 8, 16)]
    other = [settling.Sample(25 * k, 100.0 * k, 1e-9) for k in (1, 2, 3)]
    assert growing.fit(other + law) == pytest.approx(1.07, abs=1e-12)
    assert growing.fit(other + law[:1]) is None


@pytest.mark.exhaustive
def test_a_quick_run_writes_what_it_found(tmp_path):
    found = run("--json", str(tmp_path / "g.json"), "--plot", str(tmp_path / "g.png"))
    assert found.exit_code == 0, found.output
    kept = json.loads((tmp_path / "g.json").read_text())
    samples = kept["ours"]["samples"]
    assert [s["bodies"] for s in samples] == [25, 50]
    assert all(s["seconds"] > 0 and s["steps"] == growing.PART for s in samples)
    assert (tmp_path / "g.png").stat().st_size > 0


def test_the_peer_takes_the_same_steps(tmp_path):
    pytest.importorskip("mujoco")
    found = run("--peer", "--json", str(tmp_path / "g.json"))
    assert found.exit_code == 0, found.output
    kept = json.loads((tmp_path / "g.json").read_text())
    for solver in growing.SOLVERS:
        peer = kept[f"MuJoCo, {solver}"]["samples"]
        assert [s["bodies"] for s in peer] == [25, 50]
        assert all(s["unconverged"] is None and s["residual"] is None for s in peer)
        assert all(s["steps"] == growing.PART for s in peer)


def test_without_mujoco_the_peer_is_refused_before_anything_is_measured(monkeypatch):
    monkeypatch.setattr(growing.mujoco_scene, "is_installed", lambda: False)
    found = run("--peer")
    assert found.exit_code == 2
    assert "rigid-env[bench]" in found.output
    assert "contacts" not in found.output
