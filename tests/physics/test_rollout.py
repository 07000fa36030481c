"""A rollout is `World.step` with one wrench after another, bit for bit, and says what it needs and what it refuses."""

from __future__ import annotations

import copy

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import physics
from physics import scenes
from physics.world import batch_arrays
from tests.physics.test_field_errors import Reaching
from tests.physics.test_restore import ball, blocks, gusty, lagging, sleepers

COLUMNS = ("pos", "quat", "linvel", "angvel")


def lag_alone(worlds: int) -> physics.World:
    return ball(worlds, physics.Actuator(lag=0.05, limit_force=4.0))


def limited(worlds: int) -> physics.World:
    return ball(worlds, physics.Actuator(limit_force=3.0, limit_torque=1.0))


WORLDS = {
    "one body": blocks,
    "by events": lambda worlds: blocks(worlds, "precise", 0.03),
    "many bodies that sleep": sleepers,
    "gusts": gusty,
    "limits": limited,
    "a lag": lag_alone,
    "a lag and a delay": lagging,
}


def drawn(world: physics.World, length: int, seed: int) -> np.ndarray:
    """Wrenches in which some worlds are left alone for a while."""
    rng = np.random.default_rng(seed)
    wrenches = rng.uniform(-8.0, 8.0, (world.worlds, length, world.body_count, 6))
    wrenches[rng.random(world.worlds) < 0.3] = 0.0
    return wrenches


def one_by_one(world: physics.World, wrenches, steps=1, dt=None):
    """States of `World.step` after each wrench, times, and the gravest status of each world."""
    states, times, gravest = {name: [] for name in COLUMNS}, [], np.zeros(world.worlds, dtype=int)
    for k in range(wrenches.shape[1]):
        status = world.step(wrenches[:, k], steps, dt).status
        gravest = np.where([physics.Status.severity(a) > physics.Status.severity(b)
                            for a, b in zip(status.tolist(), gravest.tolist())], status, gravest)  # fmt: skip
        times.append(world.time)
        for name in COLUMNS:
            states[name].append(getattr(world, name).copy())
    return {name: np.stack(found, axis=1) for name, found in states.items()}, np.array(times), gravest


def threaded(world: physics.World, threads: int) -> physics.World:
    """The same world on other threads."""
    found = physics.World(world.scene, world.worlds, world.dt, world.accuracy, threads)
    found.restore(world.snapshot())
    return found


def check(world: physics.World, wrenches, threads=1, steps=1, dt=None, every=1, columns=COLUMNS):
    """Roll out a copy of `world`; everything is as if it had been stepped."""
    rolled = threaded(world, threads)
    expected, times, status = one_by_one(world, wrenches, steps, dt)
    found = physics.rollout(rolled, wrenches, steps=steps, dt=dt, every=every, columns=columns)
    for name in COLUMNS:
        if name in columns:
            np.testing.assert_array_equal(getattr(found, name), expected[name][:, every - 1 :: every])
        else:
            assert getattr(found, name) is None
    np.testing.assert_array_equal(found.times, times[every - 1 :: every])
    np.testing.assert_array_equal(found.status, status)
    for array, value in zip(rolled.kept(), world.kept()):
        np.testing.assert_array_equal(array, value)
    assert rolled.time == world.time
    if world.actuation is not None:
        np.testing.assert_array_equal(rolled.actuation.kept()[0], world.actuation.kept()[0])
    rolled.step(wrenches[:, 0])
    world.step(wrenches[:, 0])
    np.testing.assert_array_equal(rolled.state, world.state)


@pytest.mark.parametrize("name", WORLDS)
@given(data=st.data())
@settings(max_examples=12)
def test_it_is_step_in_a_loop(name, data):
    world = WORLDS[name](data.draw(st.integers(1, 20), "worlds"))
    world.step(steps=data.draw(st.integers(1, 30), "before"))
    every = data.draw(st.integers(1, 3), "every")
    wrenches = drawn(world, every * data.draw(st.integers(1, 6), "samples"), data.draw(st.integers(0, 99), "seed"))
    check(
        world, wrenches, data.draw(st.integers(1, 2), "threads"), data.draw(st.integers(1, 3), "steps"),
        data.draw(st.sampled_from([None, 0.004])), every,
        data.draw(st.lists(st.sampled_from(COLUMNS), min_size=1, unique=True), "columns"),
    )  # fmt: skip


@pytest.mark.parametrize("threads", [1, 2])
def test_in_contact_and_through_impacts(threads):
    """From the air to the floor and on it: impacts, warm starts and all."""
    world = blocks(20)
    check(world, drawn(world, 500, 3), threads)
    assert len(world.contacts(0)[0]) > 0


@pytest.mark.parametrize("held", [1, 3])
def test_all_worlds_may_begin_at_a_snapshot(held):
    """One world tried with several sequences of wrenches, or each from its own place."""
    real = blocks(held)
    real.step(steps=350)
    world = blocks(3)
    wrenches = drawn(world, 10, 1)
    found = physics.rollout(world, wrenches, initial=real.snapshot())
    twin = blocks(3)
    twin.restore(real.snapshot())
    expected, times, _ = one_by_one(twin, wrenches)
    np.testing.assert_array_equal(found.pos, expected["pos"])
    np.testing.assert_array_equal(found.times, times)
    assert world.time == twin.time


def test_memory_is_used_again():
    world = blocks(3)
    kept, wrenches = world.snapshot(), drawn(world, 4, 0)
    first = physics.rollout(world, wrenches, kept)
    pos, before, times = first.pos, first.pos.copy(), first.times.copy()
    again = physics.rollout(world, 2 * wrenches, kept, out=first)
    assert again is first
    assert first.pos is pos
    assert not np.array_equal(pos, before)
    np.testing.assert_array_equal(physics.rollout(world, wrenches, kept, out=first).pos, before)
    np.testing.assert_array_equal(first.times, times)
    assert first.report.iterations.tolist() == physics.rollout(world, wrenches, kept).report.iterations.tolist()


def test_shapes_of_wrenches_of_one_body():
    worlds = [blocks(3) for _ in range(3)]
    wrenches = drawn(worlds[0], 4, 0)
    ends = [physics.rollout(worlds[0], wrenches[:, :, 0]).pos, physics.rollout(worlds[1], wrenches.tolist()).pos,
            physics.rollout(worlds[2], np.asfortranarray(wrenches)).pos]  # fmt: skip
    for end in ends:
        np.testing.assert_array_equal(end, ends[0])


def test_a_recorder_is_told_of_every_step():
    world, twin = blocks(3), blocks(3)
    recorder = physics.Recorder(world)
    wrenches = drawn(world, 6, 2)
    found = physics.rollout(world, wrenches, steps=2)
    np.testing.assert_array_equal(found.quat, one_by_one(twin, wrenches, 2)[0]["quat"])
    recording = recorder.recording(1)
    assert len(recording) == 6
    assert recording.replay().is_identical


def test_faults_of_any_step_count():
    """Two bodies of which one is thrown out of all bounds in the second of three steps: old state kept, and told."""
    world = ball(2)
    wrenches = np.zeros((2, 3, 1, 6))
    wrenches[1, 1, 0, 0] = 1e300
    found = physics.rollout(world, wrenches)
    assert found.status.tolist() == [physics.Status.OK, physics.Status.FAULT]
    assert found.report.faults.tolist() == [0, 1]
    assert found.report.fault_body.tolist() == [-1, 0]
    assert world.report.faults.tolist() == [0, 0]
    assert "ok=False" in repr(found)


def test_messages_name_bodies_and_out_is_of_the_same():
    named, other = (physics.World(physics.Scene([physics.Sphere(0.5, 2.0, name=name)])) for name in ("crate", "barrel"))
    wrenches = np.zeros((1, 1, 1, 6))
    found = physics.rollout(named, 1e300 * (wrenches + 1))
    assert "crate" in found.report.messages()[0]
    before = other.state.copy()
    with pytest.raises(ValueError, match=r"out .*'crate'.*'barrel'"):
        physics.rollout(other, wrenches, out=found)
    np.testing.assert_array_equal(other.state, before)


@pytest.mark.parametrize("threads", [1, 2])
@pytest.mark.parametrize("is_recorded", [False, True])
def test_an_exception_of_a_field_puts_everything_back(threads, is_recorded):
    world = physics.World(physics.Scene([physics.Sphere(0.5, 2.0)], effects=[Reaching()]), 3, threads=threads)
    if is_recorded:
        physics.Recorder(world)
    wrenches = np.zeros((3, 100, 1, 6))
    wrenches[2, 5:, 0, 1] = 100.0  # in the end this world is too fast for the field
    start = blocks_like(world)
    before, time = [array.copy() for array in world.kept()], world.time
    for initial in (None, start):
        with pytest.raises(IndexError, match=r"index .*out of bounds .*in a function of Reaching"):
            physics.rollout(world, wrenches, initial)
        for array, value in zip(world.kept(), before):
            np.testing.assert_array_equal(array, value)
        assert world.time == time
    assert physics.rollout(world, 0 * wrenches).report.ok  # and may be rolled out again


def blocks_like(world: physics.World) -> physics.Snapshot:
    """Another moment of the same scene."""
    other = physics.World(world.scene, world.worlds, world.dt, world.accuracy)
    other.step()
    return other.snapshot()


def shorter() -> physics.Rollout:
    return physics.rollout(blocks(3), np.zeros((3, 2, 6)))


WRONG = {
    "a world": (lambda w: physics.rollout(7, np.zeros((3, 2, 6))), "world is 7; allowed is a physics.World"),
    "of other worlds": (lambda w: physics.rollout(w, np.zeros((2, 4, 6))), r"\(2, 4, 6\); .*\(3, length, 1, 6\)"),
    "no steps": (lambda w: physics.rollout(w, np.zeros((3, 0, 6))), "a length of at least 1"),
    "not finite": (lambda w: physics.rollout(w, np.full((3, 2, 6), np.nan)), r"\[0, 0, 0, 0\] is nan; .* finite"),
    "text": (lambda w: physics.rollout(w, "push"), "wrenches is 'push'; allowed are numbers in shape"),
    "steps": (lambda w: physics.rollout(w, np.zeros((3, 2, 6)), steps=0), "steps is 0; allowed"),
    "dt": (lambda w: physics.rollout(w, np.zeros((3, 2, 6)), dt=-1.0), "dt is -1.0; allowed"),
    "every": (lambda w: physics.rollout(w, np.zeros((3, 4, 6)), every=3), "every is 3; allowed are divisors of 4"),
    "column": (lambda w: physics.rollout(w, np.zeros((3, 4, 6)), columns=["poss"]), "columns is 'poss'; .* pos"),
    "no column": (lambda w: physics.rollout(w, np.zeros((3, 4, 6)), columns=[]), r"columns is \[\]; allowed are some"),
    "twice": (lambda w: physics.rollout(w, np.zeros((3, 4, 6)), columns=["pos", "pos"]), "each once"),
    "not a list": (lambda w: physics.rollout(w, np.zeros((3, 4, 6)), columns=3), "columns is 3; allowed are pos"),
    "initial": (lambda w: physics.rollout(w, np.zeros((3, 4, 6)), initial=w), "snapshot is World"),
    "other initial": (lambda w: physics.rollout(w, np.zeros((3, 4, 6)), initial=blocks(2).snapshot()), "or of 3"),
    "out": (lambda w: physics.rollout(w, np.zeros((3, 4, 6)), out=[]), r"out is \[\]; allowed is None"),
    "other out": (lambda w: physics.rollout(w, np.zeros((3, 4, 6)), out=shorter()), "`rollout` has made, with .*4"),
}  # fmt: skip


@pytest.mark.parametrize("name", WRONG)
def test_errors_say_what_is_allowed_and_nothing_moves(name):
    call, message = WRONG[name]
    world = blocks(3)
    before = copy.deepcopy(world)
    with pytest.raises(ValueError, match=f"(?s){message}"):
        call(world)
    for array, value in zip(world.kept(), before.kept()):
        np.testing.assert_array_equal(array, value)
    assert world.time == before.time
    assert not world.is_in_use


def test_what_the_memory_does_not_hold_is_refused(monkeypatch):
    world = blocks(4)
    wrenches = np.zeros((4, 1024, 1, 6))
    monkeypatch.setattr(batch_arrays, "machine_memory", lambda: 400 * 2**10)
    with pytest.raises(
        ValueError, match=r"states of 1024 moments in 4 worlds need 0.0004\d+ GiB.*raise `every`, or keep"
    ):
        physics.rollout(world, wrenches)
    assert world.time == 0.0
    found = physics.rollout(world, wrenches, columns=["pos"])
    assert found.nbytes == 8 * (4 * 1024 * 3 + 1024) + found.report_table.nbytes
    assert physics.rollout(world, wrenches, every=1024).pos.shape == (4, 1, 1, 3)


def test_it_is_shown_on_a_screen():
    world = physics.World(scenes.drop(), worlds=2)
    text = repr(physics.rollout(world, np.zeros((2, 4, 6)), columns=["pos", "quat"]))
    assert text.startswith("Rollout(2 worlds of 1 bodies, 4 states, t = 0.01 to 0.04 s, pos, quat,")
    assert text.endswith("MiB)")


def test_a_world_in_use_is_refused():
    world = blocks(3)
    assert world.is_free
    world.is_free = False
    with pytest.raises(RuntimeError, match="World is being used by another thread"):
        physics.rollout(world, np.zeros((3, 2, 6)))
