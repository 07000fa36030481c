"""Sleep of a single body: when it falls asleep, what wakes it, and that nothing comes out otherwise for it."""

from __future__ import annotations

import itertools
import math
import pickle

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import physics
from physics import scenes
from physics.accuracy import resolve
from rigid_env.hard_cases import registry
from rigid_env.hard_cases.case import Setting
from tests.tiers.sweep import sweep

# Marked `compiled` are long runs of the block of `worlds()`, whose kernels one of them needs anyway.
pytestmark = pytest.mark.interpreted

DT, G, MU = 0.01, scenes.GRAVITY, 0.3
WEIGHT = scenes.MASS * G
BLOCK = scenes.block_in_box((0.0, scenes.SIZE[1] / 2, 0.0), restitution=0.0, friction=MU)
RADIUS = 0.5 * math.hypot(*scenes.SIZE)
WINDOW = math.sqrt(2 * RADIUS / G)  # [s]
STEPS = math.ceil(WINDOW / DT)  # of a window
SLOP = 4 * resolve("balanced").slop * RADIUS  # way in a window that counts as none [m]


def sleeping(scene, **options):
    return physics.Scene(scene.bodies, scene.walls, [*scene.effects, physics.Sleeping(**options)])


def worlds(scene=BLOCK, **more):
    """The same twice: one whose bodies sleep, and one whose bodies never do."""
    return physics.World(sleeping(scene), dt=DT, **more), physics.World(scene, dt=DT, **more)


def asleep_world(count=1):
    world = physics.World(sleeping(BLOCK), worlds=count, dt=DT)
    world.step(steps=2 * STEPS)
    assert world.asleep.all()
    return world


def force(x=0.0, count=1):
    wrench = np.zeros((count, 1, 6))
    wrench[:, 0, 0] = x
    return wrench


# --- falling asleep --------------------------------------------------------------------------------------------


def test_a_block_at_rest_sleeps_after_two_windows_and_then_costs_nothing():
    world, awake = worlds()
    world.step(steps=2 * STEPS - 1)
    assert not world.asleep.any()
    assert world.step().solves == 1
    assert world.asleep.all()
    awake.step(steps=2 * STEPS)
    points, forces = world.contacts()
    report = world.step(steps=1_000_000)  # as many contact problems would take a second; none is solved
    assert report.solves == report.iterations == 0
    assert report.ok
    assert np.array_equal(world.state, awake.state)  # here what rests has no velocity at all
    assert np.array_equal(world.contacts()[0], points)
    assert np.array_equal(world.contacts()[1], forces)
    assert len(points) == 4
    assert forces.sum(axis=0)[1] == pytest.approx(WEIGHT, rel=resolve("balanced").tolerance)
    assert world.time == pytest.approx((2 * STEPS + 1_000_000) * DT, rel=1e-12)


@pytest.mark.parametrize("time", [0.1, 2.0])
def test_the_window_can_be_set(time):
    world = physics.World(sleeping(BLOCK, time=time), dt=DT)
    steps = 2 * math.ceil(time / DT * (1 - 1e-12))
    world.step(steps=steps - 2)
    assert not world.asleep.any()
    world.step(steps=4)  # the clock adds up dt: a step more or less by rounding, in each of two windows
    assert world.asleep.all()


@pytest.mark.compiled
def test_without_gravity_nothing_is_at_rest_by_itself():
    world = asleep_world()
    world.set_parameters(gravity=(0, 0, 0))
    world.step(steps=100 * STEPS)
    assert not world.asleep.any()


def test_scaled_by_powers_of_two_it_sleeps_at_the_same_step():
    """Lengths times 4, times times 2, masses times 8: g stays 9.81 m/s², and nothing else has a unit."""
    small = physics.Scene([physics.Block(scenes.SIZE, 6.0, pos=(0, 1.6, 0), linvel=(1, 0, 0), angvel=(0.1, 0, 0.3))],
                          [physics.HalfSpace((0, 1, 0))], BLOCK.effects)  # fmt: skip
    body = small.bodies[0]
    large = physics.Scene([physics.Block(4 * np.array(body.size), 48.0, pos=4 * np.array(body.pos),
                                         linvel=2 * np.array(body.linvel), angvel=0.5 * np.array(body.angvel))],
                          small.walls, small.effects)  # fmt: skip
    one, other = physics.World(sleeping(small), dt=DT), physics.World(sleeping(large), dt=2 * DT)
    seen = 0
    for _ in range(2000):
        one.step()
        other.step()
        assert np.array_equal(4 * one.pos, other.pos)
        assert np.array_equal(one.quat, other.quat)
        assert np.array_equal(one.asleep, other.asleep)
        seen += one.asleep.all()
    assert 0 < seen < 2000


@pytest.mark.compiled
@pytest.mark.parametrize(("share", "does_sleep"), [(2.0, False), (0.5, True)])
def test_a_creep_is_rest_below_the_slop_of_a_window_and_goes_on_above(share, does_sleep):
    world = asleep_world()
    speed = share * SLOP / WINDOW
    world.set_parameters(friction=0.0)
    world.set_state(linvel=[[[speed, 0, 0]]])
    world.step(steps=10 * STEPS)
    assert world.asleep.all() == does_sleep
    went = 2 if does_sleep else 10
    assert world.pos[0, 0, 0] == pytest.approx(went * STEPS * DT * speed, rel=1e-9)


@pytest.mark.compiled
@pytest.mark.parametrize("k", [3, 10, 50])
def test_what_bounces_to_the_same_place_every_few_steps_does_not_sleep(k):
    """From H = g (k dt)²/8 an elastic bounce takes k steps: the same states again and again."""
    world = asleep_world()
    world.set_parameters(restitution=1.0)
    world.set_state(pos=[[[0, scenes.SIZE[1] / 2 + G * (k * DT) ** 2 / 8, 0]]])
    world.step(steps=20 * STEPS)
    assert not world.asleep.any()
    world.step(steps=k)
    assert world.pos[0, 0, 1] - scenes.SIZE[1] / 2 <= G * (k * DT) ** 2 / 8 + 2 * SLOP


@pytest.mark.compiled
@pytest.mark.parametrize("speed", [1e-4, 1e-2, 1.0])
def test_a_slide_goes_to_its_end(speed):
    world, awake = worlds()
    for one in (world, awake):
        one.set_state(linvel=[[[speed, 0, 0]]])
        one.step(steps=4 * STEPS)
    assert world.asleep.all()
    assert np.array_equal(world.state, awake.state)


# --- unstable balance ------------------------------------------------------------------------------------------


class WithSleep(Setting):
    """A setting of the hard cases in whose scenes bodies may sleep."""

    def world(self, scene, worlds=1):
        return super().world(sleeping(scene), worlds)


@pytest.mark.parametrize(
    ("name", "accuracy"),
    sweep(
        itertools.product(["on-edge", "on-vertex", "dominoes"], ["fast", "balanced", "precise"]),
        [("on-edge", "balanced"), ("on-vertex", "fast")],
    ),
)
def test_what_must_fall_falls(name, accuracy):
    (case,) = registry.find((name,))
    failed = [check for check in case.run(WithSleep(accuracy, DT, is_thorough=False)) if not check.passes]
    assert not failed, "\n".join(map(str, failed))


def on_edge(offset):
    """A unit cube on its edge, `offset` [rad] beside the balance."""
    angle = math.pi / 4 + offset
    pos = (0, 0.5 * (math.sin(angle) + math.cos(angle)), 0)
    cube = physics.Block((1, 1, 1), 1.0, pos=pos, quat=(math.cos(angle / 2), 0, 0, math.sin(angle / 2)))
    effects = [physics.Gravity((0, -G, 0)), physics.Contact(0.0), physics.Friction(2.0)]
    return physics.Scene([cube], [physics.HalfSpace((0, 1, 0))], effects)


@pytest.mark.parametrize(
    ("power", "accuracy"),
    sweep(itertools.product(range(2, 15, 2), ["fast", "balanced"]), [(2, "fast"), (8, "fast"), (14, "balanced")]),
)
def test_from_the_smallest_offset_a_cube_falls_off_its_edge_as_if_none_slept(power, accuracy, is_exhaustive):
    """In a window it turns by less than the slop, for many windows, but by more in each: the same bits as without."""
    world, awake = worlds(on_edge(10.0**-power), accuracy=accuracy)
    rate = math.sqrt(3 * G / (2 * math.sqrt(2)))
    fallen = math.acosh(2 * 10.0**power) / rate  # some 2 rad of the linear law
    for one in (world, awake):
        one.step(steps=round(fallen / DT))
    assert not world.asleep.any()
    assert np.array_equal(world.state, awake.state)
    for one in (world, awake):
        one.step(steps=round((10.0 if is_exhaustive else 4.0) / DT))
    assert world.asleep.all()
    assert abs(abs(world.quat[0, 0] @ (1, 0, 0, 0)) - math.sqrt(0.5)) < 1e-4 or world.quat[0, 0, 0] ** 2 > 1 - 1e-8
    assert np.array_equal(world.state, awake.state)


# --- waking ----------------------------------------------------------------------------------------------------


def test_a_push_beyond_friction_wakes_it_and_it_goes_as_the_law_says():
    """F = m g/2 at the centre: a = F/m - μ g. Solved to the tolerance of g dt a step, as the hard case that tips."""
    world = asleep_world()
    world.step(force(0.5 * WEIGHT), steps=100)
    assert not world.asleep.any()
    limit = 2 * resolve("balanced").tolerance * G + 64 * np.finfo(float).eps
    assert world.pos[0, 0, 0] == pytest.approx(0.5 * (0.5 - MU) * G, abs=limit)


def test_a_push_within_friction_wakes_it_and_it_sleeps_under_it_again():
    world = asleep_world()
    load = force(0.9 * MU * WEIGHT)
    assert world.step(load).solves == 1
    assert not world.asleep.any()
    world.step(load, steps=2 * STEPS - 1)
    assert world.asleep.all()
    assert world.step(load).solves == 0
    assert world.pos[0, 0, 0] == 0.0
    assert world.step().solves == 1  # the push ends: another wrench


CHANGES = [
    (lambda world: world.set_state(linvel=[[[1, 0, 0]]]), 1 - MU * G * DT),
    (lambda world: world.set_parameters(gravity=(0.5 * G, -G, 0)), (0.5 - MU) * G * DT),
    (lambda world: world.set_parameters(mass=2.0), 0.0),
    (lambda world: world.set_parameters(friction=0.1), 0.0),
]
"""Changes from outside, each with the speed after the next step [m/s]."""


@pytest.mark.parametrize(("change", "speed"), [*CHANGES, (lambda world: world.set_parameters(restitution=0.5), 0.0)])
def test_a_change_from_outside_wakes_it(change, speed):
    world = asleep_world()
    change(world)
    assert not world.asleep.any()
    assert world.step().solves >= 1
    assert world.linvel[0, 0, 0] == pytest.approx(speed, abs=1e-12 + resolve("balanced").tolerance * G * DT)


@pytest.mark.compiled
def test_on_its_face_the_bits_are_those_of_what_never_sleeps():
    """There what rests has no velocity to the last bit, so that sleep changes nothing."""
    world, awake = worlds()
    for share, steps in ((0.0, 3 * STEPS), (0.5, 50), (-0.4, 30), (0.0, 5 * STEPS), (0.2, 3 * STEPS), (0.31, 40)):
        for one in (world, awake):
            one.step(force(share * WEIGHT), steps=steps)
        assert np.array_equal(world.state, awake.state)
        assert np.array_equal(world.memory, awake.memory)


@pytest.mark.compiled
@given(st.lists(st.tuples(st.sampled_from([0.0, 0.1, 0.29, 0.31, 0.5, -0.4]), st.integers(1, 5 * STEPS)), max_size=6))
def test_whatever_the_pushes_it_is_where_it_would_be_but_for_the_slop_of_each_window(pushes):
    """On the floor and at the walls: what sleeps would have gone less than a slop in each window."""
    world, awake, steps_taken = *worlds(), 0
    for share, steps in [(0.0, 3 * STEPS), *pushes]:
        for one in (world, awake):
            one.step(force(share * WEIGHT), steps=steps)
        steps_taken += steps
        assert np.abs(world.pos - awake.pos).max() <= SLOP * steps_taken / STEPS


@pytest.mark.compiled
def test_what_never_rests_has_the_same_bits(rng):
    world, awake = worlds(scenes.drop())
    for wrench in rng.uniform(-40, 40, (200, 1, 1, 6)):
        for one in (world, awake):
            one.step(wrench, steps=5)
        assert np.array_equal(world.state, awake.state)
        assert np.array_equal(world.report_table, awake.report_table)


# --- batches, and going on -------------------------------------------------------------------------------------


@pytest.mark.compiled
@pytest.mark.parametrize("threads", sweep([1, 2], [2]))
def test_each_world_of_a_batch_sleeps_for_itself(threads, is_exhaustive):
    worlds = 40 if is_exhaustive else 10
    batch = physics.World(sleeping(BLOCK), worlds=worlds, dt=DT, threads=threads)
    alone = [physics.World(sleeping(BLOCK), dt=DT) for _ in range(worlds)]
    pushes = np.zeros((3, worlds, 1, 6))
    pushes[1, ::3, 0, 0] = 0.5 * WEIGHT
    for wrench, steps in zip(pushes, (2 * STEPS, 50, 30)):
        batch.step(wrench, steps=steps)
        for k, world in enumerate(alone):
            world.step(wrench[k : k + 1], steps=steps)
    assert np.array_equal(batch.asleep[:, 0], np.arange(worlds) % 3 > 0)
    for k, world in enumerate(alone):
        assert np.array_equal(batch.pos[k], world.pos[0])
        assert batch.asleep[k] == world.asleep[0]


@pytest.mark.parametrize("before", [STEPS // 2, STEPS + 7, 3 * STEPS])
def test_a_snapshot_and_a_copy_go_on_bit_for_bit(before):
    world = physics.World(sleeping(BLOCK), dt=DT)
    world.step(steps=before)
    snap, copy = world.snapshot(), pickle.loads(pickle.dumps(world))
    ends = []
    for one in (world, copy):
        one.step(steps=2 * STEPS)
        one.step(force(0.5 * WEIGHT), steps=20)
        ends.append(b"".join(array.tobytes() for array in one.kept()))
    world.restore(snap)
    assert np.array_equal(world.asleep, [[before == 3 * STEPS]])
    world.step(steps=2 * STEPS)
    world.step(force(0.5 * WEIGHT), steps=20)
    assert ends[0] == ends[1] == b"".join(array.tobytes() for array in world.kept())


def test_one_call_of_many_steps_is_many_calls():
    one, many = (physics.World(sleeping(BLOCK), dt=DT) for _ in range(2))
    one.step(steps=3 * STEPS)
    for _ in range(3 * STEPS):
        many.step()
    assert all(np.array_equal(a, b) for a, b in zip(one.kept()[:-2], many.kept()[:-2]))
    assert np.array_equal(one.sleep, many.sleep)


def test_a_recording_is_replayed_bit_for_bit(tmp_path):
    world = physics.World(sleeping(BLOCK), dt=DT)
    world.step(steps=2 * STEPS - 5)
    recorder = physics.Recorder(world)
    for k in range(30):
        world.step(force(0.5 * WEIGHT if k > 20 else 0.0))
    recording = physics.Recording.load(recorder.save(tmp_path / "sleep.npz"))
    assert recording.replay().is_identical
    assert (recording.world().sleep[0] == recorder.recording().starts[0].snapshot.arrays[-1]).all()
