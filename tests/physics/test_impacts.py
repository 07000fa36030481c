"""Impulses of collisions in a step: against closed forms, the balance of momentum, and calls one by one."""

from __future__ import annotations

import itertools
import pickle

import numpy as np
import pytest

import physics
from physics.kernels.time_stepping.event_log import EVENT_KIND, KIND_IMPACT
from tests.tiers.sweep import sweep

pytestmark = pytest.mark.interpreted

EPS, DT = np.finfo(float).eps, 0.005
FLOOR = physics.HalfSpace((0, 1, 0), 0.0)
GRAVITY = (0.0, -9.81, 0.0)
PRESETS = ("fast", "balanced", "precise")


def ball(y=1.0, speed=0.0, mass=2.0, radius=0.5, x=0.0, vx=0.0) -> physics.Sphere:
    return physics.Sphere(radius, mass, pos=(x, y, 0), linvel=(vx, speed, 0))


def keeping(bodies, effects, walls=(FLOOR,), worlds=1, accuracy="balanced", threads=1, **room) -> physics.World:
    world = physics.World(physics.Scene(bodies, list(walls), effects), worlds, DT, accuracy, threads)
    world.keep_impacts(**room)
    return world


def bouncing(restitution=0.5, worlds=1, accuracy="balanced", **more) -> physics.World:
    """A ball that meets the floor at 4 m/s in its first step, without gravity."""
    return keeping([ball(0.51, -4.0)], [physics.Contact(restitution)], worlds=worlds, accuracy=accuracy, **more)


# --- closed forms ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize("accuracy", [*PRESETS, "reference"])
@pytest.mark.parametrize("restitution", [0.0, 0.5, 1.0])
def test_a_ball_gets_its_change_of_momentum(accuracy, restitution):
    """p = (1 + e) m v, at the lowest point; one product and one sum more than the velocity has roundings."""
    world = bouncing(restitution, accuracy=accuracy)
    world.step()
    found = world.read_impacts(rows=2)
    assert found.count[0] == 1
    assert found.hits[0].tolist() == [1, 0]
    assert found.ends[0].tolist() == [[0, -1], [0, 0]]
    expected = (1.0 + restitution) * 2.0 * 4.0
    np.testing.assert_allclose(found.impulse[0], [[0, expected, 0], [0, 0, 0]], rtol=0, atol=8 * EPS * expected)
    np.testing.assert_array_equal(found.total[0], found.impulse[0, :1])
    # The place of an impact is known to half a slop.
    np.testing.assert_allclose(found.point[0, 0], 0.0, rtol=0, atol=0.5 * world.accuracy.slop)
    assert found.left_out[0] == 0
    world.step()
    assert world.read_impacts().count[0] == 0
    assert not world.read_impacts().total.any()


@pytest.mark.parametrize("accuracy", [*PRESETS, "reference"])
def test_two_balls_get_opposite_impulses(accuracy):
    """p = (1 + e) v m₁ m₂/(m₁ + m₂) along the line of centres, to the tolerance of the contact problem."""
    balls = [ball(x=-0.505, vx=4.0, y=5.0), ball(x=0.505, mass=6.0, y=5.0)]
    world = keeping(balls, [physics.Contact(0.5)], accuracy=accuracy)
    world.step()
    found, other = world.read_impacts(), world.read_impacts(rows=1, body=1)
    expected = -1.5 * 4.0 * 12.0 / 8.0
    atol = world.accuracy.tolerance * abs(expected) + 8 * EPS * abs(expected)
    assert (found.count[0], found.hits[0, 0], found.ends[0, 0].tolist()) == (1, 1, [0, 1])
    np.testing.assert_allclose(found.impulse[0, 0], [expected, 0, 0], rtol=0, atol=atol)
    np.testing.assert_array_equal(found.total[0], [found.impulse[0, 0], -found.impulse[0, 0]])
    assert other.ends[0, 0].tolist() == [1, 0]
    np.testing.assert_array_equal(other.impulse, -found.impulse[:, :1])
    np.testing.assert_array_equal(other.total, found.total)


@pytest.mark.parametrize(("accuracy", "speed"), [("fast", 9.0), ("balanced", 17.0), ("precise", 47.0)])
def test_collisions_of_a_pair_add_up(accuracy, speed):
    """An elastic ball between two walls, 2 cm of room: each collision gives 2 m v, every 2 cm/v."""
    walls = [FLOOR, physics.HalfSpace((0, -1, 0), -1.02)]
    world = keeping([ball(0.51, -speed)], [physics.Contact(1.0)], walls, accuracy=accuracy)
    world.step()
    found = world.read_impacts(rows=3)
    meetings = int((speed * DT - 0.01) / 0.02) + 1
    assert found.ends[0, :2].tolist() == [[0, -1], [0, -2]]
    assert found.hits[0].tolist() == [(meetings + 1) // 2, meetings // 2, 0]
    each = 2.0 * 2.0 * speed
    atol = 16 * EPS * each * meetings
    np.testing.assert_allclose(found.impulse[0, :2, 1], each * found.hits[0, :2] * [1, -1], rtol=0, atol=atol)
    np.testing.assert_allclose(found.total[0, 0], [0, each * (meetings % 2), 0], rtol=0, atol=atol)


# --- the balance of momentum ----------------------------------------------------------------------------------

TILTED = (0.95, 0.1, 0.05, 0.2917)
TIED = physics.Spring(stiffness=200.0, length=1.2, damping=1.0, body=0, other=1)
FALLING = {
    "sphere": ([ball(0.8)], [physics.Contact(0.5)]),
    "block": (
        [physics.Block((0.5, 0.3, 0.2), 1.5, pos=(0, 0.45, 0), quat=TILTED, linvel=(0.5, 0, 0))],
        [physics.Contact(0.5), physics.Friction(0.4)],
    ),
    "two that collide": (
        [ball(0.9, x=-0.6, vx=1.0), ball(0.8, mass=1.0, x=0.6, vx=-1.0)],
        [physics.Contact(0.5), physics.Friction(0.3)],
    ),
    "two tied by a spring": (
        [ball(0.9, x=-0.7, vx=1.0), ball(0.8, mass=1.0, x=0.7, vx=-1.0)],
        [physics.Contact(0.5), TIED],
    ),
}  # fmt: skip


def is_quick(case: tuple[str, str]) -> bool:
    """Answer whether the default tier runs a case; error control of a spring takes a step in many parts."""
    return case != ("two tied by a spring", "precise")


def momentum(world: physics.World) -> np.ndarray:
    """(worlds, bodies, 3) [kg m/s]."""
    return world.linvel * np.array([body.mass for body in world.scene.bodies])[:, None]


@pytest.mark.parametrize(("name", "accuracy"), sweep(itertools.product(FALLING, PRESETS), is_quick))
def test_collisions_contacts_and_weight_make_up_the_change_of_momentum(name, accuracy, is_exhaustive):
    """Σ p of collisions + Σ p of the resting stage + m g h = m Δv, in each step whose resting contacts are one stage.

    These are steps that begin without a contact, or that no collision cuts; at `precise` those without any contact that
    rests. Later steps are left out: bodies that come to rest are pushed out of walls, which takes motion from them.
    A stage rounds the velocity of a body, its load and its impulses: four sums, of the largest momentum. A spring
    between two bodies is in no sum over both.
    """
    bodies, effects = FALLING[name]
    world = keeping(bodies, [*effects, physics.Gravity(GRAVITY)], accuracy=accuracy)
    weight = DT * np.array([body.mass for body in bodies])[:, None] * np.array(GRAVITY)
    collided, counted = 0, 0
    for _ in range(140 if is_exhaustive else 70):
        before, was_touching = momentum(world), world.read_contacts(rows=0).count[0] > 0
        report = world.step()
        found, (_, resting) = world.read_impacts(), world.read_contact_sums()
        if (was_touching and report.impacts[0] > 0) or (accuracy == "precise" and rests(world)):
            continue
        told, gained = found.total[0] + resting[0] + weight, (momentum(world) - before)[0]
        if "tied" in name:
            told, gained = told.sum(axis=0), gained.sum(axis=0)
        size = np.abs(momentum(world)).max() + np.abs(before).max() + np.abs(weight).max()
        stages = 1 + (report.solves[0] if accuracy == "precise" else report.impacts[0])
        np.testing.assert_allclose(told, gained, rtol=0, atol=4 * (1 + stages) * EPS * size)
        collided, counted = collided + found.count[0], counted + 1
    assert collided >= 1
    assert counted > 30


def rests(world: physics.World) -> bool:
    """True if a contact rests at the end of the step, or the log tells of more than collisions."""
    kinds = world.event_log[0, : world.event_counts[0], EVENT_KIND]
    return world.read_contacts(rows=0).count[0] > 0 or bool((kinds != KIND_IMPACT).any())


# --- rows, worlds, and what a step is -------------------------------------------------------------------------


def thrown(worlds=3, threads=1) -> physics.World:
    """Balls of one world at a floor and a wall, thrown at other speeds in each world."""
    walls = [FLOOR, physics.HalfSpace((1, 0, 0), 0.0)]
    bodies = [ball(0.503, -3.0, x=0.514, vx=-5.0), ball(2.0, -1.0, mass=1.0, x=3.0)]
    world = keeping(bodies, [physics.Contact(0.5, between_bodies=False)], walls, worlds, threads=threads)
    world.set_state(linvel=world.linvel * np.arange(1.0, worlds + 1)[:, None, None])
    return world


def test_the_strongest_are_shown_and_all_are_counted():
    world = thrown()
    world.step()
    every, one = world.read_impacts(), world.read_impacts(rows=1)
    assert every.count.tolist() == one.count.tolist() == [2, 2, 2]
    assert every.ends[0, :2].tolist() == [[0, -1], [0, -2]]
    np.testing.assert_array_equal(one.ends[:, 0], [[0, -2]] * 3)
    np.testing.assert_array_equal(one.impulse[:, 0], every.impulse[:, 1])
    np.testing.assert_array_equal(one.total, every.total)
    assert world.read_impacts(body=1).count.tolist() == [0, 0, 0]
    assert world.read_impacts(rows=0).impulse.shape == (3, 0, 3)


def test_a_world_has_the_same_bits_alone_and_in_a_batch():
    world, shared = thrown(), thrown(threads=2)
    for each in (world, shared):
        each.step()
    for ours, theirs in zip(shared.read_impacts(), world.read_impacts(), strict=True):
        np.testing.assert_array_equal(ours, theirs)
    every, some = world.read_impacts(), world.read_impacts([2, 0, 2])
    for ours, theirs in zip(some, every, strict=True):
        np.testing.assert_array_equal(ours, theirs[[2, 0, 2]])
    for i in range(3):
        alone = thrown(3)
        alone.restore(alone.snapshot([i]))
        alone.step()
        for ours, theirs in zip(alone.read_impacts([0]), every, strict=True):
            np.testing.assert_array_equal(ours[0], theirs[i])


@pytest.mark.parametrize(("name", "accuracy"), sweep(itertools.product(FALLING, PRESETS), is_quick))
def test_states_have_the_same_bits_whether_impacts_are_kept_or_not(name, accuracy):
    bodies, effects = FALLING[name]
    scene = physics.Scene(bodies, [FLOOR], [*effects, physics.Gravity(GRAVITY)])
    plain, kept = (physics.World(scene, 1, 5 * DT, accuracy) for _ in range(2))
    kept.keep_impacts()
    for _ in range(12):
        plain.step()
        kept.step()
        np.testing.assert_array_equal(plain.state, kept.state)
        np.testing.assert_array_equal(plain.report_table, kept.report_table)
    assert plain.event_log.size == 0


@pytest.mark.parametrize("lag", [0.0, 0.01])
def test_a_call_of_many_steps_has_the_collisions_of_all(lag):
    """With a lag each step is a call of its own."""
    effects = [physics.Contact(0.9), physics.Gravity(GRAVITY), physics.Actuator(lag=lag)]
    whole, parts = (keeping([ball(0.505, -1.0, radius=0.5)], effects, accuracy="precise") for _ in range(2))
    for _ in range(4):
        whole.step(steps=40)
        total, hits = np.zeros(3), 0
        for _ in range(40):
            parts.step()
            found = parts.read_impacts(rows=1)
            total, hits = total + found.total[0, 0], hits + found.hits[0, 0]
        found = whole.read_impacts(rows=1)
        assert found.hits[0, 0] == hits
        np.testing.assert_allclose(found.total[0, 0], total, rtol=1e-9, atol=0)  # another course of the same motion
    assert np.array_equal(whole.time, parts.time) or abs(whole.time - parts.time) < 1e-12


def test_a_stepper_keeps_them_too():
    world, other = bouncing(), bouncing()
    step = physics.Stepper(world, 2)
    step()
    other.step(steps=2)
    for ours, theirs in zip(world.read_impacts(), other.read_impacts(), strict=True):
        np.testing.assert_array_equal(ours, theirs)
    step()
    assert world.read_impacts().count[0] == 0


# --- starting anew --------------------------------------------------------------------------------------------


def test_worlds_that_are_put_elsewhere_have_none():
    world = thrown()
    world.step()
    world.set_state(pos=world.pos[:1], worlds=[1])
    assert world.read_impacts().count.tolist() == [2, 0, 2]
    assert not world.read_impacts().total[1].any()
    world.restore(world.snapshot([0]), worlds=[0])
    assert world.read_impacts().count.tolist() == [0, 0, 2]


def test_a_copy_keeps_them():
    world = thrown()
    world.step()
    twin = pickle.loads(pickle.dumps(world))
    for ours, theirs in zip(twin.read_impacts(), world.read_impacts(), strict=True):
        np.testing.assert_array_equal(ours, theirs)
    world.step()
    twin.step()
    assert twin.read_impacts().count.tolist() == world.read_impacts().count.tolist()


# --- errors and room ------------------------------------------------------------------------------------------


def test_impulses_without_room_are_told():
    walls = [FLOOR, physics.HalfSpace((0, -1, 0), -1.02)]
    world = keeping([ball(0.51, -17.0)], [physics.Contact(1.0)], walls, room=2)
    report = world.step()
    found = world.read_impacts()
    assert found.hits.sum() == 2
    assert found.left_out[0] == report.left_out[0] == 2
    assert report.status[0] == physics.Status.LEFT_OUT
    assert "keep_impacts" in report.messages()[0]
    world.keep_impacts(room=8)
    assert world.step().left_out[0] == 0


def test_what_was_not_kept_is_refused():
    world = physics.World(physics.Scene([ball()], [FLOOR], [physics.Contact()]))
    with pytest.raises(ValueError, match=r"not kept; allowed is to call World.keep_impacts\(\) before the step"):
        world.read_impacts()
    world.step()
    world.keep_impacts()
    with pytest.raises(ValueError, match="not kept"):
        world.read_impacts()
    world.step()
    assert world.read_impacts().count[0] == 0
    physics.rollout(world, np.zeros((1, 2, 1, 6)))
    with pytest.raises(ValueError, match="rollouts keep none"):
        world.read_impacts()


def test_a_stepper_that_has_stepped_is_named():
    world = physics.World(physics.Scene([ball()], [FLOOR], [physics.Contact()]))
    physics.Stepper(world)()
    with pytest.raises(ValueError, match=r"keep_impacts\(room=256\) comes after a Stepper"):
        world.keep_impacts()
    assert world.event_log.size == 0


@pytest.mark.parametrize(("arguments", "words"), [
    ({"worlds": [3]}, "worlds"), ({"rows": -1}, "rows"), ({"rows": 1.5}, "rows"), ({"body": 1}, "body"),
    ({"worlds": [0.5]}, "worlds"),
])  # fmt: skip
def test_wrong_arguments_are_named(arguments, words):
    world = bouncing(worlds=3)
    for read in (world.read_impacts, world.read_contacts):
        with pytest.raises(ValueError, match=words):
            read(**arguments)
    with pytest.raises(ValueError, match="room"):
        world.keep_impacts(room=0)


def test_contacts_are_read_by_the_same_door():
    world = keeping([ball(0.5)], [physics.Contact(), physics.Gravity(GRAVITY)], worlds=2)
    world.step()
    found, (force, impulse) = world.read_contacts(rows=2), world.read_contact_sums([1])
    points, forces = world.contacts(1)
    assert found.count.tolist() == [1, 1]
    np.testing.assert_array_equal(found.point[1, :1], points)
    np.testing.assert_array_equal(found.force[1, :1], forces)
    np.testing.assert_array_equal(force[0], forces)
    np.testing.assert_array_equal(impulse[0], found.impulse[1, :1])
