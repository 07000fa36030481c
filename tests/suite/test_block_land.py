"""BlockLand: the budget, the hardest blow, and the ends of an episode."""

from __future__ import annotations

import gymnasium as gym
import numpy as np
import pytest

import rigid_env  # noqa: F401 (registers)
from rigid_env.suite.block_land import BUDGET, FLAT, HALF, THRUST, TWIST, Attitude, G, controller
from rigid_env.suite.faces import target_axes

ENV = "rigid_env/BlockLand-v0"
STEP = 0.05 * (THRUST + TWIST)  # what a control step of full thrust and twist takes [m g s]
FLAT_DROP = {"attitude": (1.0, 0.0, 0.0, 0.0), "linvel": (0.0, 0.0, 0.0), "angvel": (0.0, 0.0, 0.0), "target_face": 2}


def make(**options):
    env = gym.make(ENV)
    env.reset(seed=0, options={**FLAT_DROP, **options})
    return env


def test_full_thrust_lasts_as_long_as_the_budget():
    env = make(height=9.0)
    action, steps = np.array([0.0, 1.0, 0.0, 0.0, 0.0, 1.0]), 0
    while np.any(env.unwrapped.task.limits):
        left = env.step(action)[4]["left"]
        steps += 1
        assert left == pytest.approx(BUDGET - steps * STEP, abs=1e-12)
    assert 0.0 <= left < STEP
    assert env.step(action)[4]["left"] == pytest.approx(left, abs=1e-12)
    assert np.all(env.unwrapped.task.wrench == 0.0)


def test_thrust_costs_by_its_length():
    """Half the force for one step, along any direction: 0.5 · 2 · 0.05 m g s; torque: 0.5 · 1 · 0.05."""
    for action, cost in (([0.3, 0.4, 0.0, 0, 0, 0], 0.05), ([0, 0, 0, 0.3, 0.0, 0.4], 0.025), ([2.0] * 6, STEP)):
        info = make(height=9.0).step(np.array(action, dtype=float))[4]
        assert info["left"] == pytest.approx(BUDGET - cost, abs=1e-12)


def test_the_peak_of_a_flat_fall_is_its_closed_form():
    """All points of a face at one speed v = sqrt(2 g h): one impact of (1 + e) m v. Physics steps of 5 ms cut the time
    of impact to the tolerance of the contacts, 1e-3 of v at most; the bounce of e v falls again, more softly."""
    drop, restitution = 6.0, 0.2
    env = make(height=HALF[1] + drop)
    peaks = [env.step(np.zeros(6))[4]["peak"] for _ in range(60)]
    assert peaks[-1] == pytest.approx((1.0 + restitution) * np.sqrt(2.0 * G * drop) / G, rel=2e-3)
    assert np.all(np.diff(peaks) >= 0.0)


def test_a_flat_fall_on_the_target_face_is_a_success_and_its_peak_is_paid_for():
    env = make(height=HALF[1] + 1.0)
    ended, paid = False, 0.0
    while not ended:
        _, _, ended, truncated, info = env.step(np.zeros(6))
        paid += info["reward_peak"]
        assert not truncated
    assert info["is_success"]
    assert info["angle"] <= FLAT
    assert paid == pytest.approx(-2.0 * info["peak"], abs=1e-12)


def test_hovering_with_the_face_down_is_no_success():
    """A block held in the air, upright and at rest, until its budget is gone."""
    env = make(height=9.0)
    hover, steps = np.array([0.0, 1.0 / THRUST, 0.0, 0.0, 0.0, 0.0]), int(0.9 * BUDGET / 0.05)
    for _ in range(steps):
        _, _, terminated, _, info = env.step(hover)
        assert not terminated
    assert info["speed"] < 1e-6
    assert info["angle"] < 1e-6


def test_rest_on_another_face_fails_once_the_budget_is_spent():
    env = make(height=HALF[1] + 0.01, target_face=0)
    waste, ended = np.array([0.0, -1.0, 0.0, 0.0, 0.0, 0.0]), False
    while not ended:
        _, _, ended, truncated, info = env.step(waste)
        assert not truncated
    assert not info["is_success"]
    assert info["left"] < STEP
    idle = make(height=HALF[1] + 0.01, target_face=0)
    assert not any(idle.step(np.zeros(6))[2] for _ in range(60))  # with a budget it may still tip over


def test_the_controller_lands_softly():
    """Hardest blows of 32 throws: on average less than half of those of a free fall."""
    peaks = []
    for policy in (lambda seen: np.zeros((len(seen), 6)), controller):
        envs = gym.make_vec(ENV, num_envs=32, autoreset_mode="SameStep")
        seen, _ = envs.reset(seed=0)
        peak, is_over = np.zeros(32), np.zeros(32, dtype=bool)
        for _ in range(60):
            seen, _, terminated, _, infos = envs.step(policy(seen))
            is_over |= terminated
            peak = np.where(is_over, peak, infos["peak"])
        peaks.append(peak.mean())
    assert peaks[1] < 0.5 * peaks[0]


def test_attitudes_are_uniform_rotations():
    """Each entry of a uniform rotation has mean 0 and variance 1/3; 5 standard errors of 20,000 draws."""
    count = 20_000
    quat = Attitude().at(np.random.default_rng(0).random((count, 3)), {})
    np.testing.assert_allclose(np.linalg.norm(quat, axis=1), 1.0, rtol=1e-12)
    w, x, y, z = quat.T
    heights = np.stack([2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)])
    assert np.all(np.abs(heights.mean(axis=1)) < 5 * np.sqrt(1 / 3 / count))
    # the variance of a squared entry is 1/5 - 1/9
    assert np.all(np.abs((heights**2).mean(axis=1) - 1 / 3) < 5 * np.sqrt((1 / 5 - 1 / 9) / count))


def test_target_axes_begin_with_the_outward_normal():
    rotation = np.linalg.qr(np.random.default_rng(0).normal(size=(3, 3)))[0]
    found = target_axes(np.stack([rotation] * 6), np.arange(6.0))
    for face in range(6):
        assert np.array_equal(found[face, 0], rotation[:, face // 2] * (1 if face % 2 else -1))
        assert np.array_equal(found[face, 1], rotation[:, (face // 2 + 1) % 3])
        assert np.array_equal(found[face, 2], rotation[:, (face // 2 + 2) % 3])
