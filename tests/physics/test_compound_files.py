"""Compounds in files: TOML and MJCF there and back, trajectories, snapshots, and errors that name part and line."""

from __future__ import annotations

import re
from importlib.util import find_spec

import numpy as np
import pytest

import physics
from physics.io.mjcf import plain_reader
from physics.io.mjcf.files import from_mjcf
from physics.io.mjcf.text import parse
from physics.io.mjcf.writer import to_mjcf
from physics.io.toml import from_toml, to_toml
from tests.physics.test_compounds import FLOOR, PULL, dumbbell, each_shape, turned

pytestmark = pytest.mark.interpreted

READERS = {"plain": lambda text: plain_reader.read_scene(parse(text)), "mujoco": from_mjcf}
FIXED = physics.Compound(
    [physics.Block((1, 1, 1), fixed=True), physics.Sphere(0.3, fixed=True, pos=(1, 0, 0))], pos=(5, 5, 5), fixed=True
)


def scene_of_all(**friction) -> physics.Scene:
    """A compound of a part of each shape, a fixed compound, and a ball."""
    rng = np.random.default_rng(11)
    whole = physics.Compound(
        each_shape(rng), pos=(1, 2, 3), quat=turned(rng), linvel=(1, 2, 3), angvel=(3, 2, 1), name="thing", **friction
    )
    laws = [PULL, physics.Contact(), physics.Friction(0.5)]
    return physics.Scene([whole, FIXED, physics.Sphere(0.1, 1.0, pos=(0, 9, 0))], [FLOOR], laws)


def test_a_scene_file_gives_an_equal_scene():
    scene = scene_of_all(friction=0.2)
    assert from_toml(to_toml(scene)) == scene
    assert eval(repr(FIXED), vars(physics)) == FIXED


@pytest.mark.parametrize(
    ("parts", "told"),
    [
        ("parts = 3", "line 3: bodies[0]: Compound.parts is 3; allowed is a list of Block"),
        ('parts = [{kind = "Blok"}]', "line 3: bodies[0]: parts[0]: kind is 'Blok'; allowed are Block, "),
        ('[[bodies.parts]]\nkind = "Block"\nsize = [1, 2]', "bodies[0]: parts[0]: Block.size has shape (2,)"),
        ('[[bodies.parts]]\nkind = "Sphere"\nradius = 1\nmass = 1\nname = "x"', "Compound.parts[0].name is 'x'"),
    ],
)
def test_an_error_names_the_part(parts, told):
    with pytest.raises(ValueError, match=re.escape(told)):
        from_toml(f'[[bodies]]\nkind = "Compound"\n{parts}\n')


def assert_alike(one: physics.Compound, other: physics.Compound) -> None:
    """Two compounds have the same mass properties and the same points, to rounding."""
    for name in ("pos", "quat", "linvel", "angvel", "mass", "inertia", "dimensions", "fixed", "name"):
        ours, theirs = getattr(one, name), getattr(other, name)
        if isinstance(ours, (str, bool, type(None))):
            assert ours == theirs
        else:
            np.testing.assert_allclose(ours, theirs, rtol=1e-6, atol=1e-12)
    assert [placed.part.kind for placed in one.placed_parts] == [placed.part.kind for placed in other.placed_parts]
    for ours, theirs in zip(one.placed_parts, other.placed_parts):
        np.testing.assert_allclose(ours.place, theirs.place, atol=1e-12)
        np.testing.assert_allclose(ours.half_extents, theirs.half_extents, rtol=1e-6)


@pytest.mark.parametrize("reader", sorted(READERS))
def test_mjcf_gives_the_compounds_back(reader):
    """MuJoCo keeps corners of meshes in single precision."""
    if reader == "mujoco" and find_spec("mujoco") is None:
        pytest.skip("MuJoCo is not installed")
    scene = scene_of_all()
    found = READERS[reader](to_mjcf(scene))
    assert len(found.bodies) == 3
    for k in range(2):
        assert_alike(scene.bodies[k], found.bodies[k])
    assert found.effects == scene.effects


@pytest.mark.parametrize("reader", sorted(READERS))
def test_mjcf_gives_friction_of_a_pair_back(reader):
    if reader == "mujoco" and find_spec("mujoco") is None:
        pytest.skip("MuJoCo is not installed")
    bodies = [dumbbell(pos=(0, 1, 0)), physics.Sphere(0.2, 1.0, pos=(2, 1, 0))]
    laws = [physics.Contact(), physics.Friction(0.5, pairs=((0, 1, 0.7),))]
    text = to_mjcf(physics.Scene(bodies, [FLOOR], laws))
    assert text.count("<pair ") == 3
    found = READERS[reader](text)
    assert found.effect(physics.Friction).pairs == ((0, 1, 0.7),)
    broken = text.replace('friction="0.7 0.7', 'friction="0.6 0.6', 1)
    with pytest.raises(ValueError, match="differ"):
        READERS[reader](broken)


def test_masses_of_geoms_alone_make_the_body():
    """Without <inertial> masses come from the geoms, by their densities or as stated."""
    geoms = '<geom type="box" size=".1 .2 .3" density="500"/><geom size=".2" pos="1 0 0" mass="3"/>'
    text = f'<mujoco><worldbody><body pos="0 0 1"><freejoint/>{geoms}</body></worldbody></mujoco>'
    body = plain_reader.read_scene(parse(text)).bodies[0]
    assert body.mass == pytest.approx(24.0 + 3.0)
    assert body.pos == pytest.approx((3.0 / 27.0, 0, 1))
    assert body.inertia_body is None


def test_a_trajectory_file_keeps_the_parts(tmp_path):
    scene = scene_of_all()
    physics.simulate(scene, 0.02, sample_dt=0.01).to_npz(tmp_path / "run.npz")
    found = physics.Trajectory.from_npz(tmp_path / "run.npz").scene
    for k in range(2):
        np.testing.assert_allclose(found.bodies[k].dimensions, scene.bodies[k].dimensions, atol=1e-14)
        kinds = [[placed.part.kind for placed in body.placed_parts] for body in (found.bodies[k], scene.bodies[k])]
        assert kinds[0] == kinds[1]
    np.testing.assert_allclose(found.bodies[0].inertia, scene.bodies[0].inertia, atol=1e-14)


def test_a_snapshot_goes_on_and_fits_no_other_parts():
    world = physics.World(physics.Scene([dumbbell(pos=(0, 1, 0))], [FLOOR], [PULL, physics.Contact()]))
    world.step(steps=2)
    kept = world.snapshot()
    world.step(steps=2)
    end = world.state.copy()
    world.restore(kept)
    world.step(steps=2)
    np.testing.assert_array_equal(world.state, end)
    longer = physics.Compound([*dumbbell().parts[:2], physics.Capsule(0.06, 0.8, 0.2)], pos=(0, 1, 0))
    other = physics.World(physics.Scene([longer], [FLOOR], [PULL, physics.Contact()]))
    with pytest.raises(ValueError, match="compound"):
        other.restore(kept)
