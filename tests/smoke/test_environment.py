"""One environment, as Gymnasium's own checker and a user step it."""

from __future__ import annotations

import gymnasium as gym
import numpy as np
from gymnasium.utils.env_checker import check_env

ID = "rigid_env:rigid_env/BlockReach-v0"


def test_gymnasium_finds_nothing_wrong():
    check_env(gym.make(ID).unwrapped, skip_render_check=True)


def test_an_episode_goes_on_and_is_the_same_for_the_same_seed():
    def episode():
        env = gym.make(ID)
        observation, _ = env.reset(seed=3)
        env.action_space.seed(3)
        seen = [observation]
        for _ in range(50):
            observation, reward, terminated, truncated, _ = env.step(env.action_space.sample())
            assert np.isfinite(observation).all()
            assert np.isfinite(reward)
            seen.append(observation)
            if terminated or truncated:
                break
        return np.array(seen)

    first = episode()
    assert np.abs(np.diff(first, axis=0)).max() > 0.0
    np.testing.assert_array_equal(first, episode())


def test_a_batch_steps_as_many_environments_as_were_asked_for():
    envs = gym.make_vec(ID, num_envs=8)
    observation, _ = envs.reset(seed=0)
    assert observation.shape[0] == 8
    _, reward, *_ = envs.step(envs.action_space.sample())
    assert reward.shape == (8,)
