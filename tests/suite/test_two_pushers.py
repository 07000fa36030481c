"""TwoPushers: two agents of half the strength are one of BlockReach."""

from __future__ import annotations

import gymnasium as gym
import numpy as np
import pytest

import rigid_env  # noqa: F401 (registers)
from rigid_env.envs.parallel import Parallel
from rigid_env.envs.task import TaskEnv
from rigid_env.suite.two_pushers import TwoPushers

TWO, ONE = "rigid_env/TwoPushers-v0", "rigid_env/BlockReach-v0"


def test_two_agents_of_half_the_strength_move_the_block_as_one():
    """Halves add up without rounding, so that states agree to the last bit."""
    one, two = gym.make(ONE), gym.make(TWO)
    first, second = one.reset(seed=3)[0], two.reset(seed=3)[0]
    rng = np.random.default_rng(0)
    for _ in range(20):
        np.testing.assert_array_equal(first, second)
        action = rng.uniform(-1, 1, 6)
        first, second = one.step(action)[0], two.step(np.tile(action, 2))[0]


def test_agents_against_each_other_leave_the_block_where_it_is():
    env = gym.make(TWO)
    env.reset(seed=1)
    start = env.unwrapped.task.world.pos[0, 0].copy()
    for _ in range(10):
        env.step(np.concatenate([np.full(6, 0.7), np.full(6, -0.7)]))
    np.testing.assert_allclose(env.unwrapped.task.world.pos[0, 0], start, atol=1e-6)  # slop of a block at rest


def test_both_agents_see_all_and_share_the_reward():
    env = Parallel(TaskEnv(TwoPushers), 300)
    found, _ = env.reset(seed=0)
    np.testing.assert_array_equal(found["left"], found["right"])
    _, rewards, *_ = env.step({agent: np.ones(6) for agent in env.possible_agents})
    assert rewards["left"] == rewards["right"] != 0.0


def test_one_agent_alone_cannot_slide_the_block():
    """Its force of 0.45 m g is less than the friction of 0.5 m g."""
    env = gym.make(TWO)
    env.reset(seed=0, options={"face": 2})
    start = env.unwrapped.task.world.pos[0, 0].copy()
    action = np.zeros(12)
    action[0] = 1.0
    for _ in range(40):
        env.step(action)
    assert np.linalg.norm(env.unwrapped.task.world.pos[0, 0] - start) < 1e-3


@pytest.mark.exhaustive
def test_pettingzoo_takes_its_id():
    pytest.importorskip("pettingzoo")
    from pettingzoo.test import parallel_api_test, parallel_seed_test

    from rigid_env.envs.pettingzoo import parallel_env

    parallel_api_test(parallel_env(TWO), num_cycles=100)
    parallel_seed_test(lambda: parallel_env(TWO), num_cycles=50)
