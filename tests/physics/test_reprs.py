"""A `repr` fits on a screen, of whatever size the thing is; of small things it is an expression."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

import physics
from physics import scenes, version
from physics.mass.polyhedron import convex_hull
from physics.summary import LINE, lines_repr, shown

ROWS = 10


def height(text: str) -> int:
    """Lines that a text takes on a terminal of 80 columns."""
    return sum(max(-(-len(line) // LINE), 1) for line in text.splitlines())


def many() -> physics.Scene:
    """Fifty blocks, a hundred springs, a wall for each block."""
    blocks = [physics.Block((1, 1, 1), 1, pos=(3 * b, 5, 0)) for b in range(50)]
    walls = [physics.HalfSpace((0, 1, 0), -k) for k in range(50)]
    effects = [physics.Gravity(), *(physics.Spring((3 * b, 9, 0), body=b % 50) for b in range(100)), physics.Drag()]
    return physics.Scene(blocks, walls, effects)


def rock() -> physics.Hull:
    """A hull with many corners."""
    points = np.random.default_rng(1).normal(size=(60, 3))
    return physics.Hull(points / np.linalg.norm(points, axis=1)[:, None], 1)


def things():
    """Everything that is shown, of a size that once filled many screens."""
    scene = many()
    world = physics.World(physics.Scene(scene.bodies, effects=[physics.Gravity()]), worlds=2)
    yield scene
    yield physics.make_plan(scene, "fast")
    yield world
    yield world.snapshot()
    yield world.report
    yield physics.diagnose(world)
    yield physics.simulate(world.scene, 0.2)
    yield rock()
    yield rock().polyhedron
    yield physics.Friction((0.5, 0.1), np.ones((50, 3)))
    point = physics.FrontierPoint("rigid-env", "fast", 0.01, dict.fromkeys(map(str, range(50)), 0.1), (0.1,) * 500)
    yield point
    yield physics.Frontier((point,) * 100, "pose", {"pose": "m"}, {"pose": 0.1}, "truth " * 100, 1.0)
    recorder = physics.Recorder(world)
    world.step(steps=3)
    yield recorder.recording()
    yield recorder.recording().replay()


def test_a_repr_fits_on_a_screen():
    seen = set()
    for thing in things():
        text = repr(thing)
        assert height(text) <= ROWS, text
        assert text.startswith(type(thing).__name__ + "(")
        assert text.endswith(")")
        seen.add(type(thing).__name__)
    assert len(seen) == 14


def test_it_says_how_many_of_what():
    assert "50 bodies: 50 Block" in repr(many())
    assert "100 Spring" in repr(many())
    found = physics.simulate(scenes.drop(), 0.5)
    assert re.match(r"Trajectory\(51 samples of 1 bodies, t = 0 to 0.5 s, events: ", repr(found))
    assert repr(physics.World(scenes.drop()).snapshot()).startswith("Snapshot(time=0 s, state (1, 16), ")


@pytest.mark.parametrize("name", ["drop", "rest", "slide"])
def test_the_repr_of_a_small_scene_makes_it_again(name):
    scene = scenes.by_name(name)
    assert eval(repr(scene), vars(physics)) == scene


def test_values_are_shown_on_one_line():
    for value in (np.zeros((9, 9)), list(range(10**5)), "x" * 10**5, {k: k for k in range(10**4)}, 10**10_000, rock()):
        text = shown(value)
        assert "\n" not in text
        assert len(text) <= 160
    assert shown(np.float64(0.5)) == "0.5"
    assert shown(np.array(-2.0)) == "-2.0"


def test_a_long_part_is_cut():
    text = lines_repr("Name", "a" * 200, "b", "c" * 80)
    assert [len(line) <= LINE for line in text.splitlines()] == [True] * len(text.splitlines())
    assert text.splitlines()[1].strip() == "b,"


def test_the_version_is_that_of_the_sources():
    stated = re.search(r'(?m)^version = "(.*)"$', (Path(__file__).parents[2] / "pyproject.toml").read_text("utf-8"))
    assert physics.__version__ == stated.group(1)


def test_without_sources_it_is_that_of_the_installation(tmp_path, monkeypatch):
    foreign = tmp_path / "pyproject.toml"
    foreign.write_text('[project]\nname = "other"\nversion = "9"\n', encoding="utf-8")
    assert version._of_sources(foreign) is None
    assert version._of_sources(tmp_path / "none.toml") is None
    monkeypatch.setattr(version, "NAME", "no-such-distribution-here")
    assert version._of_installation() == version.UNKNOWN


def test_a_polyhedron_of_few_corners_shows_them_all():
    assert "loops=((" in repr(convex_hull(((0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1.0))))
