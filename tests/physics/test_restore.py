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
from physics.schemes.wall_memory import MANY_ROWS, copy_wall_memory
from tests.physics.test_sleeping_bodies import cubes, tower

DT = 0.01
CORNERS = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])


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
    if name != "a field that changes with time":  # they are at another time
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
    """Worlds restored into a batch that began later: both staircases in one, bit for bit."""
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
    assert np.array_equal(early.state[1], twin.state[0])
    assert np.array_equal(early.state[0], untouched.state[0])
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
    "another scene": (lambda w, s: w.restore(sleepers(1).snapshot()), r"of another scene, whose bodies are 'block, b"),
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


FLOOR = physics.HalfSpace((0, 1, 0), 0.0)
ALIKE = {
    "sphere": {"bodies": [physics.Sphere(0.5, 2.0)]},
    "ellipsoid": {"bodies": [physics.Ellipsoid((0.5, 0.5, 0.5), 2.0)]},
    "drag": {"effects": [physics.Drag()]},
    "angular drag": {"effects": [physics.AngularDrag()]},
    "floor": {"walls": [FLOOR], "effects": [physics.Contact(0.3), physics.Friction()]},
    "deeper floor": {"walls": [physics.HalfSpace((0, 1, 0), -1.0)],
                     "effects": [physics.Contact(0.3), physics.Friction()]},
    "plastic floor": {"walls": [FLOOR], "effects": [physics.Contact(), physics.Friction()]},
    "wall": {"walls": [physics.HalfSpace((1, 0, 0), 0.0)], "effects": [physics.Contact(0.3), physics.Friction()]},
    "grain": {"walls": [FLOOR], "effects": [physics.Contact(0.3), physics.Friction((0.1, 0.2), axis=(1, 0, 0))]},
    "other grain": {"walls": [FLOOR], "effects": [physics.Contact(0.3), physics.Friction((0.1, 0.2), axis=(0, 0, 1))]},
    "lag": {"effects": [physics.Actuator(lag=0.1)]},
    "longer lag": {"effects": [physics.Actuator(lag=0.2)]},
    "hull": {"bodies": [physics.Hull(0.5 * CORNERS, 2.0)]},
    "larger hull": {"bodies": [physics.Hull(CORNERS, 2.0)]},
}  # fmt: skip


def test_a_snapshot_of_another_scene_is_refused_also_where_the_sizes_of_arrays_agree(tmp_path):
    """From memory and from a file; what is compiled, and what no array holds, must be the same."""
    worlds = {name: physics.World(physics.Scene(**({"bodies": [physics.Sphere(0.5, 2.0, pos=(2, 2, 2))]} | given)))
              for name, given in ALIKE.items()}  # fmt: skip
    same_sizes = 0
    for name, world in worlds.items():
        kept = world.snapshot()
        read = physics.Snapshot.load(kept.save(tmp_path / "kept.npz"))
        copy.deepcopy(world).restore(read)
        for other in (worlds[each] for each in worlds if each != name):
            same_sizes += [array.shape for array in other.kept()] == [array.shape for array in kept.arrays]
            before = other.state.copy()
            for snapshot in (kept, read):
                with pytest.raises(ValueError, match=r"of another scene, whose (bodies|walls|effects) are .*allowed"):
                    other.restore(snapshot)
            assert np.array_equal(other.state, before)
    assert same_sizes > 20


def test_numbers_that_a_world_may_have_of_its_own_are_no_other_scene():
    first = physics.World(
        physics.Scene([physics.Block((1, 2, 3), 2.0)], effects=[physics.Gravity(), physics.Drag(0.4)])
    )
    heavy = physics.Scene([physics.Block((3, 2, 1), 5.0)], effects=[physics.Drag(0.1), physics.Gravity((0, -1, 0))])
    second = physics.World(heavy)
    second.restore(first.snapshot())
    for array, value in zip(second.kept(), first.kept()):
        np.testing.assert_array_equal(array, value)


@pytest.mark.parametrize(
    "body",
    [
        physics.Block((1, 2, 3), 2.0),
        physics.Block((1, 1, 1), 2.0, center=(0.1, 0, 0), inertia_body=np.eye(3)),
        physics.Block((1, 1, 1), 2.0, inertia_body=[[2, 0.5, 0], [0.5, 2, 0], [0, 0, 2]]),
    ],
)
def test_bodies_that_the_kernel_of_a_scene_cannot_turn_are_refused(body):
    """A cube has no gyroscopic torque, so that no kernel of a scene of cubes has one."""
    cube = physics.World(physics.Scene([physics.Block((1, 1, 1), 2.0)]))
    before = cube.params.copy()
    with pytest.raises(ValueError, match=r"with inertias or centres of mass that the kernel.*allowed"):
        cube.restore(physics.World(physics.Scene([body])).snapshot())
    assert np.array_equal(cube.params, before)


def test_bodies_that_are_turned_by_less_are_taken():
    long, cube = ({"size": size, "mass": 2.0} for size in ((1, 2, 3), (1, 1, 1)))
    tilted = {**long, "inertia_body": [[2, 0.5, 0], [0.5, 3, 0], [0, 0, 4]]}
    world, *others = (physics.World(physics.Scene([physics.Block(**each)])) for each in (long, cube, tilted))
    kept = [other.snapshot() for other in others]
    world.restore(kept[0])
    with pytest.raises(ValueError, match="inertias or centres of mass"):
        world.restore(kept[1])


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
