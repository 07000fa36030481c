"""Trajectories by the names of their bodies, as tables, for pandas and as pictures."""

from __future__ import annotations

import csv
import sys
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

import physics
from physics import scenes
from physics.analysis.events import named
from physics.scene.body_names import body_label


@pytest.fixture(scope="module")
def fall():
    """The block of `scenes.drop`, with a name."""
    scene = scenes.drop()
    return physics.simulate(replace(scene, bodies=[replace(scene.bodies[0], name="crate")]), 1.2)


@pytest.fixture(scope="module")
def pair():
    """Two balls that fall, one of them with a name."""
    balls = [physics.Sphere(0.5, 2.0, linvel=(1, 0, 0)), physics.Sphere(0.5, 2.0, pos=(5, 0, 0), name="kicked")]
    return physics.simulate(physics.Scene(balls, effects=[physics.Gravity()]), 0.1)


def read(path) -> list[dict[str, str]]:
    with open(path, newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


# names


def test_a_body_is_found_by_its_name_and_its_index(pair):
    kicked = pair["kicked"]
    assert (kicked.body, kicked.name, kicked.label, pair[0].label) == (1, "kicked", "kicked", "body 0")
    assert kicked.pos.tolist() == pair.pos[:, 1].tolist()
    assert kicked.energy.tolist() == pair[1].energy.tolist() == pair.energy[:, 1].tolist()
    assert repr(kicked).startswith("BodyTrajectory(kicked, 11 samples")
    with pytest.raises(ValueError, match=r"body is 'kick'; allowed are kicked, or indices from 0 to 1"):
        pair["kick"]
    with pytest.raises(ValueError, match="body is 2"):
        pair[2]
    with pytest.raises(ValueError, match="without a scene"):
        replace(pair, scene=None)["kicked"]
    with pytest.raises(TypeError):
        iter(pair)


def test_events_name_their_bodies(fall, tmp_path):
    assert {event.name for event in fall.events} == {"crate"}
    assert {event.other_name for event in fall.events} == {""}
    assert fall["crate"].events == fall.events
    fall.to_npz(tmp_path / "fall.npz")
    again = physics.Trajectory.from_npz(tmp_path / "fall.npz")
    assert again.events == fall.events
    assert again.names == ("crate",)
    (met,) = named([physics.Event(0.5, "impact", 1, other=0)], ("", "kicked"))
    assert (met.name, met.other_name) == ("kicked", "")


def test_errors_and_faults_name_bodies():
    scene = scenes.drop()
    world = physics.World(replace(scene, bodies=[replace(scene.bodies[0], name="crate")]))
    with pytest.raises(ValueError, match=r"of body 0 \(crate\) in world 0"):
        world.set_state(pos=(0.0, -5.0, 0.0))
    report = world.step(np.full(6, 1e120))
    assert report.messages()[0].startswith("body 0 (crate): a body's loads")
    assert [body_label(body, ("", "a")) for body in (0, 1, 2)] == ["0", "1 (a)", "2"]


# tables


def test_samples_are_written_with_the_names_of_bodies(pair, tmp_path):
    pair.to_csv(tmp_path / "samples.csv")
    rows = read(tmp_path / "samples.csv")
    assert list(rows[0]) == [
        "t", "body", "name", "x", "y", "z", "qw", "qx", "qy", "qz", "vx", "vy", "vz", "wx", "wy", "wz", "energy",
    ]  # fmt: skip
    assert [(row["body"], row["name"]) for row in rows[:3]] == [("0", ""), ("1", "kicked"), ("0", "")]
    kicked = [row for row in rows if row["name"] == "kicked"]
    assert [float(row["y"]) for row in kicked] == pair["kicked"].pos[:, 1].tolist()
    assert [float(row["energy"]) for row in kicked] == pair["kicked"].energy.tolist()


def test_events_are_written(fall, tmp_path):
    fall.to_csv(tmp_path / "events.csv", "events")
    rows = read(tmp_path / "events.csv")
    assert [(float(row["t"]), row["kind"], row["name"]) for row in rows] == [(e.t, e.kind, e.name) for e in fall.events]
    assert [[float(row[name]) for name in ("jx", "jy", "jz")] for row in rows] == [list(e.impulse) for e in fall.events]


def test_contacts_over_time_carry_the_weight(tmp_path):
    rest = physics.simulate(scenes.rest(), 0.1)
    rest.to_csv(tmp_path / "contacts.csv", "contacts")
    rows = read(tmp_path / "contacts.csv")
    assert len(rows) == 4 * 10  # at the start nothing has been stepped
    assert {(row["body"], row["wall"], row["other"]) for row in rows} == {("0", "0", "-1")}
    for t in set(rest.contacts.t.tolist()):
        forces = [float(row["fy"]) for row in rows if float(row["t"]) == t]
        assert sum(forces) == pytest.approx(6.0 * 9.81, rel=1e-6)
    rest.to_npz(tmp_path / "rest.npz")
    again = physics.Trajectory.from_npz(tmp_path / "rest.npz").contacts
    assert again.force.tolist() == rest.contacts.force.tolist()
    assert "40 contacts at 10 samples" in repr(again)


def test_a_trajectory_of_another_engine_has_no_contacts(pair, tmp_path):
    with pytest.raises(ValueError, match="what is 'contacts', which this trajectory does not hold"):
        replace(pair, contacts=None).to_csv(tmp_path / "x.csv", "contacts")
    with pytest.raises(ValueError, match="what is 'event'; allowed are events"):
        pair.to_csv(tmp_path / "x.csv", "event")


def test_pandas_gets_the_same_columns(pair, monkeypatch):
    monkeypatch.setitem(sys.modules, "pandas", SimpleNamespace(DataFrame=dict))
    frame = pair.to_pandas()
    assert frame["name"][:2] == ["", "kicked"]
    assert frame["x"].tolist() == pair.pos[:, :, 0].ravel().tolist()
    assert list(pair.to_pandas("contacts"))[:3] == ["t", "body", "name"]


def test_without_pandas_or_matplotlib_the_line_that_installs_it_is_told(pair, monkeypatch):
    for package in ("pandas", "matplotlib", "matplotlib.figure"):
        monkeypatch.setitem(sys.modules, package, None)
    with pytest.raises(ModuleNotFoundError, match="needs pandas, which is not installed: pip install pandas"):
        pair.to_pandas()
    with pytest.raises(ModuleNotFoundError, match=r'needs matplotlib.*pip install "rigid-env\[plot\]"'):
        pair.plot()


# pictures


def test_plots_have_units_and_names(fall, pair, tmp_path):
    pytest.importorskip("matplotlib")
    figure = fall.plot(tmp_path / "fall.svg")
    assert (tmp_path / "fall.svg").stat().st_size > 0
    assert [panel.get_ylabel() for panel in figure.axes] == [
        "position [m]", "velocity [m/s]", "angular velocity [rad/s]", "energy [J]",
    ]  # fmt: skip
    assert figure.axes[0].lines[1].get_ydata().tolist() == fall.pos[:, 0, 1].tolist()
    assert figure.get_suptitle() == "crate"
    both = pair.plot()
    assert [text.get_text() for text in both.legends[0].get_texts()] == ["body 0", "kicked"]
    assert both.axes[0].get_ylabel() == "height y [m]"
