"""Prescribed motions in descriptions and worlds: what is refused, files, batches, snapshots, rollouts, tasks."""

from __future__ import annotations

import math
import pickle

import numpy as np
import pytest

import physics
from physics.io.mjcf.writer import to_mjcf
from physics.io.toml import from_toml, to_toml
from physics.plan.plan import make_plan
from tests.physics.test_motion import BOX, LAWS, support

TIMES, PLACES = (0.0, 0.2, 0.5), [(0, -0.5, 0), (0.1, -0.5, 0), (0, -0.5, 0)]
SHAKE = physics.Motion.table(TIMES, PLACES, repeat=True)
SWING = physics.Motion.table((0, 1), quat=[(1, 0, 0, 0), (0.8, 0, 0.6, 0)], surface_velocity=(0, 0, 1))
BELT = physics.Motion(surface_velocity=(1, 0, 0))
MOTIONS = {"shake": SHAKE, "swing": SWING, "belt": BELT, "drum": physics.Motion(velocity=(0, 0, 1), spin=(0, 2, 0))}


def scene(motion=SHAKE, *more, laws=LAWS) -> physics.Scene:
    return physics.Scene([BOX, support(motion, name="belt"), *more], effects=laws)


def world(worlds: int = 1, motion=SHAKE, **given) -> physics.World:
    return physics.World(scene(motion), worlds, 0.005, **given)


# --- descriptions ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("motion", MOTIONS.values(), ids=MOTIONS)
def test_files_and_texts_make_a_motion_again(motion):
    assert eval(repr(motion), vars(physics)) == motion
    assert from_toml(to_toml(scene(motion))) == scene(motion)
    assert eval(repr(scene(motion)), vars(physics)) == scene(motion)


def test_a_scene_file_gives_a_motion_by_hand():
    text = """
    [[bodies]]
    kind = "Sphere"
    radius = 0.1
    mass = 1.0
    [[bodies]]
    kind = "Block"
    size = [4.0, 1.0, 2.0]
    fixed = true
    motion = {times = [0, 1], pos = [[0, 0, 0], [0, 1, 0]]}
    [[effects]]
    kind = "Contact"
    """
    assert from_toml(text).bodies[1].motion == physics.Motion.table((0, 1), [(0, 0, 0), (0, 1, 0)])
    with pytest.raises(ValueError, match=r"line 10: bodies\[1\]: Block.motion is .*; allowed are .*times"):
        from_toml(text.replace("times", "time"))


BAD = [
    (lambda: physics.Sphere(1.0, 2.0, motion=BELT), "motion is .* of a body that is not fixed; allowed is None"),
    (lambda: physics.Sphere(1.0, fixed=True, motion=3), "motion is 3; allowed are None and a physics.Motion"),
    (lambda: physics.Motion(velocity=(1, 2)), "Motion.velocity has shape"),
    (lambda: physics.Motion(spin=(0, math.nan, 0)), "Motion.spin is .*; allowed are finite numbers"),
    (lambda: physics.Motion(velocity=(1, 0, 0), times=TIMES, pos=PLACES), "Motion.velocity is .* with a table"),
    (lambda: physics.Motion(pos=PLACES), "Motion.pos is given without times"),
    (lambda: physics.Motion(repeat=True), "Motion.repeat is True without times"),
    (
        lambda: physics.Motion.table((0,), [(0, 0, 0)]),
        r"Motion.times has the shape \(1,\); allowed are 2 to 1000 times",
    ),
    (lambda: physics.Motion.table((0, 2, 1), PLACES), "Motion.times is .*; allowed are increasing times"),
    (lambda: physics.Motion.table((1, 2, 3), PLACES), "Motion.times is .*the first of them 0"),
    (lambda: physics.Motion.table((0, 1)), "Motion.times is given without poses"),
    (lambda: physics.Motion.table((0, 1), PLACES), "Motion.pos has shape"),
    (lambda: physics.Motion.table((0, 1), quat=[(1, 0, 0, 0), (0, 1, 0, 0)]), r"Motion.quat\[1\] is half a turn from"),
    (lambda: physics.Motion.table(TIMES, np.diag((1, 2, 3)), repeat=True), "Motion.pos ends at .*allowed are equal"),
    (lambda: physics.Motion.table((0, 1), quat=[(1, 0, 0, 0), (0.8, 0.6, 0, 0)], repeat=True), "Motion.quat ends at"),
    (lambda: to_mjcf(scene()), "MJCF cannot express .*motion"),
]


@pytest.mark.parametrize(("make", "message"), BAD)
def test_errors_name_the_field_and_the_value(make, message):
    with pytest.raises(ValueError, match=message):
        make()


def test_a_table_places_its_body():
    assert scene(physics.Motion.table((0, 1), [(1, 2, 3), (1, 2, 4)])).bodies[1].pos == (1.0, 2.0, 3.0)
    assert scene(SWING).bodies[1].pos == (0.0, -0.5, 0.0)


def test_the_plan_names_them_and_nothing_sleeps():
    plan = make_plan(scene(laws=[*LAWS, physics.Sleeping()]), "balanced")
    assert "prescribed motion" in plan.explain()
    assert "nothing sleeps where a body has a prescribed motion" in plan.explain()
    assert not plan.sleeping
    still = make_plan(scene(None), "balanced")
    assert "prescribed motion" not in still.explain()
    assert still.motion_columns == 0
    assert still.key != plan.key


# --- worlds ---------------------------------------------------------------------------------------------------------


def test_worlds_have_their_own_motions_and_bits_do_not_depend_on_the_batch():
    """Speeds for each world; a batch of five, on two threads, and each world alone give the same bits."""
    speeds = np.linspace((1, 0, 0), (-2, 0, 0.5), 5)
    alone, batch, threads = [world() for _ in range(5)], world(5), world(5, threads=2)
    for each in (batch, threads, *alone):
        each.step(steps=30)
    for each in (batch, threads):
        each.set_motion("belt", velocity=speeds)
        each.set_motion("belt", physics.Motion(spin=(0, 1, 0)), worlds=[4])
        each.step(steps=60)
    for k, each in enumerate(alone):
        each.set_motion(1, velocity=speeds[k])
        if k == 4:
            each.set_motion(1, physics.Motion(spin=(0, 1, 0)))
        each.step(steps=60)
    np.testing.assert_array_equal(batch.linvel[:4, 1], speeds[:4])
    np.testing.assert_array_equal(batch.angvel[4, 1], (0, 1, 0))
    assert batch.state.tobytes() == threads.state.tobytes()
    assert batch.state.tobytes() == b"".join(each.state.tobytes() for each in alone)


def test_snapshots_pickles_and_rollouts_go_on_with_the_same_bits():
    """The place in the table is in the time and the parameters."""
    one = world(2)
    one.step(steps=33)
    one.set_motion(1, SHAKE, worlds=[1])
    one.step(steps=20)
    snapshot, copy, other = one.snapshot(), pickle.loads(pickle.dumps(one)), world(2)
    other.restore(snapshot)
    physics.rollout(other, np.zeros((2, 60, 2, 6)))
    for _ in range(60):
        one.step()
        copy.step()
    end = one.state.tobytes()
    assert copy.state.tobytes() == end
    assert other.state.tobytes() == end
    one.restore(snapshot)
    one.step(steps=60)
    np.testing.assert_allclose(one.pos, copy.pos, atol=1e-5)  # times are added up in another order
    with pytest.raises(ValueError, match="in a scene with a field or a motion that may change with time"):
        one.restore(snapshot, worlds=[0], source=[0])


def test_recordings_replay_changes_of_motion(tmp_path):
    one = world()
    recorder = physics.Recorder(one)
    for velocity in ((0.5, 0, 0), (-1, 0, 0)):
        one.step(steps=20)
        one.set_motion(1, velocity=velocity)
    one.step(steps=20)
    physics.Recording.load(recorder.save(tmp_path / "motion.npz")).replay()


def test_set_motion_refuses_and_changes_nothing():
    one, still = world(3), physics.World(scene(None), dt=0.005)
    one.step(steps=7)
    before = one.state.tobytes(), one.params.tobytes(), one.memory.tobytes()
    calls = [
        (lambda: one.set_motion(0, BELT), "body is 0, which is not fixed; allowed are bodies with fixed=True"),
        (lambda: one.set_motion("best", BELT), "body is 'best'; allowed are belt, or indices from 0 to 1"),
        (lambda: one.set_motion(1), "allowed is a motion, or some of the three"),
        (lambda: one.set_motion(1, BELT, velocity=(1, 0, 0)), "allowed is a motion, or some of the three"),
        (lambda: one.set_motion(1, (1, 0, 0)), "motion is .*; allowed is a physics.Motion"),
        (lambda: one.set_motion(1, velocity=np.ones((2, 3))), r"velocity has shape \(2, 3\); allowed are \(3,\) and"),
        (lambda: one.set_motion(1, spin=(0, math.inf, 0)), "spin is .*; allowed are finite numbers"),
        (lambda: one.set_motion(1, BELT, worlds=[3]), "worlds is .*; allowed are indices from 0 to 2"),
        (
            lambda: one.set_motion(1, physics.Motion.table((0, 1, 2, 3), np.zeros((4, 3)))),
            "motion has a table of 4 times; allowed is at most 3, as in the scene's longest table",
        ),
        (lambda: still.set_motion(1, BELT), "no body of the scene has a motion"),
        (lambda: one.set_state(pos=one.pos + 1.0), r"places body 1 \(belt\) in world 0 .* but its motion is a table"),
        (lambda: one.set_state(linvel=one.linvel + 1.0), "linvel is .*which is fixed; allowed is .*World.set_motion"),
    ]
    for call, message in calls:
        with pytest.raises(ValueError, match=message):
            call()
    assert (one.state.tobytes(), one.params.tobytes(), one.memory.tobytes()) == before


def test_set_state_keeps_a_motion():
    """Its own velocities may be given back; a body that moves steadily goes on from where it was put."""
    one = world(motion=SHAKE)
    one.step(steps=10)
    one.set_state(pos=one.pos.copy(), linvel=one.linvel.copy(), angvel=one.angvel.copy())
    assert np.isfinite(one.state).all()
    one.set_motion(1, velocity=(0, 0, 1))
    pos = one.pos.copy()
    pos[0, 1] = (0, -0.5, 3)
    one.set_state(pos=pos, linvel=np.zeros((1, 2, 3)))
    np.testing.assert_array_equal(one.linvel[0, 1], (0, 0, 1))
    one.step(steps=20)
    np.testing.assert_allclose(one.pos[0, 1], (0, -0.5, 3.1), atol=1e-12)
    assert not physics.diagnose(one).kinetic_energy[:, 1].any()


def test_a_table_begins_when_it_is_set_where_the_body_stands():
    """A table of attitudes alone leaves the body at its place, in each world."""
    one = world(2, motion=physics.Motion.table((0, 0.1, 0.2), np.tile((0, -0.5, 0), (3, 1))))
    one.set_motion(1, velocity=[(1, 0, 0), (2, 0, 0)])
    one.step(steps=10)
    one.set_motion(1, physics.Motion.table((0, 0.1), quat=[(1, 0, 0, 0), (0.8, 0, 0.6, 0)]))
    one.step(steps=40)
    np.testing.assert_allclose(one.pos[:, 1], [(0.05, -0.5, 0), (0.1, -0.5, 0)], atol=1e-12)
    np.testing.assert_allclose(one.quat[:, 1], [(0.8, 0, 0.6, 0)] * 2, atol=1e-14)


def test_a_motion_wakes_up_again_with_an_episode():
    """`start_anew`, as tasks call it: the motions of the scene begin again, at the present time."""
    from physics.world.setters import start_anew

    one, new = world(2), world(1)
    one.step(steps=30)
    one.set_motion(1, velocity=(1, 0, 0))
    one.step(steps=9)
    poses = {name: np.array([getattr(body, name) for body in one.scene.bodies]) for name in ("pos", "quat")}
    start_anew(one, [1], {**poses, "linvel": np.zeros((2, 3)), "angvel": np.zeros((2, 3))}, {})
    one.step(steps=40)
    new.step(steps=40)
    np.testing.assert_allclose(one.pos[1], new.pos[0], atol=1e-7)
    assert one.pos[0, 1, 0] > 0.2  # the other world keeps its motion: 49 steps at 1 m/s
