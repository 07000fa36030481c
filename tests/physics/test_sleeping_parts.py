"""Sleep among bodies that touch, under error control: parts of a substep are tried and undone, sleep is not."""

from __future__ import annotations

import itertools
import pickle

import numpy as np
import pytest

import physics
from physics.kernels.multibody.stepping.adaptive_substep import MIN_RELATIVE_SLOP, MIN_SOLVER_TOLERANCE
from physics.kernels.state import layout as at
from tests.tiers.sweep import sweep

pytestmark = pytest.mark.interpreted

DT, G, R = 0.01, 9.81, 0.5
WINDOW = 4.5 * DT  # five steps [s]
ASLEEP_AFTER = 12  # steps, with a spare one in each window
SLOP = 4 * MIN_RELATIVE_SLOP * R  # displacement in a window below which a ball sleeps [m]
FLOOR = [physics.HalfSpace((0, 1, 0))]
GRAVITY = physics.Gravity((0, -G, 0))


def ball(x, height=0.0, **more):
    return physics.Sphere(R, 1.0, pos=(x, R + height, 0), **more)


def worlds(bodies, *effects, time=WINDOW, slops=4.0, accuracy="precise", **more):
    """The same twice: one whose bodies sleep, and one whose bodies never do."""
    effects = [GRAVITY, *(effects or [physics.Contact()])]
    return tuple(
        physics.World(physics.Scene(bodies, FLOOR, [*effects, *also]), dt=DT, accuracy=accuracy, **more)
        for also in ([physics.Sleeping(slops, time=time)], [])
    )


def push(world, body, x):
    wrench = world.no_wrench()
    wrench[:, body, 0] = x
    return wrench


def fixed(x=0.0, **more):
    return physics.Block((4, 1, 4), pos=(x, 0.5, 0), fixed=True, **more)


# --- truths ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("accuracy", ["precise", "reference"])
def test_balls_at_rest_sleep_for_nothing_where_they_would_be_awake(accuracy):
    """The residual of solves moves the balls that stay awake, in a window by less than the threshold."""
    bodies = [ball(0.0), ball(3.0)]
    world, awake = worlds(bodies, accuracy=accuracy)
    for one in (world, awake):
        one.step(steps=ASLEEP_AFTER)
    assert world.asleep.all()
    assert not world.state[:, 7:].any()
    report = world.step(steps=1_000_000)
    assert report.ok
    assert report.solves == report.iterations == report.fallbacks == 0
    assert np.abs(world.pos - awake.pos).max() <= SLOP * (ASLEEP_AFTER * DT / WINDOW)
    assert world.contacts()[1].sum(axis=0)[1] == pytest.approx(2 * G, rel=100 * MIN_SOLVER_TOLERANCE)


def test_the_lone_body_among_fixed_ones_sleeps_and_goes_as_the_law_says_when_pushed():
    world, awake = worlds([fixed(), ball(0.0, 1.0)])
    for one in (world, awake):
        one.step(steps=ASLEEP_AFTER)
    assert world.asleep[0].tolist() == [False, True]
    assert world.step(steps=1_000_000).solves == 0
    for one in (world, awake):
        one.step(push(one, 1, 2.0), steps=10)
    assert not world.asleep.any()
    assert world.pos[0, 1, 0] == pytest.approx(0.5 * 2.0 * (10 * DT) ** 2, abs=1e-9)
    np.testing.assert_allclose(world.pos, awake.pos, atol=1e-9)


def test_balls_that_creep_faster_than_the_threshold_have_the_same_bits():
    """At 10⁻⁹ m/s a ball goes 25 times as far in a window as the threshold allows."""
    bodies = [ball(0.0, linvel=(1e-9, 0, 0)), ball(3.0, linvel=(-1e-9, 0, 0))]
    world, awake = worlds(bodies)
    for one in (world, awake):
        one.step(steps=ASLEEP_AFTER)
    assert not world.asleep.any()
    assert np.array_equal(world.state, awake.state)
    assert np.array_equal(world.memory, awake.memory)


@pytest.mark.parametrize(("is_lone", "slops"), sweep(
    itertools.product([False, True], [4.0, 1e4]), [(True, 4.0)],
))  # fmt: skip
def test_a_bounce_in_a_period_of_the_step_does_not_sleep(is_lone, slops):
    """From H = g dt²/8 a ball is back at its highest point after each step, where nothing holds it."""
    height = G * DT**2 / 8
    bodies = [fixed(), ball(0.0, 1.0 + height)] if is_lone else [ball(0.0, height), ball(3.0)]
    world, awake = worlds(bodies, physics.Contact(restitution=1.0), slops=slops)
    for one in (world, awake):
        one.step(steps=ASLEEP_AFTER + 1)
    b = 1 if is_lone else 0
    assert not world.asleep[0, b]
    assert is_lone or world.asleep[0, 1]
    assert world.pos[0, b, 1] == pytest.approx(bodies[b].pos[1], abs=1e-9)


# --- waking ----------------------------------------------------------------------------------------------------


def test_a_ball_that_comes_near_wakes_the_one_it_meets_and_no_other():
    """Balls of one mass exchange their velocities in an elastic impact."""
    speed, gap = 8.0, 1.0
    bodies = [ball(0.0), ball(2 * R + gap), ball(9.0)]
    world, awake = worlds(bodies, physics.Contact(restitution=1.0))
    for one in (world, awake):
        one.step(steps=ASLEEP_AFTER)
    assert world.asleep.all()
    world.sleep[0] = 0.0  # as `set_state` does for all bodies of a world
    for one in (world, awake):
        one.state[0, at.LINVEL] = speed
    others = world.state[1:].copy()
    steps = 0
    while world.asleep[0, 1]:
        assert np.array_equal(world.state[1:], others)
        assert world.pos[0, 0, 0] < gap
        for one in (world, awake):
            one.step()
        steps += 1
    for one in (world, awake):
        one.step(steps=20 - steps)
    assert world.asleep[0].tolist() == [False, False, True]
    assert np.array_equal(world.state[2], others[1])
    np.testing.assert_allclose(world.linvel[0, :2, 0], (0, speed), atol=1e-9)
    np.testing.assert_allclose(world.pos[0, :2, 0], (gap, 2 * R + speed * 20 * DT), atol=1e-9)
    np.testing.assert_allclose(world.state, awake.state, atol=1e-9)


def test_a_sleeper_keeps_its_place_through_the_parts_of_others():
    """Awake it would gather speed on this slope: by 10⁻⁶ g, less than a large threshold shows in three windows."""
    effects = [physics.Gravity((1e-6 * G, -G, 0)), physics.Contact(), physics.Sleeping(slops=1e6, time=WINDOW)]
    world = physics.World(physics.Scene([ball(0.0), ball(9.0)], FLOOR, effects), dt=DT, accuracy="precise")
    world.step(steps=20)
    assert world.asleep.all()
    other = world.state[1].copy()
    assert other[at.POS] > 9.0
    world.step(push(world, 0, 2.0), steps=5)
    assert world.asleep[0].tolist() == [False, True]
    assert np.array_equal(world.state[1], other)


def test_what_woke_in_a_part_that_was_undone_goes_on_bit_for_bit():
    """A ball with backspin begins to roll and meets one that sleeps, in steps whose parts are refused."""
    world, awake = worlds([ball(0.0), ball(2 * R + 0.2), ball(9.0)], physics.Contact(0.5), physics.Friction(0.5))
    for one in (world, awake):
        one.step(steps=ASLEEP_AFTER)
        one.state[0, at.LINVEL], one.state[0, at.ANGMOM + 2] = 9.0, 30.0 * 0.4 * R**2
    world.sleep[0] = 0.0
    snap, steps = world.snapshot(), 4
    for one in (world, awake):
        report = one.step(steps=steps)
        assert report.solves > 3 * steps  # of more than a whole step and its halves each
    assert world.asleep[0].tolist() == [False, False, True]
    assert world.linvel[0, 1, 0] > 1.0
    np.testing.assert_allclose(world.state[:2], awake.state[:2], atol=1e-8)
    end, copy = [array.copy() for array in (world.state, world.memory, world.sleep)], pickle.loads(pickle.dumps(world))
    world.restore(snap)
    assert world.asleep[0].tolist() == [False, True, True]
    for _ in range(steps):
        world.step()
    assert all(np.array_equal(one, other) for one, other in zip((world.state, world.memory, world.sleep), end))
    copy.step()
    world.step()
    assert np.array_equal(copy.state, world.state)


@pytest.mark.exhaustive
def test_bodies_that_a_spring_ties_sleep_and_wake_together():
    spring = physics.Spring(stiffness=50.0, damping=10.0, length=4.0, body=0, other=1)
    world, _ = worlds([ball(0.0), ball(4.0), ball(9.0)], physics.Contact(), spring)
    world.step(steps=ASLEEP_AFTER)
    assert world.asleep.all()
    world.step(push(world, 1, 3.0))
    assert world.asleep[0].tolist() == [False, False, True]


@pytest.mark.parametrize(
    "change",
    [
        lambda world: world.set_state(linvel=world.linvel),
        lambda world: world.set_parameters(mass=2.0),
        lambda world: world.set_parameters(gravity=(0, -2 * G, 0)),
    ],
)
def test_a_change_from_outside_wakes_all(change):
    world, _ = worlds([ball(0.0), ball(3.0)])
    world.step(steps=ASLEEP_AFTER)
    assert world.asleep.all()
    change(world)
    assert not world.asleep.any()
    assert world.step().solves > 0


# --- batches, and going on -------------------------------------------------------------------------------------


def test_worlds_of_a_batch_sleep_for_themselves_and_one_call_of_many_steps_is_many_calls():
    bodies = [ball(0.0), ball(3.0)]
    batch, _ = worlds(bodies, worlds=2)
    alone = [worlds(bodies)[0] for _ in range(2)]
    load = batch.no_wrench()
    load[1, 1, 0] = 2.0
    batch.step(steps=ASLEEP_AFTER)
    batch.step(load, steps=5)
    for k, world in enumerate(alone):
        for _ in range(ASLEEP_AFTER):
            world.step()
        for _ in range(5):
            world.step(load[k : k + 1])
        assert np.array_equal(batch.state[2 * k : 2 * k + 2], world.state)
        assert np.array_equal(batch.asleep[k], world.asleep[0])
    assert batch.asleep.tolist() == [[True, True], [True, False]]


@pytest.mark.exhaustive
def test_a_recording_is_replayed_bit_for_bit(tmp_path):
    world, _ = worlds([ball(0.0), ball(3.0)])
    recorder = physics.Recorder(world)
    for k in range(ASLEEP_AFTER + 5):
        world.step(push(world, 0, 2.0 if k > ASLEEP_AFTER else 0.0))
    assert world.asleep[0].tolist() == [False, True]
    assert physics.Recording.load(recorder.save(tmp_path / "sleep.npz")).replay().is_identical
