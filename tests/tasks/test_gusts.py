"""Winds with gusts in environments: drawn by the generator of each world, anew in each episode."""

from __future__ import annotations

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from hypothesis import given
from hypothesis import strategies as st

import physics
import rigid_env
from physics.kernels.forces.wind import WIND_GUST, WIND_MEAN, WIND_PHASES, WIND_SIZE, WIND_TIME_SCALE, WIND_WAVES
from physics.kernels.state import layout as at
from physics.world.gusts import begin_gusts, gust_phases

pytestmark = pytest.mark.interpreted

GUSTY = [physics.Drag(), physics.Wind((3.0, 0.0, 1.0), gust=20.0, time_scale=0.5)]
STILL = np.zeros(6)


def course(env, seed: int | None = None, steps: int = 5) -> np.ndarray:
    """(steps, entries) observations of an episode."""
    env.reset(seed=seed)
    return np.array([env.step(STILL)[0] for _ in range(steps)])


@pytest.mark.parametrize("more", [(), (physics.Actuator(delay=0.03),)])
def test_the_same_seed_leads_to_the_same_gusts_and_another_to_others(more, is_exhaustive):
    env = rigid_env.BlockReachEnv(effects=[*GUSTY, *more], accuracy="fast")
    first, other = course(env, 1), course(env, 2)
    np.testing.assert_array_equal(course(env, 1), first)
    assert (course(env) != first).any()  # the generator goes on
    np.testing.assert_array_equal(course(rigid_env.BlockReachEnv(effects=[*GUSTY, *more], accuracy="fast"), 1), first)
    place = {"place": (0.0, 0.0), "yaw": 0.0, "face": 2, "goal": (1.0, 1.0)}
    ends = []
    for seed in (1, 2):  # the gusts differ, not only the starts
        env.reset(seed=seed, options=place)
        ends.append([env.step(STILL)[0] for _ in range(20 if is_exhaustive else 5)][-1])
    assert (ends[0] != ends[1]).any()
    assert (first != other).any()


def test_worlds_of_a_batch_go_as_single_environments_with_their_seeds():
    batch = rigid_env.BlockReachVectorEnv(3, effects=GUSTY, accuracy="fast")
    batch.reset(seed=[1, 1, 7])
    seen = np.array([batch.step(np.zeros((3, 6)))[0] for _ in range(5)])
    single = rigid_env.BlockReachEnv(effects=GUSTY, accuracy="fast")
    for world, seed in enumerate((1, 1, 7)):
        np.testing.assert_array_equal(seen[:, world], course(single, seed))


def test_a_scene_with_gusts_passes_gymnasiums_checker():
    scene = physics.Scene(
        [physics.Block((1.0, 1.0, 1.0), 2.0, pos=(0, 0.5, 0), name="crate")],
        [physics.HalfSpace((0.0, 1.0, 0.0))],
        [physics.Gravity(), physics.Contact(), physics.Friction(0.5), *GUSTY],
    )
    env = gym.make("rigid_env/Scene-v0", scene=scene, driven=[0], accuracy="fast")
    check_env(env.unwrapped)


def wind_at(world: physics.World, index: int, time: float) -> np.ndarray:
    """(3,) velocity of the air [m/s], by the formula of `physics.kernels.forces.wind`."""
    (first,) = (at.PARAM_SIZE + slot.first for slot in world.plan.fields if slot.kind is physics.Wind)
    p = world.params[index * world.body_count, first : first + WIND_SIZE]
    omega = np.tan(0.5 * np.pi * (np.arange(WIND_WAVES) + 0.5) / WIND_WAVES) / p[WIND_TIME_SCALE]
    waves = np.cos(omega * time + p[WIND_PHASES:].reshape(3, WIND_WAVES))
    return p[WIND_MEAN : WIND_MEAN + 3] + p[WIND_GUST] * np.sqrt(2.0 / WIND_WAVES) * waves.sum(axis=1)


@given(begun=st.floats(0.0, 1e3), later=st.floats(0.0, 10.0), seed=st.integers(0, 2**32 - 1))
def test_gusts_that_begin_later_are_the_same(begun, later, seed):
    """Up to the rounding of the phase: ω <= 10.2/τ, so the angle ω t <= 20.4 (1e3 + 10) = 2.1e4 at τ = 0.5 s, which
    three operations round by 2^-53 each: 7e-12. Times σ √(2/N) N = 80 m/s that is 6e-10 m/s.
    """
    scene = physics.Scene([physics.Sphere(0.5, mass=1.0), physics.Sphere(0.5, mass=1.0, pos=(3, 0, 0))], effects=GUSTY)
    world = physics.World(scene, worlds=3, dt=0.01)
    shares = np.random.default_rng(seed).random((1, gust_phases(world.plan)))
    begin_gusts(world, np.array([0]), shares)
    untouched = world.params[4:].copy()
    world.time = begun
    begin_gusts(world, np.array([1]), shares)
    np.testing.assert_allclose(wind_at(world, 1, begun + later), wind_at(world, 0, later), rtol=0.0, atol=1e-9)
    np.testing.assert_array_equal(world.params[4:], untouched)
    assert (world.params[2] == world.params[3]).all()  # both bodies of a world are in the same air


def test_worlds_that_begin_later_have_gusts_of_their_own():
    batch = rigid_env.BlockReachVectorEnv(2, effects=GUSTY, accuracy="fast", autoreset_mode="Disabled")
    batch.reset(seed=0)
    batch.step(np.zeros((2, 6)))
    world = batch.task.world
    before = world.params.copy()
    batch.reset(options={"reset_mask": np.array([False, True])})
    assert world.time > 0.0
    np.testing.assert_array_equal(world.params[0], before[0])
    assert (world.params[1] != before[1]).any()


def test_steady_wind_draws_nothing():
    plan = physics.World(physics.Scene([physics.Sphere(0.5, mass=1.0)], effects=[physics.Drag(), physics.Wind()])).plan
    assert gust_phases(plan) == 0


def test_time_goes_on_in_the_viewer(monkeypatch):
    from rigid_env.viewer.session import Session
    from rigid_env.viewer.subject import open_subject

    env = gym.make("rigid_env/BlockReach-v0", effects=GUSTY, accuracy="fast", max_episode_steps=4)
    session = Session(open_subject(env))
    session.wait()
    times = [session.time]
    for _ in range(11):
        session.step()
        times.append(session.time)
    assert (np.diff(times) > 0.0).all()
    state = session.subject.world.state.copy()
    session.seek(times[3])
    session.seek(times[-1])
    assert session.time == times[-1]
    np.testing.assert_array_equal(session.subject.world.state, state)


def test_recordings_over_starts_repeat_bit_by_bit():
    """All worlds of the batch start an episode together; later one of them starts alone."""
    batch = rigid_env.BlockReachVectorEnv(2, effects=GUSTY, accuracy="fast", autoreset_mode="Disabled")
    recorder = physics.Recorder(batch.task.world)
    for options in ({}, {"reset_mask": np.array([False, True])}, {}):
        batch.reset(seed=3, options=options)
        for _ in range(3):
            batch.step(np.zeros((2, 6)))
    for world in range(2):
        recording = recorder.recording(world)
        assert len(recording) == 9
        assert recording.replay().is_identical
