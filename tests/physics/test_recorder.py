"""The recorder: what it keeps is replayed bit for bit, whatever happened, in this process and another."""

from __future__ import annotations

import json
import subprocess
import sys

import numpy as np
import pytest

import physics
from physics import scenes
from physics.kernels.state import layout as at
from tests.physics.test_bodies import heap

pytestmark = pytest.mark.interpreted


def pushed(worlds=3):
    return physics.World(scenes.shove(), worlds=worlds, dt=0.005)


def drive(world, steps, seed=0):
    """Random wrenches, and changes from outside now and then."""
    rng = np.random.default_rng(seed)
    for k in range(steps):
        if k % 11 == 5:
            world.set_state(linvel=rng.uniform(-1, 1, (1, world.body_count, 3)), worlds=[k % world.worlds])
        if k % 17 == 3:
            world.set_parameters(friction=[float(rng.uniform(0.1, 0.9))], worlds=[k % world.worlds])
        world.step(rng.uniform(-5, 5, (world.worlds, world.body_count, 6)), steps=1 + k % 2)


@pytest.mark.compiled
@pytest.mark.parametrize("make", [pushed, heap])
def test_a_recording_is_replayed_bit_for_bit_world_by_world(make, tmp_path):
    """In a world of its own, although it was one of three; wrenches, changes from outside and all."""
    world = make(3)
    recorder = physics.Recorder(world, keep=30)
    drive(world, 100)
    for k in range(3):
        path = recorder.save(tmp_path / f"{k}.npz", world=k)
        replay = physics.Recording.load(path).replay()
        assert 30 <= len(replay.recording) <= 60
        assert replay.is_identical
        assert np.array_equal(replay.states[-1], world.state.reshape(3, -1, at.STATE_SIZE)[k])
        assert replay.times[-1] == pytest.approx(world.time, rel=1e-12)  # a sum of 150 steps
        assert np.array_equal(replay.reports[-1].penetration, world.report.penetration[[k]])


def test_loads_past_an_actuator_are_replayed_and_told_by_the_format(tmp_path):
    scene = physics.Scene([physics.Sphere(0.5, 2.0)], effects=[physics.Actuator(limit_force=5.0)])
    world = physics.World(scene, worlds=2)
    recorder = physics.Recorder(world)
    rng = np.random.default_rng(0)
    formats = []
    for turn in range(2):
        for k in range(6):
            load = rng.uniform(-50, 50, (2, 1, 6)) if turn and k % 2 else None
            with world.actuation.passed_by(load):
                world.step(rng.uniform(-9, 9, (2, 1, 6)), steps=1 + k % 2)
        for k in range(2):
            path = recorder.save(tmp_path / "run.npz", world=k)
            replay = physics.Recording.load(path).replay()
            assert replay.is_identical
            assert np.array_equal(replay.states[-1], world.state[k : k + 1])
            with np.load(path) as file:
                formats.append(json.loads(str(file["head"]))["format"])
    assert formats == [1, 1, 2, 2]  # a reader that knows no such loads refuses a file that has some


def test_a_fault_is_written_once_and_says_why(tmp_path):
    """A torque that overflows in world 1, given to the Stepper unchecked."""
    world = physics.World(scenes.tumble(), worlds=2, dt=0.01)
    recorder = physics.Recorder(world, keep=5, folder=tmp_path / "faults", limit=1)
    stepper = physics.Stepper(world)
    for k in range(12):
        stepper.wrench[1, 0, :] = np.nan if k >= 8 else 1.0
        stepper()
    (path,) = recorder.files
    recording = physics.Recording.load(path)
    assert path.name == "fault-0.npz"
    assert "world 1" in recording.reason
    assert len(recording) == 9
    assert np.isnan(recording.wrenches[-1]).all()
    replay = recording.replay()
    assert replay.is_identical
    assert [int(report.faults[0]) for report in replay.reports] == [0] * 8 + [1]


def test_no_fault_no_file(tmp_path):
    world = pushed()
    physics.Recorder(world, folder=tmp_path / "faults")
    drive(world, 20)
    assert not (tmp_path / "faults").exists()


def test_what_has_changed_is_found(tmp_path):
    """One bit of one state flipped: the replay names the step, and how far it is off."""
    world = pushed(1)
    recorder = physics.Recorder(world)
    drive(world, 10)
    recording = recorder.recording()
    recording.states[6, 0, at.POS] = np.nextafter(recording.states[6, 0, at.POS], np.inf)
    replay = recording.replay()
    assert replay.first_difference == 6
    assert 0 < replay.distances.max() < 1e-14


def test_recording_changes_nothing_and_can_end():
    alone, watched = pushed(), pushed()
    recorder = physics.Recorder(watched, keep=7)
    drive(alone, 30)
    drive(watched, 30)
    assert np.array_equal(alone.state, watched.state)
    count = len(recorder.recording())
    recorder.stop()
    watched.step()
    assert watched.recorder is None
    assert len(recorder.recording()) == count


def test_what_is_asked_wrongly_is_refused(tmp_path):
    world = pushed()
    with pytest.raises(ValueError, match="keep is 0"):
        physics.Recorder(world, keep=0)
    with pytest.raises(ValueError, match="on is "):
        physics.Recorder(world, on=(3,))
    assert world.recorder is None
    with pytest.raises(ValueError, match="world is 3; allowed are indices from 0 to 2"):
        physics.Recorder(world).save(tmp_path / "x.npz", world=3)
    (tmp_path / "x.npz").write_bytes(b"no")
    with pytest.raises(ValueError, match=r"x\.npz is no recording"):
        physics.Recording.load(tmp_path / "x.npz")
    np.savez(tmp_path / "y.npz", a=1)
    with pytest.raises(ValueError, match=r"y\.npz is no recording"):
        physics.Recording.load(tmp_path / "y.npz")


def command(*arguments):
    return subprocess.run([sys.executable, "-m", "rigid_env", "replay", *arguments], capture_output=True, text=True)


@pytest.mark.compiled
def test_another_process_replays_bodies_in_contact_bit_for_bit(tmp_path):
    """From the middle of contact between bodies, warm starts and all; and it says when it does not."""
    world = heap(2)
    world.step(steps=60)
    assert len(world.contact_ends(1))
    recorder = physics.Recorder(world, keep=40)
    drive(world, 40)
    path = recorder.save(tmp_path / "heap.npz", world=1)
    done = command(str(path), "--json", str(tmp_path / "out.json"))
    assert done.returncode == 0, done.stderr
    assert "bit for bit as recorded" in done.stdout
    content = json.loads((tmp_path / "out.json").read_text())
    assert content["is_identical"]
    assert len(content["rows"]) == 40

    recording = recorder.recording(1)
    recording.states[3:] += 1.0
    done = command(str(recording.save(tmp_path / "other.npz")))
    assert done.returncode == 1
    assert "differs from step 3 on" in done.stdout
    assert command(str(tmp_path / "none.npz")).returncode == 2


def test_an_actuator_that_remembers_is_refused_and_one_that_does_not_is_replayed(tmp_path):
    def world(**what):
        block = physics.Block((1, 1, 1), 1.0)
        return physics.World(physics.Scene([block], effects=[physics.Actuator(limit_force=2.0, **what)]), dt=0.01)

    with pytest.raises(ValueError, match=r"lag=0\.1.*without lag and delay"):
        physics.Recorder(world(lag=0.1))
    some = world()
    recorder = physics.Recorder(some)
    for _ in range(3):
        some.step(np.full((1, 1, 6), 5.0))
    assert physics.Recording.load(recorder.save(tmp_path / "a.npz")).replay().is_identical
