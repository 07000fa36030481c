"""BlockPose: the wanted pose, its errors in closed form, and success, which needs all three of them."""

from __future__ import annotations

import gymnasium as gym
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import rigid_env  # noqa: F401 (registers)
from rigid_env.suite.block_pose import AHEAD, HOLD_STEPS, NEAR

ENV = "rigid_env/BlockPose-v0"
POSE = {"place": (1.0, -2.0), "yaw": 0.4, "face": 4}
GOAL = {"goal": (1.0, -2.0), "heading": 0.4, "target_face": 4}  # the face is up to the options, not to the draw


def start(**options):
    env = gym.make(ENV)
    _, info = env.reset(seed=0, options={**POSE, **GOAL, **options})
    return env, info


@pytest.mark.parametrize("face", range(6))
def test_a_start_in_the_wanted_pose_has_no_errors(face):
    _, info = start(face=face, target_face=face)
    assert info["distance"] == 0.0
    # arccos near 1 and the quaternion's normalisation: square root of some 1e-16
    for error in ("tilt", "heading_error", "turn"):
        assert info[error] == pytest.approx(0.0, abs=1e-7)


def test_errors_are_those_of_the_pose():
    _, info = start(goal=(4.0, 2.0), heading=0.4 + 1.25)
    assert info["distance"] == pytest.approx(5.0, abs=1e-12)
    assert info["tilt"] == pytest.approx(0.0, abs=1e-7)
    assert info["heading_error"] == pytest.approx(1.25, abs=1e-12)
    assert info["turn"] == pytest.approx(1.25, abs=1e-12)
    _, info = start(target_face=5)
    assert info["tilt"] == pytest.approx(np.pi, abs=1e-7)


def test_the_turn_that_is_left_leads_to_the_wanted_attitude():
    """Independently by SciPy: the observed axis times angle, before the attitude, is a start in the wanted pose."""
    rng = np.random.default_rng(0)
    for _ in range(20):
        face, target = rng.permutation(6)[:2]
        yaw, heading = rng.uniform(0.0, 2.0 * np.pi, 2)
        env, _ = start(face=face, yaw=yaw, target_face=target, heading=heading)
        left = Rotation.from_rotvec(np.pi * env.unwrapped.task.obs[0, 4:7].astype(float))
        now = Rotation.from_quat(np.roll(env.unwrapped.task.world.quat[0, 0], -1))
        goal, _ = start(face=target, yaw=heading)
        wanted = Rotation.from_quat(np.roll(goal.unwrapped.task.world.quat[0, 0], -1))
        # float32 of numbers up to 1, times pi: 2e-7
        assert (wanted.inv() * left * now).magnitude() < 1e-6


def test_a_block_that_lies_in_the_pose_succeeds_after_the_hold():
    env, _ = start()
    ends = [env.step(np.zeros(6))[2] for _ in range(HOLD_STEPS)]
    assert ends == [False] * (HOLD_STEPS - 1) + [True]


@pytest.mark.parametrize(
    "off",
    [{"goal": (1.0 + 1.1 * NEAR, -2.0)}, {"heading": 0.4 + 1.1 * AHEAD}, {"heading": 0.4 + np.pi}, {"target_face": 5}],
)
def test_each_error_alone_prevents_success(off):
    env, _ = start(**off)
    for _ in range(3 * HOLD_STEPS):
        _, _, terminated, _, info = env.step(np.zeros(6))
        assert not terminated
        assert not info["is_success"]


def test_the_goal_is_another_face_and_the_layouts_hold_it():
    for walls in ("three", "corner"):
        envs = gym.make_vec(ENV, num_envs=64, walls=walls)
        _, info = envs.reset(seed=0)
        assert np.all(info["target_face"] != info["face"])
        low, high = ((0.0, 20.0), (-10.0, 10.0))[walls == "three"]
        assert np.all((info["goal"] > low) & (info["goal"] < high))


def test_the_reward_of_an_episode_is_the_gain_of_its_potential():
    """No way back and forth earns anything: progress adds up to the difference of two states."""
    env, info = start(goal=(3.0, 0.0), heading=1.4)
    first, total = worth(info), 0.0
    rng = np.random.default_rng(0)
    for _ in range(40):
        info = env.step(rng.uniform(-1.0, 1.0, 6))[4]
        total += info["reward_progress"]
    last = worth(info)
    assert total == pytest.approx(last - first, abs=1e-9)


def worth(info) -> float:
    """Potential of a state without a hold, as the docstring has it."""
    d, a, b = (info[name] for name in ("distance", "turn", "tilt"))
    errors = d / 4 + a + b + 0.5 * np.tanh(2 * d) + 0.5 * np.tanh(a / 0.3)
    return -errors - 0.1 * (info["speed"] + info["spin"]) * np.exp(-(d + a + b))


def test_the_controller_works_in_the_corner():
    from rigid_env.suite.block_pose import controller

    envs = gym.make_vec(ENV, num_envs=16, walls="corner", autoreset_mode="SameStep")
    seen, _ = envs.reset(seed=0)
    succeeded = np.zeros(16, dtype=bool)
    for _ in range(150):
        seen, _, terminated, *_ = envs.step(controller(seen))
        succeeded |= terminated
    assert succeeded.sum() >= 15
