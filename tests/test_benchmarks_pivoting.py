"""The soak of pivoting: bodies that touch their walls, and counts that say what two steps differ in."""

import json
from dataclasses import replace

import numpy as np
import pytest
import typer
from typer.testing import CliRunner

import physics
from benchmarks import drawn_contacts, pivoting
from physics.kernels.math.quaternion import to_matrix
from rigid_env.hard_cases.case import UnsupportedError

pytestmark = pytest.mark.interpreted

CORNERS = np.array(np.meshgrid(*[(-0.5, 0.5)] * 3)).reshape(3, 8)
NAMES = tuple(name for name in pivoting.tally() if name != "decades")


@pytest.fixture(autouse=True)
def _small_runs(monkeypatch):
    monkeypatch.setattr(pivoting, "WORLDS", 3)
    monkeypatch.setattr(pivoting, "MOST_ITERATIONS", 20)
    monkeypatch.setattr(pivoting, "MOST_IMPACTS", 2)


def run(*arguments: str):
    app = typer.Typer()
    app.command()(pivoting.main)
    return CliRunner().invoke(app, ["--family", "no friction", "--preset", "balanced", *arguments])


@pytest.mark.parametrize("seed", range(20))
def test_every_body_touches_a_wall_and_is_in_none(seed):
    """By its vertices; distances are at most 10^-2.5 of the radius before they are divided among the walls."""
    effects, _, _ = pivoting.FAMILIES["friction"]
    drawn = drawn_contacts.draw(np.random.default_rng(seed), effects, False, 20)
    if drawn is None:
        return
    for k in range(20):
        R = np.reshape(to_matrix(tuple(drawn.state["quat"][k, 0])), (3, 3))
        size = drawn.parameters["size"][k, 0]
        places = drawn.state["pos"][k, 0] + (R @ (CORNERS * size[:, None])).T
        gaps = [(places @ wall.normal).min() - wall.offset for wall in drawn.scene.walls]
        assert -drawn_contacts.DEEPEST <= min(gaps) / (0.5 * np.linalg.norm(size)) <= 0.01
    assert sum(kind.astype(int) for kind in drawn.kinds.values()).tolist() == [1] * 20


def test_all_kinds_of_walls_are_drawn():
    counts = {len(drawn_contacts.draw_walls(np.random.default_rng(seed))[0]) for seed in range(60)}
    assert counts == {1, 2, 3, 4}


def test_a_win_is_a_smaller_residual_of_another_state():
    found = pivoting.empty()
    while not found["largest"]:
        pivoting.run_batch("no friction", "balanced", 0, found)
    for before, after, *_ in found["largest"]:
        assert before > 0.01
        assert after < before
    for kind in drawn_contacts.KINDS:
        counts = found[kind]
        assert counts["solved"] <= counts["by_tolerance"] <= counts["won"]
        assert counts["won"] + counts["worse"] <= counts["tried"] <= counts["problems"]
        assert sum(counts["decades"].values()) == counts["won"]


def test_worlds_without_a_try_have_the_same_bits():
    """Nothing but pivoting differs: of one wall without friction, all problems are solved directly."""
    scene = physics.Scene(
        [physics.Block((1, 2, 3), 1.0, pos=(0, 1.0, 0))], [physics.HalfSpace((0, 1, 0))],
        [physics.Gravity(), physics.Contact()],
    )  # fmt: skip
    knobs = pivoting.with_pivoting("balanced")
    on, off = (physics.World(scene, accuracy=one) for one in (knobs, replace(knobs, solver="sweeps")))
    counts = pivoting.tally()
    for _ in range(3):
        on.step()
        off.step()
        pivoting.compare(counts, on, off, np.ones(1, dtype=np.bool_))
    assert counts["problems"] >= 3
    assert not any(counts[name] for name in NAMES if name != "problems")


def test_a_run_goes_on_where_it_stopped(tmp_path):
    paths = tmp_path / "parts.json", tmp_path / "whole.json"
    for path, problems in ((paths[0], "10"), (paths[0], "40"), (paths[1], "40")):
        done = run("--problems", problems, "--json", str(path))
        assert done.exit_code == 0, done.output
    parts, whole = (json.loads(path.read_text())["random"] for path in paths)
    assert parts == whole
    assert pivoting.problems(whole["no friction, balanced"]) >= 40


def test_a_file_of_another_seed_is_refused(tmp_path):
    path = tmp_path / "p.json"
    path.write_text(json.dumps(pivoting.read(path, 0)))
    assert pivoting.read(path, 0)["random"] == {}
    with pytest.raises(typer.BadParameter, match="is of seed 0, not 1; give another file, or its seed"):
        pivoting.read(path, 1)


def test_worlds_of_hard_cases_are_counted():
    effects = [physics.Gravity(), physics.Contact(0.0)]
    walls = [physics.HalfSpace((0, 1, 0))]
    setting = pivoting.WatchedSetting(is_thorough=False)
    world = setting.world(physics.Scene([physics.Block((1, 1, 1), 1.0, pos=(0, 0.5, 0))], walls, effects))
    solves = sum(int(world.step().solves[0]) for _ in range(3))
    assert setting.counts["problems"] == solves > 0
    many = physics.Scene([physics.Sphere(0.5, 1.0, pos=(2 * k, 0.5, 0)) for k in range(2)], walls, effects)
    with pytest.raises(UnsupportedError, match="no solver of this scene pivots"):
        setting.world(many)
