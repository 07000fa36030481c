"""MJCF with MuJoCo: each text gives MuJoCo's own scene, or an error that names the element and its line."""

from __future__ import annotations

import gc
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import physics
from physics.io.mjcf.files import from_mjcf, read_mjcf
from physics.io.mjcf.model import compile_model
from physics.io.mjcf.text import parse
from physics.io.mjcf.writer import to_mjcf

mujoco = pytest.importorskip("mujoco", minversion="3.3.7")
from tests.physics.mjcf_texts import HILLS, READ, REFUSED, box, floor, model  # noqa: E402 - after the skip
from tests.reference import mujoco_model  # noqa: E402 - it imports mujoco

CASES = Path(__file__).parents[3] / "shared" / "cases" / "mjcf"

# Relative to each quantity: rotations there and back; meshes are in single precision.
SAME, SAME_HULL = 1e-12, 1e-6


def assert_same(text_or_path, scene: physics.Scene) -> None:
    found = mujoco_model.differences(mujoco_model.load(text_or_path), scene)
    has_hull = any(body.kind == "hull" for body in scene.bodies)
    assert max(found.values()) <= (SAME_HULL if has_hull else SAME), found


@pytest.mark.filterwarnings("ignore::UserWarning")
@pytest.mark.parametrize("name", READ)
def test_a_text_gives_the_scene_that_mujoco_simulates(name):
    assert_same(READ[name], from_mjcf(READ[name]))


def test_a_cylinder_of_the_world_is_fixed():
    """`assert_same` knows free bodies alone. The axis is MuJoCo's z, turned by 90° about x: along -y."""
    scene = from_mjcf(model(box(), world=floor() + '<geom type="cylinder" size=".1 .2" pos="1 2 3" euler="90 0 20"/>'))
    (found,) = (body for body in scene.bodies if body.fixed)
    assert (found.kind, found.radius, found.height, found.pos) == ("cylinder", 0.1, 0.4, (1.0, 2.0, 3.0))
    axis = Rotation.from_quat(found.quat, scalar_first=True).apply((0, 1, 0))
    np.testing.assert_allclose(axis, (0, -1, 0), atol=1e-15)


def test_fixed_bodies_come_back_with_their_names_where_the_file_names_their_geoms():
    parts = [physics.Block((1, 1, 1), fixed=True), physics.Sphere(0.5, fixed=True, pos=(1, 0, 0))]
    bodies = [
        physics.Block((1, 0.5, 0.7), mass=2.0, pos=(0, 3, 0), name="crate"),
        physics.Block((30, 1, 4), fixed=True, name="table"),
        physics.Sphere(0.3, fixed=True, pos=(3, 0, 0)),
        physics.Compound(parts, fixed=True, pos=(9, 0, 0)),
    ]
    effects = [physics.Gravity(), physics.Contact(), physics.Friction(0.3, pairs={("crate", "table"): 0.2})]
    text = to_mjcf(physics.Scene(bodies, effects=effects))
    assert "geom3.1" in text
    found = from_mjcf(text).bodies
    assert [(body.kind, body.name) for body in found] == [(body.kind, body.name) for body in bodies]


@pytest.mark.filterwarnings("ignore::UserWarning")
@pytest.mark.skipif(not CASES.is_dir(), reason="needs ../shared/cases/mjcf")
@pytest.mark.parametrize("path", sorted(CASES.glob("*.xml")), ids=lambda path: path.stem)
def test_a_case_gives_the_scene_that_mujoco_simulates_or_an_error(path):
    refused = {
        "armature", "medium", "misspelt", "surplus_size", "unknown_class",
    }  # fmt: skip
    if path.stem in refused:
        with pytest.raises(ValueError, match=rf"{path.stem}\.xml, line 1: "):
            physics.load_mjcf(path)
    else:
        scene = physics.load_mjcf(path)
        if path.stem == "static_box":  # the reference knows free bodies alone
            assert [body.fixed for body in scene.bodies].count(True) == 1
        else:
            assert_same(path, scene)


@pytest.mark.interpreted
@pytest.mark.parametrize("name", ["damping", "keyframe", "half weight", "off centre"])
def test_the_engine_accelerates_as_mujoco_does(name):
    """The change of velocity in a short step; bodies are apart from all else."""
    text, dt = READ[name], 1e-8
    m = mujoco_model.load(text)
    data = mujoco.MjData(m)
    if m.nkey:
        mujoco.mj_resetDataKeyframe(m, data, 0)
    mujoco.mj_forward(m, data)
    world = physics.World(from_mjcf(text), dt=dt)
    v, w = world.linvel.copy(), world.angvel.copy()
    world.step()
    for k, b in enumerate(mujoco_model.free_bodies(m)):
        qacc, R = data.qacc[6 * k : 6 * k + 6], data.xmat[b].reshape(3, 3)
        spin, turn, arm = R @ data.qvel[6 * k + 3 : 6 * k + 6], R @ qacc[3:], data.xipos[b] - data.xpos[b]
        centre = qacc[:3] + np.cross(turn, arm) + np.cross(spin, np.cross(spin, arm))
        assert (world.linvel[0, k] - v[0, k]) / dt == pytest.approx(centre, abs=1e-3)
        assert (world.angvel[0, k] - w[0, k]) / dt == pytest.approx(turn, abs=1e-3)


@pytest.mark.parametrize("name", REFUSED)
def test_what_a_scene_cannot_hold_is_named_with_its_line(name):
    text, *words = REFUSED[name]
    with pytest.raises(ValueError, match=r"^here") as told:
        from_mjcf(text, "here")
    assert [word for word in words if word not in str(told.value)] == [], told.value


def test_the_rest_is_read_and_what_was_left_out_is_listed():
    text = model(
        box('name="a" friction=".5"'), box() + box('friction=".3"'), box('name="c"'),
        world='<geom name="t" type="hfield" hfield="h"/>' + floor('name="f" friction=".5"'),
        before=f'<option density="1.2"/><asset>{HILLS}</asset>',
    )  # fmt: skip
    scene, left = read_mjcf(text, "here", drop=True)
    assert [body.pos for body in scene.bodies] == [(0, 0, 2), (2, 0, 2)]
    assert scene.walls == (physics.HalfSpace((0, 0, 1), name="f", friction=0.5),)
    assert [body.friction for body in scene.bodies] == [0.5, 1.0]
    assert scene.effect(physics.Friction) == physics.Friction(1.0, rule="maximum")
    told = [
        "line 2: <option> has a medium",
        "line 6: <geom> of <body> differs",
        "line 4: <geom 't'> is a fixed hfield",
    ]
    assert [message.startswith(start) for message, start in zip(left, told)] == [True] * 3
    assert len(left) == 3


def test_nothing_is_left_out_of_a_scene_that_is_read_whole(tmp_path):
    path = tmp_path / "model.xml"
    path.write_text(READ["keyframe"], encoding="utf-8")
    scene, left = physics.load_mjcf(path, drop=True)
    assert left == []
    assert scene == physics.load_mjcf(path)


def test_a_model_of_which_nothing_is_left_is_refused():
    with pytest.raises(
        ValueError, match=r"^here: there is no free body .* of 1 parts left out the first is line 5: <geom>"
    ):
        read_mjcf(model(box() + box('friction=".3"')), "here", drop=True)


def test_included_files_and_meshes_stand_beside_the_model(tmp_path):
    points = np.array([(0, 0, 0), (1, 0, 0), (0, 2, 0), (0, 0, 3)])
    (tmp_path / "m.obj").write_text(
        "\n".join(f"v {x} {y} {z}" for x, y, z in points) + "\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4"
    )
    (tmp_path / "floor.xml").write_text(f"<mujoco><worldbody>{floor()}</worldbody></mujoco>", encoding="utf-8")
    text = model(
        '<geom type="mesh" mesh="m"/>', before='<include file="floor.xml"/><asset><mesh file="m.obj"/></asset>'
    )
    path = tmp_path / "model.xml"
    path.write_text(text, encoding="utf-8")
    scene = physics.load_mjcf(path)
    assert_same(path, scene)
    assert scene.bodies[0].mass == pytest.approx(1000.0)
    assert scene.walls == (physics.HalfSpace((0, 0, 1)),)


def test_an_element_of_an_included_file_is_named_without_a_line(tmp_path):
    (tmp_path / "table.xml").write_text(
        f'<mujoco><asset>{HILLS}</asset><worldbody><geom name="t" type="hfield" hfield="h"/></worldbody></mujoco>',
        encoding="utf-8",
    )
    path = tmp_path / "model.xml"
    path.write_text(model(box(), before='<include file="table.xml"/>'), encoding="utf-8")
    with pytest.raises(ValueError, match=r"model\.xml: <geom 't'> is a fixed hfield"):
        physics.load_mjcf(path)


URDF = """<robot name="r"><link name="world"/><link name="b"><inertial><origin xyz=".1 0 0"/><mass value="2"/>
<inertia ixx="1" iyy="1.1" izz="1.2" ixy="0" ixz="0" iyz="0"/></inertial>
<collision><geometry><box size="1 2 3"/></geometry></collision></link>
<joint name="f" type="floating"><origin xyz="0 0 5"/><parent link="world"/><child link="b"/></joint></robot>"""


def test_urdf_is_read(tmp_path):
    path = tmp_path / "robot.urdf"
    path.write_text(URDF, encoding="utf-8")
    scene = physics.load_mjcf(path)
    assert_same(path, scene)
    assert scene.bodies == (
        physics.Block((1, 2, 3), 2.0, center=(-0.1, 0, 0), pos=(0.1, 0, 5), inertia_body=(1, 1.1, 1.2), name="b"),
    )


def test_another_ending_is_read_as_mjcf(tmp_path):
    path = tmp_path / "model.mjcf"
    path.write_text(READ["keyframe"], encoding="utf-8")
    assert physics.load_mjcf(path) == from_mjcf(READ["keyframe"])


def test_mujoco_warns_in_python_and_writes_no_file(tmp_path, monkeypatch):
    """It appends warnings to a file in the working folder where nobody listens."""
    monkeypatch.chdir(tmp_path)
    Path("child.xml").write_text(
        f'<mujoco><visual><map zfar="30"/></visual><worldbody><body name="c">{box()}</body></worldbody></mujoco>'
    )
    Path("model.xml").write_text(
        model(box(), before='<visual><map zfar="50"/></visual><asset><model name="m" file="child.xml"/></asset>',
              world='<body pos="0 0 9"><freejoint/><attach model="m" body="c" prefix="x"/></body>'),
    )  # fmt: skip
    before = mujoco.get_mju_user_warning()
    with pytest.warns(UserWarning, match="zfar"):
        assert len(physics.load_mjcf("model.xml").bodies) == 2
    assert mujoco.get_mju_user_warning() is before
    assert sorted(path.name for path in tmp_path.iterdir()) == ["child.xml", "model.xml"]


def test_names_and_lines_outlive_what_mujoco_has_read():
    """Older versions free the elements of a specification with it: reading one then ends the process."""
    text = READ["keyframe"]
    read = compile_model(mujoco, text, parse(text), None)
    gc.collect()
    assert read.line("geom", 0) == 4
    assert read.spec("geom", 0).type == mujoco.mjtGeom.mjGEOM_PLANE
