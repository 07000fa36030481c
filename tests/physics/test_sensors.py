"""Sensors: overlap against closed forms, carriers, equal bits of the motion, files, and mistakes."""

from __future__ import annotations

import pickle

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

import physics
from physics.io.mjcf.writer import to_mjcf
from physics.io.toml import from_toml, to_toml
from physics.rotations import product, rotation_matrices
from physics.scene.canonical_scenes import SCENES

pytestmark = pytest.mark.interpreted

RADIUS = 0.3
numbers = st.floats(-1.5, 1.5)
places = st.tuples(numbers, numbers, numbers)
# Gaps nearer to 0 than this are left out: rounding of coordinates of a metre decides there.
CLEAR = 1e-12

EDGES, TUBE, LENGTH, BALL = np.array((1.0, 0.6, 1.4)), 0.25, 1.1, 0.7
CORNERS = [tuple(0.5 * EDGES * signs) for signs in np.ndindex(2, 2, 2) for signs in [2 * np.array(signs) - 1]]


def gap_of_block(x):
    """Distance of a point from the block, 0 inside."""
    return np.linalg.norm(np.maximum(np.abs(x) - 0.5 * EDGES, 0.0))


def gap_of_capsule(x):
    """Distance of a point from the capsule along y, 0 inside."""
    y = np.clip(x[1], -0.5 * LENGTH, 0.5 * LENGTH)
    return max(np.linalg.norm(x - (0, y, 0)) - TUBE, 0.0)


def gap_of_ball(x):
    """Distance of a point from the ball, 0 inside."""
    return max(np.linalg.norm(x) - BALL, 0.0)


# Two balls; their parts are placed relative to the middle between them.
APART = np.array((0.6, 0.0, 0.0))


def gap_of_dumbbell(x):
    """Distance of a point from the two balls, 0 inside."""
    return max(min(np.linalg.norm(x - APART), np.linalg.norm(x + APART)) - TUBE, 0.0)


SHAPES = {
    "block": (lambda **place: physics.Block(tuple(EDGES), fixed=True, **place), gap_of_block),
    "hull": (lambda **place: physics.Hull(CORNERS, fixed=True, **place), gap_of_block),
    "capsule": (lambda **place: physics.Capsule(TUBE, LENGTH, fixed=True, **place), gap_of_capsule),
    "sphere": (lambda **place: physics.Sphere(BALL, fixed=True, **place), gap_of_ball),
    "ellipsoid": (lambda **place: physics.Ellipsoid((BALL, BALL, BALL), fixed=True, **place), gap_of_ball),
    "compound": (
        lambda **place: physics.Compound([physics.Sphere(TUBE, 1.0, pos=tuple(s * APART)) for s in (1, -1)], **place),
        gap_of_dumbbell,
    ),
}


def quaternion(rotation):
    """Quaternion (w, x, y, z) of a rotation vector [rad]."""
    x, y, z, w = Rotation.from_rotvec(rotation).as_quat()
    return w, x, y, z


def world_of(*sensors, worlds=1, **more) -> physics.World:
    """A ball, a carrier that floats far away, and sensors."""
    bodies = [
        physics.Sphere(RADIUS, 1.0, name="ball"),
        physics.Block((0.1, 0.1, 0.1), 1.0, pos=(0, 50, 0), name="carrier", **more),
    ]
    return physics.World(physics.Scene(bodies, sensors=sensors), worlds=worlds)


@pytest.mark.parametrize("kind", SHAPES)
@settings(max_examples=60, deadline=None)
@given(ball=places, place=places, turn=places)
def test_a_ball_is_in_a_region_if_its_centre_is_nearer_than_its_radius(kind, ball, place, turn):
    make, gap_of = SHAPES[kind]
    quat = quaternion(turn)
    world = world_of(physics.Sensor(make(pos=place, quat=quat)))
    world.set_state(pos=[ball, (0, 50, 0)])
    gap = gap_of(rotation_matrices(quat).T @ (np.array(ball) - place)) - RADIUS
    if abs(gap) > CLEAR:
        assert world.read_sensors().tolist() == [[[gap < 0, False]]]


@pytest.mark.parametrize("kind", SHAPES)
def test_a_sensor_goes_with_its_carrier_and_does_not_tell_about_it(kind):
    rng = np.random.default_rng(3)
    make, gap_of = SHAPES[kind]
    seen = []
    for _ in range(40):
        place, way, x = rng.uniform(-1, 1, (3, 3))
        quat, turn = (quaternion(v) for v in rng.uniform(-2, 2, (2, 3)))
        world = world_of(physics.Sensor(make(pos=place, quat=quat), "carrier"))
        ball = x + rotation_matrices(np.array(turn)) @ place + way
        world.set_state(pos=[ball, x], quat=[(1, 0, 0, 0), turn])
        gap = gap_of(rotation_matrices(product(np.array(turn), np.array(quat))).T @ way) - RADIUS
        seen.append(gap < 0)
        assert world.read_sensors().tolist() == [[[gap < 0, False]]]
    assert 5 < sum(seen) < 35


def test_fixed_driven_and_several_bodies_are_told_of_each_sensor_apart():
    steady = physics.Motion(velocity=(1, 0, 0))
    bodies = [
        physics.Sphere(0.5, 1.0),
        physics.Block((1, 1, 1), fixed=True, pos=(3, 0, 0)),
        physics.Capsule(0.2, 1.0, fixed=True, pos=(6, 0, 0), motion=steady),
    ]
    sensors = [physics.Sensor(physics.Block((size, 1, 1), fixed=True)) for size in (1.0, 5.1, 11.7)]
    world = physics.World(physics.Scene(bodies, effects=[physics.Contact()], sensors=sensors), dt=0.05)
    assert world.read_sensors()[0].tolist() == [[True, False, False], [True, True, False], [True, True, True]]
    world.step()  # the capsule has gone 0.05 m: from 5.8 m to 5.85 m, where the region ends
    world.step()
    assert world.read_sensors()[0].tolist() == [[True, False, False], [True, True, False], [True, True, False]]


@pytest.mark.parametrize("accuracy", ["fast", "balanced", "precise"])
@pytest.mark.parametrize("name", ["drop", "two_blocks"])
def test_the_motion_has_the_same_bits_and_the_same_plan_with_and_without_sensors(name, accuracy):
    scene = SCENES[name]() if name in SCENES else pair()
    region = physics.Sensor(physics.Hull(CORNERS, fixed=True, pos=(0, 1, 0)), 0)
    room = physics.Sensor(physics.Compound([physics.Sphere(5.0, 1.0), physics.Capsule(1.0, 2.0, 1.0)]))
    seen = physics.Scene(scene.bodies, scene.walls, scene.effects, sensors=[region, room])
    plain, sensed = (physics.World(each, accuracy=accuracy) for each in (scene, seen))
    assert plain.plan.key == sensed.plan.key
    for _ in range(4):
        plain.step(steps=2)
        sensed.step(steps=2)
        sensed.read_sensors()
    for ours, theirs in zip(plain.kept(), sensed.kept(), strict=True):
        np.testing.assert_array_equal(ours, theirs)


def pair() -> physics.Scene:
    """A ball that falls on a block on a floor."""
    bodies = [physics.Block((1, 1, 1), 2.0, pos=(0, 0.5, 0)), physics.Sphere(0.4, 1.0, pos=(0.1, 1.405, 0))]
    effects = [physics.Gravity(), physics.Contact(0.3), physics.Friction(0.5)]
    return physics.Scene(bodies, [physics.HalfSpace((0, 1, 0))], effects)


def test_each_world_of_a_batch_tells_what_it_tells_alone_and_out_is_filled_anew():
    places = np.random.default_rng(0).uniform(-1.2, 1.2, (20, 2, 3))
    sensors = [physics.Sensor(SHAPES["hull"][0]()), physics.Sensor(SHAPES["compound"][0](pos=(0.2, 0, 0)), 1)]
    world = world_of(*sensors, worlds=20)
    world.set_state(pos=places)
    found = world.read_sensors()
    for k in range(20):
        alone = world_of(*sensors)
        alone.set_state(pos=places[k])
        np.testing.assert_array_equal(alone.read_sensors()[0], found[k])
    assert found.any(axis=0).sum() == 3  # the carrier is not in its own
    assert not found.all(axis=0).any()
    out = np.ones_like(found)
    assert world.read_sensors(out=out) is out
    np.testing.assert_array_equal(out, found)
    np.testing.assert_array_equal(world.read_sensors([7, 2]), found[[7, 2]])
    np.testing.assert_array_equal(pickle.loads(pickle.dumps(world)).read_sensors(), found)


def test_a_scene_without_sensors_has_an_empty_answer_and_no_row_in_its_plan():
    world = world_of(worlds=3)
    assert world.read_sensors().shape == (3, 0, 2)
    assert "sensors" not in world.plan.explain()
    assert "1 region" in world_of(physics.Sensor(SHAPES["block"][0]())).plan.explain()


def test_sensors_stand_in_scene_files():
    sensors = [
        physics.Sensor(SHAPES["block"][0](pos=(1, 2, 3)), name="goal"),
        physics.Sensor(SHAPES["compound"][0](), "carrier"),
        physics.Sensor(SHAPES["hull"][0](), 0),
    ]
    scene = world_of(*sensors).scene
    assert from_toml(to_toml(scene)) == scene
    assert eval(repr(sensors[0]), vars(physics)) == sensors[0]
    assert "3 sensors" in repr(scene)


def test_mjcf_refuses_sensors_or_leaves_them_out():
    scene = world_of(physics.Sensor(SHAPES["block"][0](), name="goal")).scene
    with pytest.raises(ValueError, match=r"cannot express sensors\[0\]"):
        to_mjcf(scene)
    assert "left out: sensors[0] 'goal' -->" in to_mjcf(scene, drop=True)


BALL_SHAPE = physics.Sphere(1.0, fixed=True)
TABLE = 'format = 1\n[[bodies]]\nkind = "Sphere"\nradius = 1\nmass = 1\n[[sensors]]\n'

REFUSED = {
    "no shape": (lambda: physics.Sensor("ball"), ("Sensor.shape", "'ball'", "physics.Sphere")),
    "speed": (lambda: physics.Sensor(physics.Sphere(1.0, 1.0, linvel=(1, 0, 0))), ("linvel", "(1.0, 0.0, 0.0)")),
    "friction": (lambda: physics.Sensor(physics.Sphere(1.0, 1.0, friction=0.5)), ("friction", "0.5")),
    "negative": (lambda: physics.Sensor(BALL_SHAPE, -1), ("Sensor.body", "-1")),
    "blank": (lambda: physics.Sensor(BALL_SHAPE, name=" "), ("Sensor.name", "' '")),
    "carrier": (lambda: world_of(physics.Sensor(BALL_SHAPE, "bal")), ("Scene.sensors[0].body", "'bal'", "ball")),
    "index": (lambda: world_of(physics.Sensor(BALL_SHAPE, 2)), ("Scene.sensors[0].body", "2", "from 0 to 1")),
    "name": (lambda: world_of(physics.Sensor(BALL_SHAPE, name="ball")), ("Scene.sensors[0]", "Scene.bodies[0]")),
    "a body": (lambda: world_of(BALL_SHAPE), ("Scene.sensors[0]", "Sensor")),
    "out": (lambda: world_of().read_sensors(out=np.zeros((1, 1, 2), bool)), ("out", "(1, 0, 2)")),
    "file": (lambda: from_toml(TABLE + "shape = {kind = 'Ball'}\n"), ("line 7", "shape", "'Ball'", "Sphere")),
    "key": (lambda: from_toml(TABLE + "shape = {kind = 'Sphere', size = 1}\n"), ("line 7", "shape", "size", "radius")),
    "missing": (lambda: from_toml(TABLE + "name = 'goal'\n"), ("sensors[0]", "shape is missing")),
    "of file": (
        lambda: from_toml(TABLE + "shape = {kind = 'Sphere', radius = 1, fixed = true}\nbody = 3"),
        ("line 6", "sensors[0].body", "3"),
    ),
}


@pytest.mark.parametrize("name", REFUSED)
def test_mistakes_are_told_with_field_value_and_what_is_allowed(name):
    make, words = REFUSED[name]
    with pytest.raises(ValueError, match=r"allowed|has the name|is missing") as error:
        make()
    assert all(word in str(error.value) for word in words), str(error.value)
