"""Scenes as MJCF: read back equal; MuJoCo loads them with the same mass, inertia, pose, velocity and springs."""

from __future__ import annotations

import re
import warnings

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import physics
from physics import scenes
from physics.io.mjcf.files import from_mjcf
from physics.io.mjcf.writer import to_mjcf
from physics.rotations import rotation_matrices

EPS = np.finfo(float).eps
TURNED = (0.5, 0.5, -0.5, 0.5)
HEAVY_SIDE = physics.Block(
    (5, 3, 2), 6.0, pos=(0, 9, 0), quat=TURNED, linvel=(1, 2, 3), angvel=(0.3, -0.2, 0.1), center=(0.1, 0, -0.2),
    inertia_body=((7, 0.1, 0.2), (0.1, 14, 0), (0.2, 0, 16)),
)  # fmt: skip
WEDGE = [(0, 0, 0), (1, 0, 0), (0, 0.7, 0), (0, 0, 0.5), (1, 0, 0.5), (0, 0.7, 0.5)]
HULL = physics.Hull(WEDGE, 2.0, pos=(1, 2, 3), quat=TURNED, angvel=(1, 2, 3))
MIXED = physics.Scene(
    [
        HEAVY_SIDE,
        physics.Sphere(0.7, 2.0, pos=(4, 5, 6)),
        physics.Ellipsoid((1.0, 0.5, 0.8), 1.0, pos=(-4, 5, 0), angvel=(1, 2, 3)),
    ],
    [physics.HalfSpace((0, 1, 0), -0.5), physics.HalfSpace((1, 2, 2), -7.0)],
    [physics.Gravity((0.5, -9.81, 0)), physics.Contact(), physics.Friction(0.4)],
)
EXPRESSIBLE = {
    **{name: scenes.by_name(name) for name in ("tumble", "slide", "incline", "rolling_sphere")},
    "mixed": MIXED,
    "slippery": physics.Scene(MIXED.bodies, MIXED.walls, [physics.Contact()]),
    "apart": physics.Scene(MIXED.bodies, MIXED.walls, [physics.Contact(between_bodies=False), physics.Friction(0.4)]),
    "of a hull": physics.Scene([HULL], MIXED.walls, MIXED.effects),
    "in space": physics.Scene(MIXED.bodies, effects=[physics.Contact(), physics.Friction(0.4)]),
}
with warnings.catch_warnings():
    warnings.simplefilter("ignore", physics.SceneWarning)
    EXPRESSIBLE["through"] = physics.Scene(MIXED.bodies, MIXED.walls, [physics.Gravity()])


def assert_same(back, scene):
    """To rounding: a spin goes to the body's frame and back, a plane's offset to a point and back."""
    assert back.effects == scene.effects
    for body, again in zip(scene.bodies, back.bodies, strict=True):
        assert type(again) is type(body)
        assert again.name == body.name
        assert (again.mass, again.pos, again.quat, again.linvel) == (body.mass, body.pos, body.quat, body.linvel)
        assert again.center == body.center
        assert (again.inertia_body is None) == (body.inertia_body is None)
        if body.kind == "hull":
            assert_same_corners(again, body)
        else:
            assert np.array_equal(again.dimensions, body.dimensions)
            assert again.inertia == pytest.approx(body.inertia, rel=4 * EPS)
        assert again.angvel == pytest.approx(body.angvel, abs=16 * EPS * (1 + np.abs(body.angvel).max()))
    for wall, again in zip(scene.walls, back.walls, strict=True):
        assert again.normal == wall.normal
        assert again.offset == pytest.approx(wall.offset, rel=8 * EPS)


def assert_same_corners(again, body):
    """In any order, to the rounding of a turn by MuJoCo there and back."""
    there, here = again.polyhedron.vertices, body.polyhedron.vertices
    size = np.abs(here).max()
    assert there.shape == here.shape
    assert np.linalg.norm(there[:, None] - here, axis=2).min(axis=1).max() <= 100 * EPS * size
    assert again.inertia == pytest.approx(body.inertia, abs=1e4 * EPS * np.abs(body.inertia).max())


@pytest.mark.filterwarnings("ignore::physics.SceneWarning")
@pytest.mark.parametrize("name", EXPRESSIBLE)
def test_a_scene_comes_back(name, reader):
    assert_same(from_mjcf(to_mjcf(EXPRESSIBLE[name])), EXPRESSIBLE[name])


@pytest.mark.filterwarnings("ignore::physics.SceneWarning")
@pytest.mark.parametrize("name", EXPRESSIBLE)
def test_mujoco_loads_it_with_the_same_mass_inertia_and_start(name):
    mujoco = pytest.importorskip("mujoco")
    scene = EXPRESSIBLE[name]
    model = mujoco.MjModel.from_xml_string(to_mjcf(scene))
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    mujoco.mj_forward(model, data)
    gravity = scene.effect(physics.Gravity)
    assert np.array_equal(model.opt.gravity, gravity.acceleration if gravity else np.zeros(3))
    for b, body in enumerate(scene.bodies, 1):
        assert model.body_mass[b] == body.mass
        R = rotation_matrices(model.body_iquat[b])
        # MuJoCo diagonalises the tensor by an iteration of its own, to about 1e-12 of it.
        assert R @ np.diag(model.body_inertia[b]) @ R.T == pytest.approx(body.inertia, abs=1e-10 * body.inertia.max())
        assert data.xipos[b] == pytest.approx(body.pos, abs=1e-14 * 10)
        velocity = np.empty(6)
        mujoco.mj_objectVelocity(model, data, mujoco.mjtObj.mjOBJ_BODY, b, velocity, 0)
        # Rotation matrices of MuJoCo and here differ by rounding.
        assert velocity[3:] == pytest.approx(body.linvel, abs=1e-13)
        assert velocity[:3] == pytest.approx(body.angvel, abs=1e-13)


def test_mujoco_has_the_corners_of_a_hull_where_they_are_here():
    mujoco = pytest.importorskip("mujoco")
    body, scene = HULL, EXPRESSIBLE["of a hull"]
    model = mujoco.MjModel.from_xml_string(to_mjcf(scene))
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    mujoco.mj_forward(model, data)
    geom = model.ngeom - 1
    there = model.mesh_vert @ data.geom_xmat[geom].reshape(3, 3).T + data.geom_xpos[geom]
    here = body.polyhedron.vertices @ rotation_matrices(np.array(body.quat)).T + body.pos
    distances = np.linalg.norm(there[:, None] - here[None], axis=-1)
    assert there.shape == here.shape
    assert distances.min(axis=0).max() <= 1e-6  # MuJoCo keeps meshes in single precision
    assert model.body_mass[1] == 2.0
    R = rotation_matrices(model.body_iquat[1])
    assert R @ np.diag(model.body_inertia[1]) @ R.T == pytest.approx(body.inertia, abs=1e-10)


def test_a_spring_pulls_in_mujoco_as_it_does_here():
    """Accelerations at the start, without contacts: the same law, to the rounding of a few lengths."""
    mujoco = pytest.importorskip("mujoco")
    springs = [
        physics.Spring((0, 12, 1), (1, 0.5, 0.2), 80.0, 3.0, length=0.5),
        physics.Spring((3, 2, 0), (-1, 0.5, 0.2), 60.0),
    ]
    scene = physics.Scene([HEAVY_SIDE], effects=[physics.Gravity(), *springs])
    model = mujoco.MjModel.from_xml_string(to_mjcf(scene))
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    mujoco.mj_forward(model, data)
    world = physics.World(scene)
    wrench = physics.look_at(world)[0][0]
    assert data.qacc[:3] == pytest.approx(wrench[:3] / 6.0 + [0, -9.81, 0], rel=1e-10)
    R = rotation_matrices(np.array(HEAVY_SIDE.quat))
    spin = R.T @ HEAVY_SIDE.angvel
    torque = R.T @ wrench[3:] - np.cross(spin, HEAVY_SIDE.inertia @ spin)
    assert data.qacc[3:] == pytest.approx(np.linalg.solve(HEAVY_SIDE.inertia, torque), rel=1e-9, abs=1e-10)


def test_a_spring_between_bodies_pulls_in_mujoco_as_it_does_here():
    """Accelerations of both at the start."""
    mujoco = pytest.importorskip("mujoco")
    other = physics.Sphere(0.4, 2.0, pos=(3, 1, 2), linvel=(0, 1, 0), angvel=(1, 0, 2))
    spring = physics.Spring((0.1, 0.3, 0), (1, 0.5, 0.2), 80.0, 3.0, length=0.5, other=1)
    scene = physics.Scene([HEAVY_SIDE, other], effects=[physics.Gravity(), spring])
    model = mujoco.MjModel.from_xml_string(to_mjcf(scene))
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    mujoco.mj_forward(model, data)
    wrenches = physics.look_at(physics.World(scene))[0]
    for b, mass in enumerate((6.0, 2.0)):
        assert data.qacc[6 * b : 6 * b + 3] == pytest.approx(wrenches[b, :3] / mass + [0, -9.81, 0], rel=1e-10)
    assert data.qacc[9:12] == pytest.approx(wrenches[1, 3:] / (0.4 * 2.0 * 0.16), rel=1e-9, abs=1e-10)


MOMENT = st.floats(0.1, 10.0)
COORDINATE = st.floats(-100.0, 100.0, allow_subnormal=False)


@st.composite
def quaternions(draw):
    """Unit quaternions, to rounding."""
    q = np.array(
        draw(st.tuples(*[st.floats(-1, 1, allow_subnormal=False)] * 4).filter(lambda q: np.linalg.norm(q) > 0.1))
    )
    return tuple((q / np.linalg.norm(q)).tolist())


@st.composite
def bodies(draw):
    """Blocks, spheres, ellipsoids and hulls, of uniform density and not."""
    vectors = st.tuples(COORDINATE, COORDINATE, COORDINATE)
    start = {"pos": draw(vectors), "quat": draw(quaternions()), "linvel": draw(vectors), "angvel": draw(vectors)}
    mass, size = draw(st.floats(0.01, 1000.0)), draw(st.tuples(MOMENT, MOMENT, MOMENT))
    kind = draw(st.sampled_from(("block", "sphere", "ellipsoid", "hull")))
    if kind == "hull":
        return physics.Hull(np.array(size) * np.array(WEDGE), mass, **start)
    if draw(st.booleans()):
        R = rotation_matrices(np.array(draw(quaternions())))
        a, b, c = np.square(size)
        start["inertia_body"] = mass * R @ np.diag((b + c, c + a, a + b)) @ R.T
        if kind == "block":
            start["center"] = draw(vectors)
    if kind == "block":
        return physics.Block(size, mass, **start)
    return physics.Sphere(size[0], mass, **start) if kind == "sphere" else physics.Ellipsoid(size, mass, **start)


@st.composite
def drawn_scenes(draw):
    """Scenes that MJCF holds whole: with contact only where something touches."""
    some = draw(st.lists(bodies(), min_size=1, max_size=3))
    walls = [
        physics.HalfSpace(rotation_matrices(np.array(q))[:, 0], offset)
        for q, offset in draw(st.lists(st.tuples(quaternions(), COORDINATE), max_size=3))
    ]
    effects = [physics.Gravity(tuple(draw(st.tuples(COORDINATE, COORDINATE, st.floats(1, 20)))))]
    between = draw(st.booleans())
    if draw(st.booleans()) and (walls or (between and len(some) > 1)):
        effects.append(physics.Contact(between_bodies=between))
        mu = draw(st.one_of(st.just(0.0), st.floats(1e-5, 2.0)))  # MuJoCo has none between 0 and 1e-5
        effects += [physics.Friction(mu)] if mu else []
    return physics.Scene(some, walls, effects)


@pytest.mark.filterwarnings("ignore::physics.SceneWarning")
@given(drawn_scenes())
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_any_scene_comes_back(reader, scene):
    assert_same(from_mjcf(to_mjcf(scene)), scene)


def test_names_come_back_and_none_is_given_twice(reader):
    ball, cart = physics.Sphere(1, 1), physics.Sphere(1, 1, name="cart")
    assert [body.name for body in from_mjcf(to_mjcf(physics.Scene([ball, cart]))).bodies] == [None, "cart"]
    assert from_mjcf(to_mjcf(physics.Scene([cart])).replace('"cart"', '""')).bodies[0].name is None
    other = physics.Sphere(1, 1, name="body0")
    with pytest.raises(ValueError, match=r"Scene.bodies\[1\] has the name 'body0', which MJCF gives to .*bodies\[0\]"):
        to_mjcf(physics.Scene([ball, other]))


def test_what_mjcf_cannot_express_is_refused_or_named(tmp_path, reader):
    scene = physics.Scene([physics.Sphere(1, 1)], effects=[physics.Gravity(), physics.Drag(0.3), physics.Contact(0.5)])
    path = tmp_path / "scene.xml"
    with pytest.raises(ValueError, match=r"cannot express Contact.restitution of 0.5, Drag; .*drop=True"):
        physics.save_mjcf(scene, path)
    assert not path.exists()
    physics.save_mjcf(scene, path, drop=True)
    assert "left out: Contact.restitution of 0.5, Drag -->" in path.read_text()
    assert physics.load_mjcf(path).effects == (physics.Gravity(),)


def test_a_motion_is_left_out_and_its_body_stands_still(tmp_path, reader):
    belt = physics.Block((4, 1, 2), fixed=True, name="belt", motion=physics.Motion(surface_velocity=(0.8, 0, 0)))
    bouncy = physics.Sphere(0.5, 1.0, pos=(0, 1, 0), restitution=0.5)
    pushes = [physics.Push((1, 0, 0), body=1), physics.Push((0, 1, 0), body=1)]
    sensors = [physics.Sensor(physics.Sphere(0.5, fixed=True), name="gate")]
    scene = physics.Scene([belt, bouncy], effects=[physics.Contact(), *pushes], sensors=sensors)
    named = (
        "Block.motion of bodies[0] 'belt' (it stands still in MJCF), Sphere.restitution of bodies[1], 2 Push, "
        "sensors[0] 'gate'"
    )
    path = tmp_path / "belt.xml"
    with pytest.raises(ValueError, match=re.escape(f"MJCF cannot express {named}; pass drop=True")):
        physics.save_mjcf(scene, path)
    physics.save_mjcf(scene, path, drop=True)
    assert f"left out: {named} -->" in path.read_text()
    bodies = physics.load_mjcf(path).bodies
    assert [(body.fixed, body.motion) for body in bodies] == [(True, None), (False, None)]


def test_two_coefficients_of_friction_are_left_out_whole(tmp_path, reader):
    """A geom of MuJoCo has one along the surface: none is better than half of it."""
    grain = physics.Friction((0.2, 0.5), axis=(0, 0, 1))
    scene = physics.Scene([physics.Sphere(1, 1)], [physics.HalfSpace((0, 1, 0), -5)], [physics.Contact(), grain])
    with pytest.raises(ValueError, match=r"cannot express Friction of two coefficients \(0.2, 0.5\)"):
        physics.save_mjcf(scene, tmp_path / "scene.xml")
    physics.save_mjcf(scene, tmp_path / "scene.xml", drop=True)
    assert physics.load_mjcf(tmp_path / "scene.xml").effect(physics.Friction) is None
