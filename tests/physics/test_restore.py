"""Worlds go on from a snapshot bit for bit: in other places, in batches of other sizes, and some of them only."""

from __future__ import annotations

import copy
import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import physics
from physics import scenes
from physics.world.warm_starts import MANY_ROWS, copy_wall_memory
from tests.physics.test_sleeping_bodies import cubes, tower

DT = 0.01


def blocks(worlds: int, accuracy="balanced", dt=0.005) -> physics.World:
    """Blocks that fall to the floor, each with its own speed."""
    world = physics.World(scenes.drop(), worlds=worlds, dt=dt, accuracy=accuracy)
    world.set_state(linvel=np.array([[[1.0, 0, 0]]]) * np.arange(worlds)[:, None, None])
    return world


def sleepers(worlds: int) -> physics.World:
    """Two towers that fall asleep unless they are pushed."""
    return cubes(*tower(0, 3), *tower(3, 2), worlds=worlds)


def ball(worlds: int, *effects) -> physics.World:
    return physics.World(physics.Scene([physics.Sphere(0.5, 2.0)], effects=effects), worlds=worlds, dt=DT)


def lagging(worlds: int) -> physics.World:
    return ball(worlds, physics.Actuator(lag=0.05, delay=0.034))


def gusty(worlds: int) -> physics.World:
    return ball(worlds, physics.Drag(0.47), physics.Wind(gust=3.0, seed=5))


def pushes(world: physics.World, seed: int = 0) -> np.ndarray:
    return np.random.default_rng(seed).uniform(-5.0, 5.0, world.no_wrench().shape)


# A batch, and the steps that bring it where its warm starts, sleep or commands matter.
CASES = {
    "one body, in contact": (blocks, 900),
    "one body, by events": (lambda worlds: blocks(worlds, "precise", 0.03), 57),
    "many bodies, some asleep": (sleepers, 300),
    "an actuator with memory": (lagging, 7),
    "a field that changes with time": (gusty, 20),
}


def advanced(name: str, worlds: int = 3) -> physics.World:
    make, steps = CASES[name]
    world = make(worlds)
    wrench = pushes(world) if name != "many bodies, some asleep" else world.no_wrench()
    if name == "many bodies, some asleep":
        wrench[1, 0, 0] = 20.0
    world.step(wrench, steps=steps)
    return world


def same(worlds: physics.World, of, other: physics.World, those) -> None:
    """Some worlds are the same, bit for bit: all that is kept, but for the name of a group that sleeps."""
    for array, value, rows in zip(worlds.kept(), other.kept(), worlds.kept_rows()):
        if rows:
            ours, theirs = (a.reshape(n, rows, -1)[k] for a, n, k in ((array, worlds.worlds, of),
                                                                      (value, other.worlds, those)))  # fmt: skip
            np.testing.assert_array_equal(ours, theirs)
    assert np.array_equal(worlds.asleep[of], other.asleep[those])


def go_on(world: physics.World, of, other: physics.World, those) -> None:
    """Take the same steps with both; the worlds named stay the same."""
    wrench, theirs = world.no_wrench(), other.no_wrench()
    for k in range(3):
        theirs[...] = pushes(other, k)
        wrench[of] = theirs[those]
        world.step(wrench, steps=5)
        other.step(theirs, steps=5)
        same(world, of, other, those)


@pytest.mark.parametrize("name", CASES)
def test_a_world_goes_on_bit_for_bit_in_another_place_of_another_batch(name):
    source = advanced(name)
    batch = CASES[name][0](5)
    batch.step(pushes(batch, 9), steps=3)
    batch.restore(source.snapshot(), source=[2, 0, 1, 1, 2])
    assert batch.time == source.time
    same(batch, [0, 1, 2, 3, 4], source, [2, 0, 1, 1, 2])
    go_on(batch, [0, 1, 2, 3, 4], source, [2, 0, 1, 1, 2])


@pytest.mark.parametrize("name", CASES)
def test_one_world_goes_on_in_all_and_alone(name):
    source = advanced(name)
    kept = source.snapshot(worlds=[1])
    assert kept.worlds == 1
    for worlds in (1, 4):
        batch, twin = CASES[name][0](worlds), copy.deepcopy(source)
        batch.restore(kept)
        go_on(batch, list(range(worlds)), twin, [1] * worlds)


@pytest.mark.parametrize("name", CASES)
def test_some_worlds_go_back_and_the_others_do_not_notice(name):
    batch = advanced(name, 4)
    source = copy.deepcopy(batch)
    kept, late = batch.snapshot(worlds=[3, 1]), batch.snapshot()
    np.testing.assert_array_equal(kept.arrays[2], late.arrays[2][[3, 1]])
    batch.step(pushes(batch, 1), steps=5)
    others = copy.deepcopy(batch)
    if name == "a field that changes with time":
        with pytest.raises(ValueError, match=r"that may change with time; allowed is to restore"):
            batch.restore(kept, worlds=[3, 1])
        same(batch, slice(None), others, slice(None))
        kept = dataclasses.replace(kept, time=batch.time)
    time = batch.time
    batch.restore(kept, worlds=[3, 1])
    assert batch.time == time
    same(batch, [1, 3], source, [1, 3])
    if name not in ("a field that changes with time", "an actuator with memory"):  # they are at another time
        go_on(copy.deepcopy(batch), [1, 3], source, [1, 3])
    go_on(batch, [0, 2], others, [0, 2])


@given(st.data())
@settings(max_examples=30)
def test_any_worlds_of_a_snapshot_go_to_any_worlds_of_a_batch(data):
    held, worlds = data.draw(st.integers(1, 4)), data.draw(st.integers(1, 5))
    chosen = data.draw(st.lists(st.integers(0, worlds - 1), unique=True))
    source = data.draw(st.lists(st.integers(0, held - 1), min_size=len(chosen), max_size=len(chosen)))
    first, batch = blocks(held), blocks(worlds)
    first.step(steps=5)
    before = batch.snapshot()
    expected = [array.copy() for array in batch.kept()]
    for array, value in zip(expected, first.kept()):
        array[chosen] = value[source]
    batch.restore(first.snapshot(), worlds=chosen, source=source)
    for array, value in zip(batch.kept(), expected):
        np.testing.assert_array_equal(array, value)
    assert batch.time == (first.time if len(chosen) == worlds else before.time)
    batch.restore(before)
    assert batch.time == before.time
    for array, value in zip(batch.kept(), before.arrays):
        np.testing.assert_array_equal(array, value)


def test_a_mask_and_a_single_source_name_worlds_too():
    first, batch = blocks(3), blocks(4)
    batch.restore(first.snapshot(), worlds=[True, False, False, True], source=2)
    np.testing.assert_array_equal(batch.linvel[:, 0, 0], [2.0, 1.0, 2.0, 2.0])
    assert batch.snapshot(worlds=np.array([False, True, False, False])).worlds == 1
    batch.restore(first.snapshot(), source=1)
    np.testing.assert_array_equal(batch.linvel[:, 0, 0], [1.0] * 4)


@pytest.mark.parametrize("delay", [0.03, 0.034, 0.0456])
def test_commands_on_their_way_keep_their_age(delay):
    """Worlds restored into a batch that began later: both staircases in one, exact but for rounding.

    Speeds up to 1 m/s are sums of some twenty shares of 1 N for 0.01 s, each known to a rounding of the time.
    """
    early, late = (ball(2, physics.Actuator(lag=0.05, delay=delay)) for _ in range(2))
    early.step(pushes(early, 0), steps=7)
    late.step(pushes(late, 1), steps=2)
    kept = late.snapshot()
    early.restore(kept, worlds=[1], source=[0])
    twin, untouched = ball(2, physics.Actuator(lag=0.05, delay=delay)), ball(2, physics.Actuator(lag=0.05, delay=delay))
    twin.restore(kept)
    untouched.step(pushes(untouched, 0), steps=7)
    for k in range(8):
        wrench = pushes(early, k)
        early.step(wrench)
        twin.step(wrench[[1, 1]])
        untouched.step(wrench)
    assert early.state[1] == pytest.approx(twin.state[0], abs=1e-13)
    assert early.state[0] == pytest.approx(untouched.state[0], abs=1e-13)
    assert not np.array_equal(early.state[0], early.state[1])


def test_a_snapshot_is_taken_over_another():
    world = advanced("an actuator with memory")
    kept = world.snapshot()
    arrays = kept.arrays
    world.step(pushes(world, 1), steps=5)
    assert world.snapshot(out=kept) is kept
    assert all(array is before for array, before in zip(kept.arrays, arrays))
    assert kept.time == world.time
    twin = lagging(3)
    twin.restore(kept)
    go_on(twin, [0, 1, 2], world, [0, 1, 2])
    few = world.snapshot(worlds=[2])
    world.step(steps=2)
    assert world.snapshot(worlds=[1], out=few).worlds == 1
    np.testing.assert_array_equal(few.arrays[0], world.state[1:2])


def test_a_recorder_hears_of_the_worlds_that_went_back():
    world = blocks(3)
    kept = world.snapshot()
    recorder = physics.Recorder(world)
    world.step(steps=3)
    world.restore(kept, worlds=[2], source=[0])
    world.step(steps=3)
    assert [len(recorder.recording(k).starts) for k in range(3)] == [1, 1, 2]
    assert all(recorder.recording(k).replay().is_identical for k in range(3))


WRONG = {
    "twice": (lambda w, s: w.restore(s, worlds=[1, 1], source=[0, 1]), r"worlds is \[1, 1\]; .* each world once"),
    "not there": (lambda w, s: w.restore(s, worlds=[3], source=[0]), r"worlds is \[3\]; .* from 0 to 2"),
    "no such source": (lambda w, s: w.restore(s, worlds=[0], source=[2]), r"source is \[2\]; .* from 0 to 1"),
    "no source at all": (lambda w, s: w.restore(s, source=-1), r"source is -1; allowed are indices from 0 to 1"),
    "another number": (lambda w, s: w.restore(s, worlds=[0], source=[0, 1]), r"source is \[0, 1]; .* is one index"),
    "no number": (lambda w, s: w.restore(s, worlds=["a"]), r"worlds is \['a'\]; allowed is a list of indices"),
    "does not say which": (lambda w, s: w.restore(s), r"snapshot is Snapshot\(.*of 1 world or of 3 worlds, or of any"),
    "another scene": (lambda w, s: w.restore(sleepers(1).snapshot()), r"of another scene or batch size"),
    "out of another size": (lambda w, s: w.snapshot(out=s), r"out is Snapshot\(.*of 3 worlds, that can be written"),
    "out of another kind": (lambda w, s: w.snapshot(out=7), r"out is 7; allowed is None or a physics.Snapshot"),
    "no such world": (lambda w, s: w.snapshot(worlds=[7]), r"worlds is \[7\]; allowed are indices from 0 to 2"),
}  # fmt: skip


@pytest.mark.parametrize("name", WRONG)
def test_errors_say_what_is_allowed_and_change_nothing(name):
    call, message = WRONG[name]
    world, other = blocks(3), blocks(2)
    world.step(steps=2)
    kept, held = world.snapshot(), other.snapshot()
    before = [array.copy() for array in held.arrays]
    with pytest.raises(ValueError, match=f"(?s){message}"):
        call(world, held)
    for array, value in zip((*world.kept(), *held.arrays), (*kept.arrays, *before)):
        np.testing.assert_array_equal(array, value)
    assert (world.time, held.time) == (kept.time, other.time)


def test_commands_of_another_size_are_refused():
    world = advanced("an actuator with memory")
    kept = world.snapshot()
    strange = dataclasses.replace(kept, actuation=(np.zeros((2, 6)), []))
    with pytest.raises(ValueError, match="of another scene or batch size"):
        world.restore(strange)
    same(world, slice(None), world, slice(None))
    assert world.time == kept.time


@pytest.mark.parametrize(("accuracy", "dt", "steps"), [("balanced", 0.005, 400), ("precise", 0.03, 60)])
def test_the_contact_memory_of_many_worlds_is_copied_whole(accuracy, dt, steps):
    """Only contacts are copied, since all else in a row is zero: the arrays are the same for all that."""
    world = blocks(2 * MANY_ROWS, accuracy, dt)
    kept = world.snapshot()
    for k in range(4):
        world.step(steps=steps if k == 0 else 40)
        full = world.memory.copy()
        assert full.any()
        world.snapshot(out=kept)
        np.testing.assert_array_equal(kept.arrays[3], full)
        world.step(steps=40)
        assert not np.array_equal(world.memory, full)
        world.restore(kept)
        np.testing.assert_array_equal(world.memory, full)


def test_contact_memory_that_no_step_has_written_is_left_out():
    """Counts and slots beyond the table, of a snapshot that was damaged: nothing is written elsewhere."""
    source, target = np.zeros((3, 99)), np.zeros((3, 99))
    source[0, 1], source[1, 1], source[2, 1] = 1e6, 2, -5
    source[0, 3:27], source[1, 3:5] = 7.0, (-3.0, 24.0)
    source[:, 27:] = 1.0
    copy_wall_memory(source, target)
    assert target[0, 27:].nonzero()[0].tolist() == [21, 22, 23]
    assert not target[1:, 27:].any()
    copy_wall_memory(np.zeros((3, 99)), target)
    assert not target.any()
