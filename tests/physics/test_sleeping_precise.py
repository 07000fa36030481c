"""Sleep of bodies at walls in the event-driven scheme: the same as never sleeping, up to the threshold."""

from __future__ import annotations

import itertools
import math
import pickle

import numpy as np
import pytest

import physics
from physics import scenes
from physics.accuracy import resolve
from tests.physics.test_sleeping import BLOCK, CHANGES, DT, MU, RADIUS, STEPS, WEIGHT, G, force, on_edge, sleeping
from tests.tiers.sweep import sweep

pytestmark = pytest.mark.interpreted

HALF = 0.5 * scenes.SIZE[1]  # height of the block's centre above the floor [m]


def worlds(scene=BLOCK, accuracy="precise", dt=DT, **options):
    """The same twice: one whose bodies sleep, and one whose bodies never do."""
    return tuple(physics.World(each, dt=dt, accuracy=accuracy) for each in (sleeping(scene, **options), scene))


def asleep_world(**options):
    world, _ = worlds(**options)
    world.step(steps=2 * STEPS)
    assert world.asleep.all()
    return world


# --- truths ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("accuracy", sweep(["precise", "reference"], ["precise"]))
def test_a_block_at_rest_sleeps_for_nothing_and_wakes_with_the_bits_of_one_that_never_slept(accuracy):
    """The scheme keeps a body at rest to the last bit, and so does sleep; the contact memory stays as well."""
    world, awake = worlds(accuracy=accuracy)
    world.step(steps=2 * STEPS - 1)
    assert not world.asleep.any()
    assert world.step().solves == 1
    assert world.asleep.all()
    awake.step(steps=2 * STEPS)
    report = world.step(steps=1_000_000)
    assert report.solves == report.iterations == report.fallbacks == 0
    assert report.ok
    for share, steps in ((0.0, 1), (0.9 * MU, 3), (0.5, 20), (0.0, 3 * STEPS)):
        for one in (world, awake):
            one.step(force(share * WEIGHT), steps=steps)
        assert np.array_equal(world.state, awake.state)
        assert np.array_equal(world.memory, awake.memory)
        assert np.array_equal(world.contacts()[1], awake.contacts()[1])
    assert world.asleep.all()
    assert world.pos[0, 0, 0] == pytest.approx(
        (0.5 - MU) * G * (20 * DT) ** 2 / 2 * (1 + (0.5 - MU) / MU), rel=1e-9
    )  # v = a t, and v²/2 μ g to the stop


@pytest.mark.parametrize(("share", "does_sleep"), [(2.0, False), (0.5, True)])
def test_a_creep_above_the_threshold_keeps_its_bits_and_one_below_ends_within_it(share, does_sleep):
    """Without friction, x = v t, and v T = share · w in a window T, with the threshold w.

    After n windows of sleep, share · n w of the way is missing: at most n w for a motion that sleeps.
    """
    speed, windows, steps = 1e-3, 6, 5  # the scheme itself takes 10⁻⁵ m/s for rest
    threshold = speed * steps * DT / share
    world, awake = worlds(slops=threshold / (resolve("precise").slop * RADIUS), time=(steps - 0.5) * DT)
    for one in (world, awake):
        one.set_parameters(friction=0.0)
        one.set_state(linvel=[[[speed, 0, 0]]])
        one.step(steps=windows * steps)
    assert world.asleep.all() == does_sleep
    assert awake.pos[0, 0, 0] == pytest.approx(windows * steps * DT * speed, rel=1e-9)
    if does_sleep:
        missing = np.abs(world.pos - awake.pos).max()
        assert missing == pytest.approx((windows - 2) * steps * DT * speed, rel=1e-9)
        assert missing <= (windows - 2) * threshold
        assert not world.state[:, 7:].any()
    else:
        assert np.array_equal(world.state, awake.state)
        assert np.array_equal(world.memory, awake.memory)


@pytest.mark.parametrize(("periods", "slops"), sweep(
    itertools.product([1, 2], [4.0, 1e4]), [(1, 1e4)],
))  # fmt: skip
def test_a_bounce_in_a_period_that_divides_the_step_does_not_sleep(periods, slops):
    """From H = g (dt/periods)²/8 the block is back at its highest point, without velocity, after each step."""
    height = G * (DT / periods) ** 2 / 8
    world, awake = worlds(slops=slops)
    for one in (world, awake):
        one.set_parameters(restitution=1.0, friction=0.0)
        one.set_state(pos=[[[0, HALF + height, 0]]])
        one.step(steps=2 * STEPS + 5)
    assert not world.asleep.any()
    assert np.array_equal(world.state, awake.state)
    limit = np.finfo(float).eps * len(world.state) * 1000 + (2 * STEPS + 5) * resolve("precise").slop * RADIUS
    assert world.pos[0, 0, 1] == pytest.approx(HALF + height, abs=limit)


def on_spring(friction=0.0, damping=0.0, stretch=0.1):
    """A block on the floor, at the end of a spring whose period is dt."""
    frequency = 2 * math.pi / DT
    block = physics.Block(scenes.SIZE, scenes.MASS, pos=(stretch, HALF, 0))
    spring = physics.Spring(stiffness=scenes.MASS * frequency**2, damping=damping, point=(0, HALF, 0))
    laws = [physics.Gravity((0, -G, 0)), physics.Contact(), physics.Friction(friction), spring]
    return physics.Scene([block], [physics.HalfSpace((0, 1, 0))], laws)


def test_a_block_that_a_spring_swings_once_in_each_step_does_not_sleep():
    """It is back at its turning point after each step; the spring's force is not balanced there."""
    world, _ = worlds(on_spring(), slops=1e6, time=2.5 * DT)
    world.step(steps=9)
    assert not world.asleep.any()
    assert world.pos[0, 0, 0] == pytest.approx(0.1, abs=1e-7)


def test_a_block_that_friction_holds_against_a_spring_sleeps():
    world, _ = worlds(on_spring(friction=1e6), time=2.5 * DT)
    world.step(steps=7)
    assert world.asleep.all()
    assert world.pos[0, 0, 0] == 0.1


@pytest.mark.parametrize(("lift", "does_sleep"), [(0.0, True), (1e-3, False)])
def test_a_body_that_floats_sleeps_in_its_equilibrium_and_bobs_on_beside_it(lift, does_sleep):
    """Half as dense as the fluid, a cube floats with its centre in the surface; no contact holds it there."""
    fluid = physics.Buoyancy(offset=5.0, density=1000.0), physics.Drag(1.0, density=1000.0)
    cube = physics.Block((1, 1, 1), 500.0, pos=(0, 5.0 + lift, 0))
    scene = physics.Scene([cube], [physics.HalfSpace((0, 1, 0))], [physics.Gravity(), physics.Contact(), *fluid])
    world, awake = worlds(scene, time=5 * DT)
    for one in (world, awake):
        one.step(steps=30)
    assert world.asleep.all() == does_sleep
    missing = 6 * 4 * resolve("precise").slop * cube.bounding_radius(cube.dimensions) if does_sleep else 0.0
    assert np.abs(world.pos[0, 0] - (0, 5, 0)).max() <= lift + missing
    assert np.abs(world.pos - awake.pos).max() <= missing


@pytest.mark.exhaustive
def test_from_a_small_offset_a_cube_falls_off_its_edge_as_if_it_never_slept():
    world, awake = worlds(on_edge(1e-6))
    fallen = math.acosh(2e6) / math.sqrt(3 * G / (2 * math.sqrt(2)))  # time to some 2 rad, by the linear law [s]
    for one in (world, awake):
        one.step(steps=round(fallen / DT))
    assert not world.asleep.any()
    assert np.array_equal(world.state, awake.state)
    for one in (world, awake):
        one.step(steps=round(3.0 / DT))
    assert world.asleep.all()
    assert world.pos[0, 0, 1] == pytest.approx(0.5, abs=1e-9)
    assert np.array_equal(world.state, awake.state)


# --- waking ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("change", "speed"), CHANGES)
def test_a_change_from_outside_wakes_it(change, speed):
    world = asleep_world()
    change(world)
    assert not world.asleep.any()
    world.step()
    assert world.linvel[0, 0, 0] == pytest.approx(speed, abs=1e-12 + resolve("precise").tolerance * G * DT)


def test_each_body_sleeps_and_wakes_alone():
    """One of two blocks is pushed. Waking takes the mode of the contacts from the state, not from before the sleep."""
    bodies = [physics.Block((1, 1, 1), 1.0, pos=(x, 0.5, 0)) for x in (0, 4)]
    laws = [physics.Gravity((0, -G, 0)), physics.Contact(between_bodies=False), physics.Friction(MU)]
    world = physics.World(
        physics.Scene(bodies, BLOCK.walls[:1], [*laws, physics.Sleeping(time=5 * DT)]), dt=DT, accuracy="precise"
    )
    world.step(steps=12)
    assert world.asleep.all()
    other, wrench = world.state[1].copy(), world.no_wrench()
    wrench[0, 0, 0] = 0.5 * G
    for _ in range(20):
        report = world.step(wrench)
    assert world.asleep[0].tolist() == [False, True]
    assert report.solves <= 2
    assert world.pos[0, 0, 0] == pytest.approx(0.5 * (0.5 - MU) * G * (20 * DT) ** 2, abs=1e-9)
    assert np.array_equal(world.state[1], other)


def test_after_a_creep_that_sleep_has_stopped_a_push_moves_it_from_there():
    """Its contacts slid when it fell asleep. Then they hold a push below friction, and slide under one above it."""
    world, _ = worlds(slops=1e9, time=2.5 * DT)
    world.set_parameters(friction=0.0)
    world.set_state(linvel=[[[1e-4, 0, 0]]])
    world.step(steps=7)
    assert world.asleep.all()
    place = world.pos[0, 0, 0]
    world.params[:, physics.kernels.state.layout.FRICTION] = MU  # no setter, so that its memory stays
    world.step(force(0.9 * MU * WEIGHT))
    assert not world.asleep.any()
    assert world.pos[0, 0, 0] == place
    world.step(force(0.5 * WEIGHT), steps=10)
    assert world.pos[0, 0, 0] - place == pytest.approx(0.5 * (0.5 - MU) * G * (10 * DT) ** 2, abs=1e-9)


# --- going on --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("before", [STEPS // 2, 2 * STEPS + 5])
def test_a_snapshot_and_a_copy_go_on_bit_for_bit(before):
    world, _ = worlds()
    world.step(steps=before)
    snap, copy = world.snapshot(), pickle.loads(pickle.dumps(world))

    def go_on(one):
        one.step(steps=2 * STEPS)
        one.step(force(0.5 * WEIGHT), steps=10)
        return b"".join(array.tobytes() for array in one.kept())

    ends = go_on(world), go_on(copy)
    world.restore(snap)
    assert np.array_equal(world.asleep, [[before > 2 * STEPS]])
    assert ends[0] == ends[1] == go_on(world)


def test_a_recording_is_replayed_and_one_call_of_many_steps_is_many_calls(tmp_path):
    world, other = worlds(time=5 * DT)[0], worlds(time=5 * DT)[0]
    recorder = physics.Recorder(world)
    for k in range(30):
        world.step(force(0.5 * WEIGHT if 15 < k < 20 else 0.0))
    other.step(steps=16)
    other.step(force(0.5 * WEIGHT), steps=4)
    other.step(steps=10)
    assert np.array_equal(world.state, other.state)
    assert np.array_equal(world.sleep, other.sleep)
    assert physics.Recording.load(recorder.save(tmp_path / "sleep.npz")).replay().is_identical
