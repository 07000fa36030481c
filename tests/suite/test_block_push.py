"""BlockPush: pushes of two bodies against friction in closed form, its success, and its starts."""

from __future__ import annotations

import gymnasium as gym
import numpy as np
import pytest

import rigid_env  # noqa: F401 (registers)
from rigid_env.suite.block_push import (
    AHEAD,
    CRATE,
    EDGE,
    FORCE,
    HOLD_STEPS,
    LOST,
    NEAR,
    PUSHER,
    PUSHER_MASS,
    PUSHER_SIZE,
    TOUCHING,
    G,
)

ENV = "rigid_env/BlockPush-v0"


def placed(crate, heading=0.0, pusher=(-3.0, 0.0), yaw=0.0, tilt=0.0, **options):
    """A batch of worlds in which crate and pusher stand at these places x, z, turned by these angles about y."""
    worlds = np.broadcast_shapes(np.shape(heading), np.shape(np.asarray(crate)[..., 0]), np.shape(tilt), (1,))[0]
    envs = gym.make_vec(ENV, num_envs=worlds)
    envs.reset(seed=0, options={"mass[1]": 8.0, "friction": 0.4, **options})
    task = envs.unwrapped.task
    pos, quat = np.zeros((worlds, 2, 3)), np.zeros((worlds, 2, 4))
    pos[:, CRATE, ::2], pos[:, PUSHER, ::2] = crate, pusher
    pos[:, :, 1] = 0.5 * PUSHER_SIZE[1], 0.5 * EDGE
    quat[:, PUSHER, 0], quat[:, PUSHER, 2] = np.cos(0.5 * yaw), np.sin(0.5 * yaw)
    quat[:, CRATE, 0], quat[:, CRATE, 2] = np.cos(0.5 * np.asarray(heading)), np.sin(0.5 * np.asarray(heading))
    if np.any(tilt):
        quat[:, CRATE] = 0.0
        quat[:, CRATE, 0], quat[:, CRATE, 3] = np.cos(0.5 * np.asarray(tilt)), np.sin(0.5 * np.asarray(tilt))
        pos[:, CRATE, 1] = 2.0  # in the air
    task.world.set_state(pos=pos, quat=quat)
    return envs, task


@pytest.mark.parametrize(("mass", "friction"), [(4.0, 0.3), (10.0, 0.5)])
def test_both_slide_as_one_under_a_push(mass, friction):
    """Newton: a = F/(M + m) - mu g, with F = 0.9 M g. The tolerance of the solver is 1e-6 g dt in each step of 10 ms.

    After 1 s that is 1e-5 m/s.
    """
    envs, task = placed((0.0, 0.0), pusher=(-TOUCHING, 0.0), **{"mass[1]": mass, "friction": friction})
    acceleration = FORCE * PUSHER_MASS * G / (PUSHER_MASS + mass) - friction * G
    for _ in range(20):
        envs.step(np.array([[1.0, 0.0, 0.0]]))
    np.testing.assert_allclose(task.world.linvel[0, :, 0], acceleration * 20 * task.control_dt, rtol=0, atol=1e-5)
    np.testing.assert_allclose(task.world.linvel[0, :, 1:], 0.0, rtol=0, atol=1e-5)


def test_it_can_push_the_heaviest_crate_and_cannot_pull_the_lightest():
    envs, task = placed((1.0, 0.0), pusher=(1.0 - TOUCHING, 0.0), **{"mass[1]": 4.0, "friction": 0.5})
    for _ in range(20):
        envs.step(np.array([[-1.0, 0.0, 0.0]]))
    assert task.world.pos[0, PUSHER, 0] < -TOUCHING - 0.5
    assert abs(task.world.pos[0, CRATE, 0] - 1.0) < 1e-6
    assert FORCE * PUSHER_MASS > 0.5 * (PUSHER_MASS + 10.0)


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_a_push_beside_the_centre_turns_it(side):
    """A push along x at z > 0 has the torque z x X F, which is along +y: it turns to the left."""
    envs, task = placed((0.0, 0.0), pusher=(-TOUCHING, 0.7 * side))
    for _ in range(12):
        envs.step(np.array([[1.0, 0.0, 0.0]]))
    heading = 2.0 * np.arctan2(task.world.quat[0, CRATE, 2], task.world.quat[0, CRATE, 0])
    assert side * heading > 0.1
    assert task.world.pos[0, CRATE, 0] > 0.1


def test_force_and_torque_act_in_the_pushers_frame():
    """Turned to the left by a right angle, ahead is -z. The acceleration is (0.9 - 0.4) g."""
    envs, task = placed((3.0, 0.0), pusher=(0.0, 0.0), yaw=np.pi / 2)
    envs.step(np.array([[1.0, 0.0, 0.0]]))
    expected = (0.0, 0.0, -(FORCE - 0.4) * G * task.control_dt)
    np.testing.assert_allclose(task.world.linvel[0, PUSHER], expected, rtol=0, atol=1e-6)


def test_success_needs_place_and_heading_for_ten_steps():
    """The third crate looks as if it were right: it is a quarter turn off."""
    crates = np.array([(0.0, 0.99 * NEAR), (0.0, 1.01 * NEAR), (0.0, 0.0), (0.0, 0.0), (0.0, 0.0)])
    headings = np.array([0.99 * AHEAD, 0.0, np.pi / 2, 1.01 * AHEAD, -0.99 * AHEAD])
    envs, _ = placed(crates, headings)
    for step in range(1, HOLD_STEPS + 1):
        _, _, terminated, _, infos = envs.step(np.zeros((5, 3)))
        expected = np.array([True, False, False, False, True]) & (step == HOLD_STEPS)
        assert terminated.tolist() == expected.tolist()
    assert infos["is_success"].tolist() == expected.tolist()
    np.testing.assert_allclose(infos["heading_error"], np.abs(headings), rtol=0, atol=1e-6)


def test_a_lost_or_tipped_crate_is_a_failure():
    envs, _ = placed([(LOST - 0.1, 0.0), (LOST + 0.1, 0.0)])
    assert envs.step(np.zeros((2, 3)))[2].tolist() == [False, True]
    envs, _ = placed([(0.0, 0.0), (0.0, 0.0)], tilt=np.array([0.6, 0.7]))
    assert envs.step(np.zeros((2, 3)))[2].tolist() == [False, True]


def test_progress_adds_up_and_no_cycle_pays():
    """The sum telescopes. Rounding: 1e-16 of some units in 60 steps."""
    env = gym.make(ENV)
    env.reset(seed=0)
    task, total = env.unwrapped.task, 0.0
    start = float(task.memory_arrays["potential"][0])
    for step in range(60):
        info = env.step(np.array([1.0, 0.3, 0.2]) * (1 if step % 30 < 15 else -1))[4]
        total += info["reward_progress"]
    assert total == pytest.approx(float(task.memory_arrays["potential"][0]) - start, abs=1e-12)


def test_observations_are_those_of_a_plane_seen_by_the_pusher():
    """Vectors along the pusher's x axis and its negative z axis, which are ahead and to the left."""
    envs = gym.make_vec(ENV, num_envs=16)
    envs.reset(seed=3)
    rng = np.random.default_rng(0)
    for _ in range(15):
        observations = envs.step(rng.uniform(-1, 1, (16, 3)))[0]
    world = envs.unwrapped.task.world
    for k in range(16):
        w, _, y, _ = world.quat[k, PUSHER]
        axes = np.array([(1 - 2 * y * y, 0.0, -2 * w * y), (-2 * w * y, 0.0, -(1 - 2 * y * y))])
        crate, pusher = world.pos[k, CRATE], world.pos[k, PUSHER]
        expected = [axes @ (crate - pusher) / 2.0, axes @ -crate / 2.0]
        expected += [axes @ world.linvel[k, PUSHER], axes @ world.linvel[k, CRATE]]
        np.testing.assert_allclose(observations[k, [0, 1, 2, 3, 10, 11, 12, 13]], np.concatenate(expected), atol=1e-5)


def test_starts_stand_apart():
    """Half diagonals of both add up to 0.71 + 0.56 m, below the least distance of 1.3 m: nothing moves."""
    envs = gym.make_vec(ENV, num_envs=256)
    _, infos = envs.reset(seed=0)
    world = envs.unwrapped.task.world
    before = world.pos.copy()
    np.testing.assert_allclose(np.hypot(before[:, CRATE, 0], before[:, CRATE, 2]), infos["away"])
    between = before[:, CRATE] - before[:, PUSHER]
    np.testing.assert_allclose(np.hypot(between[:, 0], between[:, 2]), infos["apart"])
    assert infos["apart"].min() > 0.5 * np.sqrt(2.0) * EDGE + 0.5 * np.hypot(*PUSHER_SIZE[::2])
    envs.step(np.zeros((256, 3)))
    np.testing.assert_allclose(world.pos, before, rtol=0, atol=1e-6)
