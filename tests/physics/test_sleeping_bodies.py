"""Sleep among bodies that touch each other: what is connected sleeps and wakes together, and nothing else does."""

from __future__ import annotations

import math

import numpy as np
import pytest

import physics
from physics.accuracy import resolve
from physics.kernels.multibody.data.arrays import NUM_CONTACTS
from tests.tiers.sweep import sweep

DT, G, MU = 0.01, 9.81, 0.5
RADIUS = math.sqrt(0.75)  # of a unit cube [m]
WINDOW = math.sqrt(2 * RADIUS / G)  # [s]
SLOP = 4 * resolve("balanced").slop * RADIUS  # way in a window that counts as none [m]
FLOOR = [physics.HalfSpace((0, 1, 0))]
EFFECTS = [physics.Gravity((0, -G, 0)), physics.Contact(), physics.Friction(MU)]


def cubes(*places, sleep=True, **more):
    """A world of unit cubes of 1 kg at rest, centres at these (x, y)."""
    bodies = [physics.Block((1, 1, 1), 1.0, pos=(x, y, 0)) for x, y in places]
    scene = physics.Scene(bodies, FLOOR, [*EFFECTS, *([physics.Sleeping()] if sleep else [])])
    return physics.World(scene, dt=DT, **more)


def tower(x, count):
    return [(x, k + 0.5) for k in range(count)]


def until_asleep(*worlds, steps=1000):
    """Step until every body of the first world sleeps; how many steps it took."""
    for k in range(1, steps):
        for world in worlds:
            world.step()
        if worlds[0].asleep.all():
            return k
    raise AssertionError(f"awake after {steps} steps: {np.flatnonzero(~worlds[0].asleep[0])}")


def push(world, body, x):
    wrench = world.no_wrench()
    wrench[:, body, 0] = x
    return wrench


@pytest.mark.parametrize("accuracy", sweep(["fast", "balanced", "precise"], ["fast", "balanced"]))
@pytest.mark.parametrize("count", [
    pytest.param(1, marks=pytest.mark.interpreted), *sweep([3, 10, 50], [10]),
])  # fmt: skip
def test_a_tower_sleeps_and_costs_nothing(count, accuracy):
    world = cubes(*tower(0, count), accuracy=accuracy)
    until_asleep(world)
    state, (points, forces) = world.state.copy(), world.contacts()
    assert not state[:, 7:].any()  # no velocity left
    report = world.step(steps=1_000_000)  # half a minute at least, were it awake
    assert report.solves == report.iterations == 0
    assert report.ok
    assert np.array_equal(world.state, state)
    assert np.array_equal(world.contacts()[0], points)
    assert np.array_equal(world.contacts()[1], forces)
    on_floor = world.contact_ends()[:, 1] < 0
    # Each contact velocity is solved to tolerance · g dt, and so is the momentum of what lies on the floor.
    assert forces[on_floor].sum(axis=0)[1] == pytest.approx(count * G, rel=4 * world.accuracy.tolerance * count)


def test_pulling_the_lowest_wakes_the_tower_and_not_the_other_one():
    """F at the lowest of four: all slide at F/4m - μ g, as the world does that never slept."""
    places = [*tower(0, 4), *tower(5, 3), (-20, 0.5)]
    world, awake = cubes(*places), cubes(*places, sleep=False)
    until_asleep(world, awake)
    others = world.state[4:].copy()
    load = push(world, 0, 30.0)
    for _ in range(30):
        report = world.step(load)
        awake.step(load)
        assert world.asleep[0].tolist() == [False] * 4 + [True] * 4
        assert report.solves == 1
    assert world.scratch[0].counts[NUM_CONTACTS] == 16  # those of the four alone were posed
    assert len(world.contacts()[0]) == len(awake.contacts()[0]) == 32  # and those of the others are still told
    assert np.array_equal(world.state[4:], others)
    # What was asleep would have crept by less than a slop a window; the way of 0.3 s from there is solved to tolerance.
    limit = SLOP * world.time / WINDOW + 8 * resolve("balanced").tolerance * G * 0.3**2
    assert np.abs(world.pos - awake.pos).max() < limit
    np.testing.assert_allclose(world.pos[0, :4, 0], 0.5 * (30 / 4 - MU * G) * 0.3**2, atol=limit)


def test_what_comes_near_wakes_what_it_meets_before_it_does():
    """A cube slides into one that sleeps: √(v² - 2 μ g d) halves, both go on by its square over 2 μ g."""
    places = (0, 0.5), (4, 0.5), (8, 0.5), (12, 0.5)
    world, awake = cubes(*places), cubes(*places, sleep=False)
    until_asleep(world, awake)
    speed, gap = 8.0, 3.0
    world.sleep[0] = 0.0  # as `set_state` does with every body of a world: here of one alone
    world.state[0, 7] = awake.state[0, 7] = speed
    steps = 0
    while world.asleep[0].tolist() != [False, False, True, True]:
        assert world.pos[0, 1, 0] == 4.0
        assert world.pos[0, 0, 0] < 3.0
        world.step()
        steps += 1
    steps += until_asleep(world)
    awake.step(steps=steps)
    # One of the two may be slowed by friction for a step more or less: μ g dt of the speed, of the way v dt.
    after = 0.5 * math.sqrt(speed**2 - 2 * MU * G * gap)
    assert world.pos[0, 1, 0] == pytest.approx(4 + after**2 / (2 * MU * G), abs=after * DT)
    # What slept would have crept by less than a slop a window; of the rest the impact tells, at 6 m/s, solved as well.
    limit = SLOP * world.time / WINDOW + 4 * resolve("balanced").tolerance * speed
    assert np.abs(world.pos - awake.pos).max() < limit
    assert not np.abs(world.pos[0, 2:] - [[8, 0.5, 0], [12, 0.5, 0]]).max() > SLOP


def test_what_touches_something_in_motion_does_not_sleep():
    """The lowest of three is rocked a little all the time: the others, as still as it may be, stay awake with it."""
    world = cubes(*tower(0, 3))
    for k in range(150):
        world.step(push(world, 0, 0.1 * (k % 2)))
        assert not world.asleep.any()
    until_asleep(world)


def test_what_does_not_sleep_has_the_same_bits():
    places = [*tower(0, 4), (0.3, 5.5)]
    world, awake = cubes(*places), cubes(*places, sleep=False)
    for k in range(60):
        for one in (world, awake):
            one.step(push(one, 4, 2.0 * math.sin(k)))
        assert np.array_equal(world.state, awake.state)
        assert np.array_equal(world.memory, awake.memory)


def test_worlds_of_a_batch_sleep_for_themselves_and_go_on_from_a_snapshot():
    places = [*tower(0, 3), *tower(3, 2)]
    batch, alone = cubes(*places, worlds=4, threads=2), [cubes(*places) for _ in range(4)]
    load = batch.no_wrench()
    load[1, 0, 0], load[2, 4, 0], load[3, :, 0] = 20.0, 6.0, 9.0

    def run(world, wrench):
        world.step(steps=300)
        world.step(wrench, steps=25)

    run(batch, load)
    snap = batch.snapshot()
    for k, world in enumerate(alone):
        run(world, load[k : k + 1])
        assert np.array_equal(batch.pos[k], world.pos[0])
        assert np.array_equal(batch.asleep[k], world.asleep[0])
    assert batch.asleep.tolist() == [[True] * 5, [False] * 3 + [True] * 2, [True] * 3 + [False] * 2, [False] * 5]
    batch.step(steps=400)
    end = [array.copy() for array in batch.kept()]
    batch.restore(snap)
    batch.step(steps=400)
    assert all(np.array_equal(a, b) for a, b in zip(end, batch.kept()))


@pytest.mark.parametrize("length", [1, 7])
def test_one_call_of_many_steps_is_many_calls(length):
    one, many = cubes(*tower(0, 2)), cubes(*tower(0, 2))
    one.step(steps=210)
    for _ in range(210 // length):
        many.step(steps=length)
    assert one.asleep.all()
    assert np.array_equal(one.state, many.state)
    assert np.array_equal(one.memory, many.memory)
    assert np.array_equal(one.sleep, many.sleep)


def test_what_is_left_out_of_the_contact_memory_comes_back():
    """A tower sleeps while another cube is pushed about; woken, it starts from the impulses it had."""
    world = cubes(*tower(0, 5), (9, 0.5))
    until_asleep(world)
    before = world.contacts()[1][world.contact_ends()[:, 0] < 5]
    for k in range(100):
        world.step(push(world, 5, 8.0 * (-1) ** (k // 10)))
    assert world.asleep[0].tolist() == [True] * 5 + [False]
    after = world.contacts()[1][world.contact_ends()[:, 0] < 5]
    np.testing.assert_allclose(after, before, rtol=100 * np.finfo(float).eps, atol=1e-15)  # scaled once a stage
    report = world.step(push(world, 4, 0.1))
    assert not world.asleep[0, :5].any()
    assert report.iterations <= 1  # the linear system of what holds: no search from nothing


@pytest.mark.interpreted
def test_bodies_that_a_spring_ties_sleep_and_wake_together():
    bodies = [physics.Block((1, 1, 1), 1.0, pos=(x, 0.5, 0)) for x in (0, 4, 9)]
    spring = physics.Spring(stiffness=50.0, damping=10.0, length=4.0, body=0, other=1)
    scene = physics.Scene(bodies, FLOOR, [*EFFECTS, spring, physics.Sleeping()])
    world = physics.World(scene, dt=DT)
    until_asleep(world)
    world.step(push(world, 1, 3.0))  # less than friction holds: nothing moves, and nobody is near
    assert world.asleep[0].tolist() == [False, False, True]
