"""MJCF without MuJoCo: the part that is written here is read, and everything else is refused."""

from __future__ import annotations

import re
import sys
from types import SimpleNamespace

import numpy as np
import pytest

import physics
from physics.io.mjcf.files import from_mjcf
from tests.physics.mjcf_texts import READ, REFUSED, box, floor, model, of

pytestmark = pytest.mark.usefixtures("without_mujoco")

MORE = 'load_mjcf reads more where MuJoCo is installed: pip install "mujoco>=3.3.7"'
EPS = np.finfo(float).eps


def test_a_model_written_elsewhere_is_read():
    """MuJoCo's defaults, density instead of mass, a turned inertial frame off the body's origin."""
    scene = from_mjcf("""<mujoco>
      <statistic extent="2"/>
      <worldbody>
        <light pos="0 0 3"/>
        <geom type="plane" size="0 0 1" pos="0 0 -2" rgba="1 0 0 1"/>
        <body pos="0 0 1"><freejoint/><geom type="box" size="1 2 3"/></body>
        <body pos="0 0 9" quat="0 0 0 2"><joint type="free"/>
          <inertial pos="1 0 0" quat="1 0 0 1" mass="3" diaginertia="1 2 2.5"/>
          <geom type="box" size="1 1 1"/>
        </body>
      </worldbody>
    </mujoco>""")
    first, second = scene.bodies
    assert first == physics.Block((2, 4, 6), 48_000.0, pos=(0, 0, 1))
    assert second.pos == pytest.approx((-1, 0, 9), abs=4 * EPS)
    assert second.center == pytest.approx((-1, 0, 0), abs=4 * EPS)
    assert second.inertia == pytest.approx(np.diag([2, 1, 2.5]), abs=8 * EPS)
    assert scene.walls == (physics.HalfSpace((0, 0, 1), -2.0),)
    assert scene.effects == (physics.Gravity((0, 0, -9.81)), physics.Contact(), physics.Friction(1.0))


def test_the_first_keyframe_has_pose_and_velocity():
    (body,) = from_mjcf(READ["keyframe"].replace('<key qpos="0 0 9 1 0 0 0"/>', "")).bodies
    assert (body.pos, body.quat, body.linvel) == ((1, 2, 3), (0.5, -0.5, 0.5, 0.5), (1, 2, 3))
    assert body.angvel == pytest.approx(physics_turned((0.5, -0.5, 0.5, 0.5), (4, 5, 6)), abs=8 * EPS)


def physics_turned(quat, vector):
    """The vector turned by the quaternion, by its definition q v q*."""
    w, u, v = quat[0], np.array(quat[1:]), np.array(vector)
    return v + 2 * w * np.cross(u, v) + 2 * np.cross(u, np.cross(u, v))


def test_one_box_on_a_plane_of_another_friction_has_the_larger_one():
    """No geom is paired with itself."""
    for own, its in ((0.5, 1.0), (1.0, 0.5)):
        scene = from_mjcf(model(box(f'friction="{own}"'), world=floor(f'friction="{its}"')))
        assert scene.effect(physics.Friction) == physics.Friction(1.0)


def test_masks_of_two_bodies_decide_whether_they_touch():
    scene = from_mjcf(READ["masks"])
    assert scene.effects[1:] == (physics.Contact(), physics.Friction(1.0))


UNREAD = {
    "two options": ("<option> has timestep='.001'", MORE),
    "two worldbodies": ("<worldbody> stands in <mujoco> twice", MORE),
    "gravity off": ("<flag> in <option> is not read", MORE),
    "default": ("<default> in <mujoco> is not read", MORE),
    "euler": ("<body> has euler='20 30 40', which is not read", MORE),
    "euler in radian": ("<body> has euler=", MORE),
    "sequence": ("<compiler> has eulerseq='zyx'", MORE),
    "axisangle": ("has axisangle=", MORE),
    "xyaxes": ("has xyaxes=", MORE),
    "zaxis": ("<body> has zaxis=", MORE),
    "class": ("<default> in <mujoco> is not read", MORE),
    "priority": ("<geom> has priority='1'", MORE),
    "pair": ("<pair> has no condim", MORE),
    "inertia from geom": ("<compiler> has inertiafromgeom='true'", MORE),
    "bound mass": ("<compiler> has boundmass='1'", MORE),
    "bound inertia": ("<compiler> has boundinertia='1'", MORE),
    "balance inertia": ("<compiler> has balanceinertia='true'", MORE),
    "shell": ("<geom> has shellinertia='true'", MORE),
    "align": ("<freejoint> has align='true'", MORE),
    "turned geom": ("<geom> has euler='10 20 30'", MORE),
    "weightless": ("<body> has gravcomp='1'", MORE),
    "damping": ("<joint> has damping='2'", MORE),
    "friction loss off": ("<flag> in <option> is not read; allowed are none", MORE),
    "wind without a medium": ("<option> has wind='9 0 0'", MORE),
    "hard contact": ("<geom> has solimp='.95 .99 .001'", MORE),
    "frame and replicate": ("<frame> in <worldbody> is not read", MORE),
    "fixed mass": ("<body> has euler", MORE),
    "mesh": ("<geom> has euler", MORE),
    "scaled mesh": ("<mesh 'm'> has scale='1 2 3'", MORE),
}


@pytest.mark.parametrize("name", UNREAD)
def test_what_only_mujoco_reads_is_refused(name):
    with pytest.raises(ValueError, match=r"^here, line \d+: ") as told:
        from_mjcf(READ[name], "here")
    assert [words for words in UNREAD[name] if words not in str(told.value)] == [], told.value


@pytest.mark.parametrize("name", sorted(REFUSED))
def test_what_a_scene_cannot_hold_is_refused_here_too(name):
    with pytest.raises(ValueError, match=r"^here"):
        from_mjcf(REFUSED[name][0], "here")


KEY = "<keyframe><key {}/></keyframe>"
WRONG = {
    "no world": ("<mujoco/>", "line 1: <worldbody> is missing"),
    "no body": ("<mujoco><worldbody/></mujoco>", "Scene.bodies is empty"),
    "no free joint": (of("", box()).replace("<freejoint/>", ""), "<body> is not a free body"),
    "two joints": (of("", "<freejoint/>" + box()), "<freejoint> stands in <body> twice"),
    "a number too many": (
        model('<geom type="box" size="1 1 1 7"/>'),
        "line 5: size of <geom> is '1 1 1 7'; allowed are 3",
    ),
    "a number too few": (model('<geom type="box" size="1"/>'), "size of <geom> is '1'; allowed are 3 finite numbers"),
    "no number": (model('<geom size="big"/>'), "size of <geom> is 'big'; allowed is one finite number"),
    "frictions": (
        model(box('friction="1 2 3 4"')),
        "friction of <geom> is '1 2 3 4'; allowed are 1 to 3 finite numbers",
    ),
    "mask": (model(box('contype="x"')), "contype of <geom> is 'x'; allowed is an integer"),
    "mass": (model('<geom size="1" mass="-1"/>'), "<geom> has the mass -1; allowed is more than 0"),
    "quaternion": (of('quat="0 0 0 0"', box()), "<body> has the quaternion [0.0, 0.0, 0.0, 0.0] of norm 0"),
    "a key too short": (
        model(box(), after=KEY.format('qpos="1 2 3"')),
        "line 7: qpos of <key> is '1 2 3'; allowed are 7",
    ),
    "a key of many": (model(box(), after=KEY.format('qvel="1 2 3"')), "qvel of <key> is '1 2 3'; allowed are 6"),
    "no such mesh": (
        of("", '<inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/><geom type="mesh" mesh="m"/>'),
        "<geom> has the mesh 'm'; allowed are those of <asset>: none",
    ),
    "two options": (
        model(box(), before='<option/><option gravity="0 0 -1.62"/>'),
        "line 2: <option> stands in <mujoco> twice",
    ),
    "robot": ("<robot/>", "line 1: <robot> is not read; allowed is <mujoco>"),
}


@pytest.mark.parametrize("name", WRONG)
def test_what_is_wrong_is_named_with_its_value_and_line(name):
    text, words = WRONG[name]
    with pytest.raises(ValueError, match=r"^here") as told:
        from_mjcf(text, "here")
    assert words in str(told.value)


def test_what_no_scene_has_is_refused_without_a_hint_at_mujoco():
    with pytest.raises(ValueError, match=r"^here, line 7: <tendon> in <mujoco> has no counterpart in a scene") as told:
        from_mjcf(REFUSED["tendon"][0], "here")
    assert MORE not in str(told.value)


def test_the_switch_needs_mujoco(tmp_path):
    path = tmp_path / "model.xml"
    path.write_text(READ["masks"], encoding="utf-8")
    with pytest.raises(ModuleNotFoundError, match=r"drop=True needs MuJoCo 3\.3\.7 or newer, which is not installed"):
        physics.load_mjcf(path, drop=True)
    assert len(physics.load_mjcf(path).bodies) == 2


def test_an_old_mujoco_is_as_good_as_none(monkeypatch):
    monkeypatch.setitem(sys.modules, "mujoco", SimpleNamespace(__version__="3.2.10"))
    with pytest.raises(ValueError, match=re.escape(MORE)):
        from_mjcf(READ["euler"])
