"""Inputs in the forms in which people have them: without an axis, to four digits, as a density."""

from __future__ import annotations

import dataclasses
import math
import re

import numpy as np
import pytest

import physics
from physics import validation

pytestmark = pytest.mark.interpreted

WORLDS = 3


def make(bodies: int, worlds: int = WORLDS, *effects) -> physics.World:
    """Spheres far from each other above the floor."""
    spheres = [physics.Sphere(0.5, 1.0 + b, pos=(3 * b, 2, 0)) for b in range(bodies)]
    scene = physics.Scene(spheres, physics.three_walls(), [physics.Gravity(), physics.Contact(between_bodies=False)])
    return physics.World(scene, worlds=worlds)


FORMS = [
    (1, (3,), lambda given: np.tile(given, (WORLDS, 1, 1))),
    (1, (WORLDS, 3), lambda given: given[:, None]),
    (1, (1, 3), lambda given: np.tile(given, (WORLDS, 1, 1))),
    (1, (WORLDS, 1, 3), lambda given: given),
    (2, (2, 3), lambda given: np.tile(given, (WORLDS, 1, 1))),
    (2, (WORLDS, 2, 3), lambda given: given),
    (WORLDS, (WORLDS, 3), lambda given: np.tile(given, (WORLDS, 1, 1))),  # two axes of several bodies are theirs
]


@pytest.mark.parametrize(("bodies", "shape", "full"), FORMS)
def test_a_state_may_leave_out_axes(bodies, shape, full, rng):
    given = rng.uniform(-1, 1, shape) + np.array((0, 3, 0))
    short, long = make(bodies), make(bodies)
    short.set_state(pos=given, linvel=given)
    long.set_state(pos=full(given), linvel=full(given))
    assert np.array_equal(short.state, long.state)
    assert np.array_equal(short.pos, full(given))


@pytest.mark.parametrize(("bodies", "shape", "full"), FORMS)
def test_a_wrench_may_leave_out_axes(bodies, shape, full, rng):
    given = rng.uniform(-1, 1, (*shape[:-1], 6))
    short, long = make(bodies), make(bodies)
    short.step(given)
    long.step(full(given))
    assert short.state.tobytes() == long.state.tobytes()


def test_a_part_of_the_worlds_is_what_the_axis_of_worlds_means():
    world = make(1)
    world.set_state(pos=[(0, 4, 0), (0, 5, 0)], worlds=[2, 0])
    assert world.pos[:, 0, 1].tolist() == [5, 2, 4]
    world.set_state(quat=(1, 0, 0, 0), linvel=(1, 2, 3), worlds=[1])
    assert world.linvel[:, 0].tolist() == [[0, 0, 0], [1, 2, 3], [0, 0, 0]]
    world.set_state(pos=np.zeros((0, 3)), worlds=[])


def test_a_quaternion_of_four_digits_is_normalised(rng):
    exact = rng.normal(size=(2000, 4))
    exact /= np.linalg.norm(exact, axis=1, keepdims=True)
    rounded = np.round(exact, 4)
    assert np.abs(np.linalg.norm(rounded, axis=1) - 1).max() > 3e-5  # to be seen at all
    unit = validation.unit_quaternion(rounded, rounded.shape, "quat")
    assert np.abs(np.linalg.norm(unit, axis=1) - 1).max() <= validation.UNIT_ROUNDING
    assert np.abs(unit - exact).max() <= 1.5e-4
    body = physics.Sphere(1, 1, quat=(0.7071, 0.7071, 0, 0))
    assert body.quat == pytest.approx((math.sqrt(0.5), math.sqrt(0.5), 0, 0), rel=1e-15)
    world = make(1)
    world.set_state(quat=(0.7071, 0.7071, 0, 0))
    assert np.array_equal(world.quat[1, 0], body.quat)


def test_a_unit_quaternion_keeps_its_bits(rng):
    exact = rng.normal(size=(2000, 4))
    exact /= np.linalg.norm(exact, axis=1, keepdims=True)
    assert validation.unit_quaternion(exact, exact.shape, "quat").tobytes() == exact.tobytes()


@pytest.mark.parametrize("off", [1.02e-4, -1.02e-4])
def test_a_rougher_quaternion_is_refused_with_its_norm(off):
    with pytest.raises(ValueError, match=rf"of norm {1 + off:.6g}; allowed are unit quaternions .* within 0.0001"):
        physics.Sphere(1, 1, quat=(1 + off, 0, 0, 0))


TETRAHEDRON = ((0, 0, 0), (3, 0, 0), (0, 2, 0), (0, 0, 1))


@pytest.mark.parametrize(
    ("kind", "shape", "volume"),
    [
        (physics.Block, (1, 2, 3), 6.0),
        (physics.Sphere, 2.0, 4 / 3 * math.pi * 8),
        (physics.Ellipsoid, (1, 2, 3), 4 / 3 * math.pi * 6),
        (physics.Hull, TETRAHEDRON, 1.0),
    ],
)
def test_a_density_stands_for_a_mass(kind, shape, volume):
    body = kind(shape, density=0.5)
    assert body.volume == pytest.approx(volume, rel=1e-14)
    assert body.mass == 0.5 * body.volume
    assert body == kind(shape, body.mass)
    assert hash(body) == hash(kind(shape, body.mass))
    assert "density" not in repr(body)
    assert eval(repr(body), vars(physics)) == body
    assert dataclasses.replace(body, pos=(1, 2, 3)).mass == body.mass
    assert dataclasses.replace(body, mass=None, density=1.0).mass == body.volume


def falling() -> physics.Scene:
    """A block that falls, bounces and turns."""
    block = physics.Block((1, 0.5, 0.3), 2.0, pos=(0, 1, 0), angvel=(1, 2, 3))
    return physics.Scene([block], physics.three_walls(), [physics.Gravity(), physics.Contact(0.4), physics.Friction()])


def test_simulate_takes_a_step_of_its_own():
    fine = physics.simulate(falling(), 0.5, sample_dt=0.05, dt=0.01)
    world = physics.World(falling(), dt=0.01)
    poses = [world.pos[0].copy()]
    for _ in range(10):
        world.step(steps=5)
        poses.append(world.pos[0].copy())
    assert np.array_equal(fine.pos, poses)
    assert np.allclose(fine.t, np.arange(11) * 0.05, rtol=1e-12)
    assert len(fine.reports) == 10
    each = physics.simulate(falling(), 0.5, dt=0.01)  # a sample at every step
    assert np.array_equal(each.pos[::5], fine.pos)
    assert np.array_equal(each.pos, physics.simulate(falling(), 0.5, sample_dt=0.01).pos)
    assert physics.simulate(falling(), 0.1).t.shape == (11,)


def test_the_last_interval_is_cut_into_steps_no_longer_than_dt():
    found = physics.simulate(falling(), 0.125, sample_dt=0.05, dt=0.01)
    assert found.t.tolist() == [0, 0.05, 0.1, 0.125]
    world = physics.World(falling(), dt=0.01)
    world.step(steps=5)
    world.step(steps=5)
    world.step(steps=3, dt=(0.125 - 0.1) / 3)
    assert np.array_equal(found.pos[-1], world.pos[0])


def test_every_event_between_samples_is_kept_behind_an_actuator_that_remembers():
    scene = falling()
    late = dataclasses.replace(scene, effects=(*scene.effects, physics.Actuator(lag=0.01)))
    each = physics.simulate(late, 1.0, "precise", dt=0.02)
    some = physics.simulate(late, 1.0, "precise", sample_dt=0.1, dt=0.02)
    assert len(each.events) > 3
    assert [(e.kind, e.wall) for e in some.events] == [(e.kind, e.wall) for e in each.events]
    assert np.allclose([e.t for e in some.events], [e.t for e in each.events], atol=1e-9)
    assert sum(int(r.impacts[0]) for r in some.reports) == sum(int(r.impacts[0]) for r in each.reports)


@pytest.mark.parametrize("form", [(6,), (1, 6), (1, 1, 6)])
def test_simulate_takes_a_constant_wrench(form):
    load = np.arange(6.0)
    held = physics.simulate(falling(), 0.2, wrench=load.reshape(form))
    called = physics.simulate(falling(), 0.2, wrench=lambda t, world: load.reshape(form))
    free = physics.simulate(falling(), 0.2)
    assert held.pos.tobytes() == called.pos.tobytes() != free.pos.tobytes()


def test_numbers_of_every_real_kind_are_taken():
    from decimal import Decimal
    from fractions import Fraction

    kinds = (2, 2.0, np.float32(2), np.int8(2), np.array(2.0), Fraction(2), Decimal(2), 2 * np.ones(()))
    assert {physics.Sphere(kind, 1).radius for kind in kinds} == {2.0}
    assert physics.Block(np.array([1, 2, 3], dtype=object), 1).size == (1.0, 2.0, 3.0)
    assert physics.Block(range(1, 4), 1).size == (1.0, 2.0, 3.0)
    assert physics.Contact(between_bodies=np.True_).between_bodies is True
    accuracy = physics.Accuracy(substeps=np.int64(3), tolerance=np.float32(0.5))
    assert (type(accuracy.substeps), type(accuracy.tolerance)) == (int, float)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: physics.Block((1, 1, 1), -1, name="crate"), "Block.mass of 'crate' is -1.0; allowed are numbers"),
        (lambda: physics.Block((1, 1), 1), "Block.size has shape (2,); allowed is shape (3,); given: [1.0, 1.0]"),
        (lambda: physics.Sphere(0, 1), "Sphere.radius is 0.0; allowed are numbers greater than 0"),
        (lambda: physics.Capsule(0.1, 1, 1, quat=(0, 0, 0, 0)), "Capsule.quat is "),
        (lambda: physics.Sphere(1, 1, name=" "), "Sphere.name is ' '; allowed are printable"),
        (lambda: physics.Compound([1], name="chair"), "Compound.parts[0] of 'chair' is 1; allowed are instances"),
        (
            lambda: physics.Gravity(9.81),
            "Gravity.acceleration is 9.81; allowed is shape (3,), such as (0, -9.81, 0) if y",
        ),
        (
            lambda: physics.Gravity((0, 1)),
            "Gravity.acceleration has shape (2,); allowed is shape (3,); given: [0.0, 1.0]",
        ),
        (
            lambda: make(2, 1).set_state(pos=(1, 2)),
            "pos has shape (2,); allowed is shape (2, 3) or (1, 2, 3); given: [1.0, 2.0]",
        ),
        (
            lambda: make(2, 1).set_state(pos=np.zeros((9, 9))),
            "pos has shape (9, 9); allowed is shape (2, 3) or (1, 2, 3)",
        ),
    ],
)
def test_a_wrong_value_is_told_with_its_owner_and_what_was_given(make, message):
    with pytest.raises(ValueError, match=f"^{re.escape(message)}") as told:
        make()
    assert ("given" in str(told.value)) == ("given" in message)


@pytest.mark.parametrize("load", [physics.load_scene, physics.load_mjcf])
def test_a_folder_is_no_file(load, tmp_path):
    with pytest.raises(IsADirectoryError, match=r"path is '.*', which is a folder; allowed is a .*file"):
        load(tmp_path)
