"""Contacts of many worlds: against `World.contacts`, the balance of momentum, and a choice in plain NumPy."""

from __future__ import annotations

import pickle
from functools import cache

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import physics
from physics.kernels.half_space.persistent_contacts import WALL_MEMORY_HEAD
from physics.kernels.multibody.data import arrays as many
from physics.world.contacts import contact_rows
from rigid_env.envs.task import TaskEnv
from rigid_env.tasks import Task, observe
from tests.tasks.conftest import Free, Slide, started

pytestmark = pytest.mark.interpreted

FLOOR = physics.HalfSpace((0, 1, 0), 0.0)
CORNER = [FLOOR, physics.HalfSpace((1, 0, 0), 0.0), physics.HalfSpace((0, 0, 1), 0.0)]
PRESSED = (physics.Gravity((-3.0, -9.0, -4.0)), physics.Contact(), physics.Friction(0.5))
GROUNDED = (physics.Gravity(), physics.Contact(), physics.Friction(0.5))
DT = 0.005
SKEW = np.array([2.0, 6.0, 3.0]) / 7.0  # a unit vector of which no two components are the same


def crate(x=0.0, y=0.5, z=0.0, mass=3.0, **more) -> physics.Block:
    return physics.Block((2, 1, 2), mass, pos=(x, y, z), **more)


SCENES = {
    "block": physics.Scene([crate()], [FLOOR], GROUNDED),
    "corner": physics.Scene([crate(1.0, 0.5, 1.0)], CORNER, PRESSED),
    "sphere": physics.Scene([physics.Sphere(0.5, 2.0, pos=(0, 0.5, 0))], [FLOOR], GROUNDED),
    "slope": physics.Scene(
        [physics.Sphere(0.5, 2.0, pos=tuple(0.5 * SKEW))], [physics.HalfSpace(tuple(SKEW), 0.0)], GROUNDED
    ),
    "two apart": physics.Scene(
        [crate(1.0, 0.5, 1.0), physics.Sphere(0.5, 2.0, pos=(4, 0.5, 4))], CORNER,
        (*GROUNDED[:1], physics.Contact(between_bodies=False), physics.Friction(0.5)),
    ),
    "tower": physics.Scene([crate(y=0.5 + k, mass=1.0 + k) for k in range(4)], [FLOOR], GROUNDED),
    "in the air": physics.Scene([crate(y=50.0)], [FLOOR], GROUNDED),
    "without contact": Free.scene,
}  # fmt: skip


def moved(name: str, accuracy: str = "balanced", worlds: int = 3, steps: int = 30) -> physics.World:
    """Worlds of a scene whose bodies were pushed by other forces each."""
    return pickle.loads(pickled(name, accuracy, worlds, steps))


@cache
def pickled(name: str, accuracy: str, worlds: int, steps: int) -> bytes:
    """The same, kept: each test takes a copy."""
    world = physics.World(SCENES[name], worlds, DT, accuracy)
    wrench = np.zeros((worlds, world.body_count, 6))
    weights = 9.81 * np.array([body.mass for body in world.scene.bodies])
    wrench[..., :3] = np.random.default_rng(1).uniform(-0.3, 0.3, wrench[..., :3].shape) * weights[:, None]
    for _ in range(steps):
        world.step(wrench)
    return pickle.dumps(world)


def read(world: physics.World, rows: int, *body: int) -> physics.Contacts:
    return world.read_contacts(None, rows, *body)


# --- the same as of one world ---------------------------------------------------------------------------------


@pytest.mark.parametrize("accuracy", ["fast", "balanced", "precise"])
@pytest.mark.parametrize("name", SCENES)
def test_rows_are_the_contacts_of_each_world(name, accuracy, is_exhaustive):
    world = moved(name, accuracy, steps=30 if is_exhaustive or accuracy == "balanced" else 6)
    rows = contact_rows(world) + 1
    found = read(world, rows)
    for i in range(world.worlds):
        points, forces = world.contacts(i)
        count = len(points)
        assert found.count[i] == count
        assert name not in ("in the air", "without contact") or count == 0
        np.testing.assert_array_equal(found.point[i, :count], points)
        np.testing.assert_array_equal(found.ends[i, :count], world.contact_ends(i))
        # Three products each, summed in another order: a few roundings of the largest.
        np.testing.assert_allclose(found.force[i, :count], forces, rtol=0, atol=8e-16 * np.abs(forces).max(initial=0))
        for values in (found.point, found.force, found.impulse, found.ends):
            assert not values[i, count:].any()
    assert found.count.any() == (name not in ("in the air", "without contact"))


def test_worlds_may_be_chosen():
    world = moved("tower")
    every, some = read(world, 20), world.read_contacts([2, 0], 20)
    for ours, theirs in zip(some, every, strict=True):
        np.testing.assert_array_equal(ours, theirs[[2, 0]])


def test_a_corner_touches_three_walls():
    world = physics.World(SCENES["corner"], 1, DT)
    for _ in range(20):
        world.step()
    found = read(world, 12)
    assert found.count[0] == 12
    assert {end for _, end in found.ends[0].tolist()} == {-1, -2, -3}


# --- forces and impulses --------------------------------------------------------------------------------------


def momentum(world: physics.World) -> np.ndarray:
    """(worlds, bodies, 3) [kg m/s]."""
    return world.linvel * np.array([body.mass for body in world.scene.bodies])[:, None]


def gain(world: physics.World) -> tuple[np.ndarray, np.ndarray]:
    """Momentum that contacts gave to each body in a step, and the sum of the impulses that are told."""
    mass = np.array([body.mass for body in world.scene.bodies])
    before = momentum(world)
    world.step()
    loads = DT * mass[:, None] * np.array(world.scene.effect(physics.Gravity).acceleration)
    told = np.zeros_like(before)
    for b in range(world.body_count):
        told[:, b] = read(world, contact_rows(world), b).impulse.sum(axis=1)
    return momentum(world) - before - loads, told


@pytest.mark.parametrize("name", ["block", "corner", "sphere", "slope", "two apart", "tower"])
def test_impulses_are_the_momentum_that_a_step_without_collisions_gives(name, is_exhaustive):
    """Σ p = m Δv - m g h, whatever the solver's tolerance: the impulses told are those that moved the bodies."""
    world = moved(name)
    weight = 9.81 * sum(body.mass for body in world.scene.bodies)
    for _ in range(20 if is_exhaustive else 6):
        given, told = gain(world)
        # Each body's velocity is rounded once per contact; at most 16 contacts act on a body here.
        speed = np.abs(world.linvel).max()
        atol = 32 * np.finfo(float).eps * (weight * DT + speed * weight / 9.81)
        np.testing.assert_allclose(told, given, rtol=0, atol=atol)
        found = read(world, 8)
        np.testing.assert_allclose(found.impulse, DT * found.force, rtol=1e-14, atol=0)  # one stage a step


def test_forces_of_a_block_at_rest_carry_its_weight():
    world = physics.World(SCENES["block"], 2, DT)
    for _ in range(50):
        world.step()
    weight = 3.0 * 9.81
    # The contact problem is solved to this share of the speed that loads give in a step: of the weight, that is.
    atol = world.accuracy.tolerance * weight
    found = read(world, 4)
    np.testing.assert_allclose(found.force.sum(axis=1), [[0.0, weight, 0.0]] * 2, rtol=0, atol=atol)
    np.testing.assert_allclose(found.force[..., 1], 0.25 * weight, rtol=0, atol=atol)  # symmetric


@pytest.mark.parametrize("name", ["sphere", "tower"])
def test_a_collision_is_not_in_the_impulses(name):
    world = physics.World(SCENES[name], 1, DT)
    speed = 4.0
    world.set_state(linvel=np.full((1, world.body_count, 3), (0.0, -speed, 0.0)))
    given, told = gain(world)
    mass = sum(body.mass for body in world.scene.bodies)
    assert given.sum(axis=1)[0, 1] > mass * speed
    assert told.sum(axis=1)[0, 1] < 0.1 * mass * speed


def test_events_tell_their_force_for_a_physics_step(is_exhaustive):
    found = read(moved("corner", "precise", steps=30 if is_exhaustive else 6), 12)
    np.testing.assert_allclose(found.impulse, DT * found.force, rtol=1e-15, atol=0)
    assert found.force.any()


def test_substeps_make_stages_shorter_and_forces_the_same():
    world = physics.World(SCENES["block"], 1, DT, physics.Accuracy(substeps=4))
    for _ in range(20):
        world.step()
    found = read(world, 4)
    np.testing.assert_allclose(found.force.sum(axis=1)[0, 1], 3.0 * 9.81, rtol=1e-5)
    np.testing.assert_allclose(found.impulse, 0.25 * DT * found.force, rtol=1e-14, atol=0)


# --- the strongest --------------------------------------------------------------------------------------------

WHOLE = st.integers(-2, 2).map(float)  # equal ones are frequent


def write_tower(world: physics.World, numbers: np.ndarray) -> None:
    """Write impulses (worlds, contacts, 3) into the memory of bodies that touch each other."""
    for i in range(world.worlds):
        for k in range(int(world.memory[i, many.WARM_CONTACT_COUNT])):
            first = many.WARM_HEADER_SIZE + many.WARM_CONTACT_SIZE * k + many.WARM_IMPULSE
            world.memory[i, first : first + 3] = numbers[i, k]


def write_box(world: physics.World, numbers: np.ndarray) -> None:
    """The same for bodies that meet walls only."""
    first = WALL_MEMORY_HEAD + (world.memory.shape[1] - WALL_MEMORY_HEAD) // 4
    for i, row in enumerate(world.memory):
        for k in range(int(row[1])):
            slot = int(row[WALL_MEMORY_HEAD + k])
            row[first + 3 * slot : first + 3 * slot + 3] = numbers[i % world.worlds, k + i // world.worlds]


@cache
def of_two(name: str) -> physics.World:
    """Two worlds, whose memory a test may change and put back."""
    return moved(name, worlds=2)


@given(
    numbers=st.lists(WHOLE, min_size=120, max_size=120), rows=st.integers(1, 20), body=st.integers(-1, 3),
    case=st.sampled_from([("tower", write_tower), ("two apart", write_box)]),
)  # fmt: skip
def test_the_strongest_are_kept_in_their_order(numbers, rows, body, case):
    world, write = of_two(case[0]), case[1]
    body, kept = min(body, world.body_count - 1), world.snapshot()
    try:
        write(world, np.array(numbers).reshape(2, 20, 3))
        found, every = read(world, rows, *([body] if body >= 0 else [])), read(world, contact_rows(world) + 8)
    finally:
        world.restore(kept)
    for i in range(world.worlds):
        count = every.count[i]
        ends, forces, points = every.ends[i, :count], every.force[i, :count], every.point[i, :count]
        if body >= 0:
            forces = np.where(ends[:, :1] == body, forces, -forces)
            own = (ends == body).any(axis=1)
            ends = np.where(ends[:, :1] == body, ends, ends[:, ::-1])[own]
            forces, points = forces[own], points[own]
        strongest = np.sort(np.argsort(-np.round((forces**2).sum(axis=1), 6), kind="stable")[:rows])
        assert found.count[i] == len(forces)
        number = len(strongest)
        np.testing.assert_allclose(found.force[i, :number], forces[strongest], rtol=1e-14, atol=1e-10)
        np.testing.assert_array_equal(found.ends[i, :number], ends[strongest])
        np.testing.assert_array_equal(found.point[i, :number], points[strongest])


# --- in tasks -------------------------------------------------------------------------------------------------


class Tower(Task):
    """Four blocks, of which the lowest is pushed."""

    scene = SCENES["tower"]
    observation = (
        *(entry(body, 8) for entry in (observe.contact_points, observe.contact_forces) for body in range(4)),
        *(entry(body) for entry in (observe.contact_force, observe.contact_impulse) for body in range(4)),
    )

    def rewards(self, worlds):
        self.seen, self.again = worlds.contacts, worlds.contacts
        self.impulse, self.force, self.pos = worlds.contact_impulse, worlds.contact_force, worlds.pos.copy()
        self.weight = worlds.weight.copy()
        return {}


def test_callbacks_see_contacts_and_sums():
    task = started(Tower(2))
    for _ in range(10):
        task.step(np.full((2, 6), 0.2))
    assert task.seen is task.again  # worked out once
    expected = read(task.world, contact_rows(task.world))
    for ours, theirs in zip(task.seen, expected, strict=True):
        np.testing.assert_array_equal(ours, theirs)
    for b in range(4):
        own = read(task.world, 16, b)
        for told, rows in ((task.force, own.force), (task.impulse, own.impulse)):
            np.testing.assert_allclose(told[:, b], rows.sum(axis=1), rtol=0, atol=1e-14 * np.abs(rows).max())


def test_entries_tell_points_and_forces_of_a_body():
    task = started(Tower(2))
    for _ in range(10):
        task.step(np.full((2, 6), 0.2))
    obs = task.obs.astype(np.float64)
    points, forces = (part.reshape(2, 4, 8, 3) for part in (obs[:, :96], obs[:, 96:192]))
    sums, impulses = obs[:, 192:204].reshape(2, 4, 3), obs[:, 204:].reshape(2, 4, 3)
    single = np.finfo(np.float32).eps  # observations are float32
    for b in range(4):
        own = read(task.world, 8, b)
        assert own.count.max() <= 8
        there = np.arange(8) < own.count[:, None]
        arms = (own.point - task.pos[:, b, None]) * there[..., None]
        np.testing.assert_allclose(points[:, b], arms / 5.0, rtol=single, atol=1e-12)
        np.testing.assert_allclose(forces[:, b], own.force / task.weight[:, b, None, None], rtol=single, atol=1e-12)
    np.testing.assert_allclose(forces.sum(axis=2), sums, rtol=0, atol=1e-5)
    np.testing.assert_allclose(impulses, 0.5 * sums, rtol=1e-5, atol=1e-6)  # 5 ms in units of 10 ms


def test_entries_have_names_and_bounds():
    points, forces = observe.contact_points(1, 2, scale=2.0, bound=3.0), observe.contact_forces(count=1)
    assert points.names == tuple(f"contact of body 1: point {k} {axis}" for k in range(2) for axis in "xyz")
    assert forces.names == ("contact: force 0 x", "contact: force 0 y", "contact: force 0 z")
    assert (points.told_unit, points.low, points.high) == ("2 m", -3.0, 3.0)
    assert (forces.told_unit, observe.contact_impulse().told_unit) == ("m g", "0.01 m g s")


@pytest.mark.parametrize("count", [0, -1, 1.5, "4", True, 10**9])
@pytest.mark.parametrize("entry", [observe.contact_points, observe.contact_forces])
def test_a_wrong_count_is_refused(entry, count):
    with pytest.raises(ValueError, match=r"count is .*; allowed are integers"):
        entry(0, count)


@pytest.mark.parametrize(("entry", "message"), [
    (observe.contact_points, "body is 2; allowed are indices from 0 to 0"),
    (observe.contact_forces, "body is 2; allowed are indices from 0 to 0"),
    (observe.contact_impulse, r"observation of Wrong ends with IndexError.*; allowed are parts of its"),
])  # fmt: skip
def test_a_body_that_is_not_there_is_refused(entry, message):
    with pytest.raises(ValueError, match=message):
        type("Wrong", (Slide,), {"observation": (entry(2),)})(1)


@pytest.mark.parametrize("task", [Slide, Free])
def test_there_are_none_between_a_reset_and_the_first_step(task):
    class Feeling(task):
        observation = (observe.contact_points(), observe.contact_forces(), observe.contact_impulse())

    env = TaskEnv(Feeling)
    env.reset(seed=0)
    env.step(np.zeros(env.action_space.shape))
    obs, _ = env.reset(seed=1)
    assert not obs.any()
