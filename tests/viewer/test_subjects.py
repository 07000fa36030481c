"""Subjects: whatever can be opened, what it shows, and errors about the rest."""

from __future__ import annotations

from pathlib import Path

import gymnasium as gym
import numpy as np
import pytest

import physics
import rigid_env
from physics import scenes
from rigid_env.envs.policy_files import Network
from rigid_env.rendering.picture import world_frame
from rigid_env.viewer.subject import open_subject
from tests.tasks.conftest import Slide
from tests.viewer.conftest import session_of, state_of, take

EXAMPLES = Path(__file__).parents[2] / "examples"


def same(frame, other) -> None:
    """Frames with the same bodies and walls."""
    for one, two in zip(frame.bodies, other.bodies, strict=True):
        assert one.kind == two.kind
        for name in ("pos", "quat", "dimensions", "corners"):
            assert getattr(one, name) == pytest.approx(getattr(two, name), abs=1e-12)
        assert len(one.faces) == len(two.faces)
    for one, two in zip(frame.walls, other.walls, strict=True):
        assert one.normal == pytest.approx(two.normal)
        assert one.offset == two.offset


def test_names_and_scene_files(tmp_path):
    path = tmp_path / "box.toml"
    physics.save_scene(scenes.drop(), path)
    for what in ("drop", path, str(path), scenes.drop()):
        subject = open_subject(what, accuracy="fast", dt=0.02)
        assert (subject.accuracy, subject.interval, subject.time) == ("fast", 0.02, 0.0)
        same(subject.frame(), world_frame(physics.World(scenes.drop())))
    assert open_subject(path).name == "box"


def test_a_subject_knows_its_scene_whose_fields_are_drawn(fallen):
    assert open_subject("drop").scene.walls == scenes.drop().walls
    assert open_subject("rigid_env/BlockReach-v0").scene.effects
    assert open_subject(fallen).scene is fallen.scene


def test_a_world_goes_on_in_a_copy_bit_for_bit():
    """The first of a batch; the batch stays as it is."""
    world = physics.World(scenes.drop(), worlds=3, dt=0.005, accuracy="fast")
    world.set_parameters(friction=[0.1, 0.2, 0.3])
    world.step(steps=220)
    before = world.state.copy()
    session = session_of(world)
    assert session.time == world.time
    assert session.settings["friction"] == 0.1
    take(session, 50)
    assert np.array_equal(world.state, before)
    world.step(steps=50)
    assert np.array_equal(state_of(session), world.state[:1])


def test_an_environment_goes_on_in_a_copy_bit_for_bit():
    """With its wrappers, in the middle of its episode."""
    env = gym.make("rigid_env/BlockReach-v0")
    env.reset(seed=2)
    for _ in range(5):
        env.step(np.full(6, 0.5, np.float32))
    before = env.unwrapped.task.world.state.copy()
    session = session_of(env, policy=lambda observations: np.full((1, 6), 0.5))
    take(session, 10)
    assert np.array_equal(env.unwrapped.task.world.state, before)
    for _ in range(10):
        env.step(np.full(6, 0.5, np.float32))
    assert np.array_equal(state_of(session), env.unwrapped.task.world.state)


def test_a_task_of_one_s_own_gets_sliders_that_it_does_not_declare():
    env = rigid_env.TaskEnv(Slide)
    session = session_of(env)
    assert session.settings == {"gravity": 9.81, "friction": 0.0, "restitution": 0.0}
    session.set_friction(0.3)
    with pytest.raises(ValueError, match=r"gravity is -1.0; allowed are numbers of at least 0"):
        session.set_gravity(-1.0)
    assert session.settings == {"gravity": 9.81, "friction": 0.3, "restitution": 0.0}
    take(session, 5)
    assert session.subject.frame().goal is None
    assert env.task.world.time == 0.0


def test_the_controller_reaches_the_goal_and_an_episode_follows():
    session = session_of("rigid_env/BlockReach-v0", controller=True)
    take(session, 250)
    assert session.subject.message.startswith("episode 2")


def test_a_policy_of_plain_arrays_acts(tmp_path):
    """Also where observations have parts, which follow each other in the order of their names."""
    rng = np.random.default_rng(0)
    for env_id, size in (("rigid_env/BlockReach-v0", 24), ("rigid_env/BlockReachGoal-v0", None)):
        env = gym.make(env_id)
        size = size or sum(space.shape[0] for space in env.observation_space.values())
        network = Network([(rng.normal(size=(size, 6)), np.zeros(6))])
        session = session_of(env_id, policy=network.save(tmp_path / "policy.npz"), seed=4)
        take(session, 3)
        observation, _ = env.reset(seed=4)
        for _ in range(3):
            parts = {k: v[None] for k, v in observation.items()} if isinstance(observation, dict) else observation[None]
            observation, *_ = env.step(network(parts)[0])
        assert np.array_equal(state_of(session), env.unwrapped.task.world.state)


def test_a_recording_is_played_bit_for_bit(tmp_path):
    """Changes from outside and all; then it is over. The user cannot act in it."""
    world = physics.World(scenes.shove(), dt=0.005)
    recorder = physics.Recorder(world)
    for k in range(40):
        if k in (11, 12):
            world.set_state(linvel=(0.5, 0.0, 0.1 * k))
        world.step(np.arange(6.0) + k, steps=1 + k % 2)
    path = recorder.save(tmp_path / "run.npz", reason="a test")
    session = session_of(path)
    assert session.span == (0.0, pytest.approx(world.time))
    assert "a test" in session.message
    states = []
    while session.step():
        states.append(state_of(session))
    assert session.message == "the end"
    assert np.array_equal(states, recorder.recording().states)
    session.seek(session.samples.time[15])
    assert np.array_equal(state_of(session), states[14])
    with pytest.raises(ValueError, match="drag does not act on run; allowed controls are ghost"):
        session.kick(0, (1, 0, 0))
    for call in (lambda: session.set_gravity(1.0), lambda: session.set_accuracy("fast")):
        with pytest.raises(ValueError, match="allowed controls are ghost"):
            call()


@pytest.fixture(scope="module")
def fallen():
    return physics.simulate(scenes.drop(), 1.2)


def test_a_trajectory_is_played_to_its_end(fallen, tmp_path):
    fallen.to_npz(tmp_path / "fall.npz")
    for what in (fallen, tmp_path / "fall.npz"):
        session = session_of(what)
        assert not session.is_compiling
        session.seek(0.5)
        assert session.time == pytest.approx(0.5)
        assert session.look().frame.bodies[0].pos == pytest.approx(fallen.pos[50, 0])
        session.play()
        for _ in range(20):
            session.advance(0.1)
        assert (session.is_playing, session.message) == (False, "the end")
        assert len(session.samples) == len(fallen.t)
        assert session.samples.energy == pytest.approx(fallen.energy.sum(axis=1))
        assert session.events == sorted(fallen.events, key=lambda event: event.t)
        session.seek(0.0)
        assert session.time == 0.0
        with pytest.raises(ValueError, match="allowed controls are none"):
            session.set_ghost(True)
    known = session_of("drop")
    take(known, 120)
    for name in ("kinetic_energy", "potential_energy", "momentum"):
        assert getattr(session.samples, name) == pytest.approx(getattr(known.samples, name), abs=1e-9)


def test_a_task_of_ones_own_in_the_working_folder_is_found(tmp_path, monkeypatch):
    (tmp_path / "mine_to_view.py").write_text((EXAMPLES / "two_blocks.py").read_text())
    monkeypatch.chdir(tmp_path)
    subject = open_subject("mine_to_view:TwoBlocks", accuracy="fast")
    subject.step()
    assert len(subject.scene.bodies) == 2


@pytest.mark.parametrize(
    ("what", "arguments", "told"),
    [
        ("dorp", {}, r"what is 'dorp'; allowed are a canonical scene.*such as drop"),
        (3, {}, r"what is 3; allowed are a canonical scene"),
        ("none.toml", {}, r"'none.toml', which does not exist; allowed"),
        ("rigid_env/Scene-v0", {}, r"needs a scene; allowed"),
        ("nothing:here-v0", {}, r"what is 'nothing:here-v0', which is not there"),
        ("nothing.npz", {}, r"what is 'nothing.npz', a file that does not exist; allowed"),
        ("CartPole-v1", {}, r"what is 'CartPole-v1'; allowed"),
        ("drop", {"accuracy": "exact"}, r"accuracy is 'exact'; allowed"),
        ("drop", {"dt": 0.0}, r"dt is 0.0; allowed"),
        ("drop", {"seed": -1}, r"seed is -1; allowed"),
        ("drop", {"policy": "x.zip"}, r"policy is 'x.zip', but drop is no environment; allowed is None"),
        ("drop", {"controller": True}, r"controller is True, but drop is no environment; allowed is None"),
        ("rigid_env/BlockReach-v0", {"dt": 0.1}, r"dt is 0.1, but BlockReach-v0 has control steps of its own"),
        ("rigid_env/BlockReach-v0", {"policy": "none.zip"}, r"policy is 'none.zip', which is no file; allowed"),
        ("rigid_env/BlockReach-v0", {"policy": 3}, r"policy is 3; allowed"),
        ("rigid_env/BlockReachGoal-v0", {"controller": True}, r"controller is True with BlockReachGoal; allowed is"),
    ],
)
def test_the_rest_is_refused_with_what_is_allowed(what, arguments, told):
    with pytest.raises(ValueError, match=told):
        open_subject(what, **arguments)


def test_files_that_are_neither_and_known_courses_are_refused(fallen, tmp_path):
    (tmp_path / "text.npz").write_text("no archive")
    np.savez(tmp_path / "other.npz", x=np.zeros(3))
    for name, told in (("text.npz", "which is no archive"), ("other.npz", "neither a recording nor a trajectory")):
        with pytest.raises(ValueError, match=f"{told}; allowed"):
            open_subject(tmp_path / name)
    with pytest.raises(ValueError, match="accuracy is 'fast', but Trajectory is no longer simulated at will"):
        open_subject(fallen, accuracy="fast")
    peers = physics.Trajectory(fallen.t, fallen.pos, fallen.quat, fallen.linvel, fallen.angvel, fallen.energy, (), ())
    with pytest.raises(ValueError, match=r"holds no scene.*allowed"):
        open_subject(peers)
