"""HTML tables for notebooks: valid, short, escaped, and with the numbers of the `repr`."""

from __future__ import annotations

import re
import subprocess
import sys
from dataclasses import dataclass
from html.parser import HTMLParser

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import physics
from physics import scenes
from physics.html_table import LARGEST, LONGEST_CELL, parts_table, table
from tests.physics.test_reprs import things

NUMBER = re.compile(r"(?<![\w.])-?\d+(?:\.\d+)?(?:e[-+]?\d+)?(?!\w)")
TAGS = {"table", "thead", "tbody", "tr", "th", "td"}


class Reader(HTMLParser):
    """Cells of a table, by row; an AssertionError where a tag is not closed in its turn, or is none of a table."""

    def __init__(self):
        super().__init__()
        self.rows, self.open = [], []

    def handle_starttag(self, tag, attrs):
        assert tag in TAGS
        for name, value in attrs:
            assert (name, value) in {("colspan", "2"), ("scope", "row"), ("style", "text-align: left")}
        self.open.append(tag)
        if tag == "tr":
            self.rows.append([])
        elif tag in ("td", "th"):
            self.rows[-1].append("")

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        assert self.open[-1] in ("td", "th")
        self.rows[-1][-1] += data


def rows_of(html: str) -> list[list[str]]:
    reader = Reader()
    reader.feed(html)
    reader.close()
    assert reader.open == []
    assert len(html.encode()) <= LARGEST
    return reader.rows


def every_public_object():
    """An object of each public class that has a `repr` of its own."""
    yield from things()
    yield scenes.drop()
    yield physics.PRESETS["precise"]
    yield from (physics.Block((1, 2, 3), 1), physics.Sphere(0.5, 2, name="a<b"), physics.Ellipsoid((1, 2, 3), 4))
    yield physics.Capsule(0.5, 2.0, 3)
    yield physics.Sensor(physics.Sphere(0.5, fixed=True, pos=(1, 2, 3)), 4, name="goal")
    yield physics.Cylinder(0.5, 2.0, 3)
    yield physics.Compound([physics.Sphere(0.5, 2)])
    yield physics.HalfSpace((0, 1, 0), -2)
    yield physics.Event(0.5, "impact", 0, 1, (0.0, 3.25, 0.0))
    yield from (physics.Gravity(), physics.Contact(0.25), physics.Friction(0.5), physics.RollingFriction(0.125))
    yield from (physics.SpinFriction(0.5), physics.Actuator(lag=0.25), physics.Sleeping(), physics.Drag(0.5))
    yield from (physics.AngularDrag(0.5), physics.Buoyancy(1.5), physics.Magnus(), physics.Wind(gust=2.0))
    yield from (physics.Spring((0, 9, 0)), physics.Push((1, 2, 3)), physics.Motion(spin=(0, 2.5, 0)))
    yield physics.Truth(len, "m", 0.5)
    world = physics.World(scenes.drop())
    world.keep_impacts()
    world.step()
    yield from (world.read_contacts(), world.read_impacts(), world.cast_rays([(0, 9, 0)], [(0, -1, 0)]))
    yield world.nearest_to(None, (0, 9, 0))
    yield physics.rollout(world, np.zeros((1, 3, 1, 6)), steps=3)


@pytest.mark.filterwarnings("ignore::physics.SceneWarning")
def test_every_public_object_has_a_table_with_the_numbers_of_its_repr():
    seen = set()
    for thing in every_public_object():
        rows = rows_of(thing._repr_html_())
        assert rows[0] == [type(thing).__name__]
        text = " ".join(cell for row in rows for cell in row)
        whole = re.sub(r"(?s)<function.*?>|\[.*?\]+|\(\(.*?\)\)|.{30} \.\.\. .*", "", repr(thing))
        missing = [number for number in NUMBER.findall(whole) if number not in text]
        assert missing == [], (repr(thing), rows)
        seen.add(type(thing))
    public = [value for value in vars(physics).values() if isinstance(value, type)]
    shown = {each for each in public if each.__repr__ is not object.__repr__ and each.__module__.startswith("physics")}
    bases = {physics.Body, physics.Field, physics.SceneWarning, physics.Status, physics.Solver}
    assert shown - bases <= seen


def test_a_world_and_a_trajectory_say_more_than_their_repr():
    rows = dict(row for row in rows_of(physics.World(scenes.drop())._repr_html_()) if len(row) == 2)
    assert rows == {
        "dt": "0.01", "time": "0 s", "bodies": "Block", "walls": "3", "effects": "Gravity, Contact, Friction",
        "accuracy": "balanced",
    }  # fmt: skip
    found = physics.simulate(scenes.drop(), 0.2)
    energy = found.energy.sum(axis=1)
    assert ["energy", f"{energy[0]:.6g} to {energy[-1]:.6g} J"] in rows_of(found._repr_html_())


def test_a_small_scene_shows_each_of_its_parts():
    rows = rows_of(scenes.drop()._repr_html_())
    assert [row[0] for row in rows[1:3]] == ["bodies[0]", "walls[0]"]
    assert rows[-1] == ["effects[2]", repr(scenes.drop().effects[2])]


def test_text_is_escaped():
    evil = '<script src="https://example.org/x.js"></script>&amp;'
    scene = physics.Scene([physics.Sphere(1.0, 1.0, name=evil)], effects=[physics.Gravity()])
    html = scene._repr_html_()
    assert "<script" not in html
    assert evil in rows_of(html)[1][1]

    @dataclass(frozen=True)
    class Told:
        def _parts(self):
            return ("a<b=1 & 2", "c: <i>")

    assert rows_of(parts_table(Told())) == [["Told"], ["a<b=1 & 2"], ["c", "<i>"]]


@given(st.text(), st.lists(st.tuples(st.text(), st.text()), max_size=60))
def test_any_text_makes_a_valid_short_table(title, rows):
    found = rows_of(table(title, rows))
    assert len(found) <= 1 + len(rows) + 1
    for cells, row in zip(found[1:], rows):
        if cells == ["..."]:
            break
        if all(text.isprintable() and len(text) <= LONGEST_CELL for text in row):
            assert cells == ([row[1]] if row[0] == "" else list(row))
    else:
        assert len(found) == 1 + len(rows)


def test_a_table_that_is_too_long_ends_in_dots():
    rows = rows_of(table("Many", [("k" * 50, "<" * 10_000)] * 50))
    assert rows[-1] == ["..."]
    assert len(rows) < 50
    assert rows[1][1].endswith("< ...")


def test_the_engine_makes_tables_without_a_notebook():
    """No package beyond those of the engine is imported for a table."""
    code = (
        "import sys, physics; physics.scenes.drop()._repr_html_();"
        "print([name for name in ('IPython', 'rigid_env', 'gymnasium') if name in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
