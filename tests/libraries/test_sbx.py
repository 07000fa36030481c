"""Stable-Baselines Jax (sbx) takes `RigidVecEnv` as Stable-Baselines3 does."""

from __future__ import annotations

import numpy as np
import pytest

from tests.libraries.transitions import SEED, batch, replay, time_outs

pytestmark = pytest.mark.exhaustive

STEPS = 32


@pytest.fixture
def sbx():
    return pytest.importorskip("sbx")


def test_ppo_bootstraps_from_the_last_observation(sbx):
    from rigid_env import RigidVecEnv

    model = sbx.PPO("MlpPolicy", RigidVecEnv(batch("SameStep")), n_steps=STEPS, batch_size=64, seed=SEED)
    _, callback = model._setup_learn(STEPS)
    model.collect_rollouts(model.env, callback, model.rollout_buffer, STEPS)
    stored = model.rollout_buffer
    done = replay(stored.actions)
    np.testing.assert_array_equal(stored.observations, done.obs)
    ended = done.terminated | done.truncated
    np.testing.assert_array_equal(stored.episode_starts[1:] > 0, ended[:-1])
    flat = done.next_obs.reshape(ended.size, -1)
    value = np.array(model.vf.apply(model.policy.vf_state.params, flat)).reshape(ended.shape)
    bootstrap = model.gamma * value * time_outs(done)
    np.testing.assert_allclose(stored.rewards, done.rewards + bootstrap, rtol=0, atol=1e-5)
    assert np.abs(value[time_outs(done)]).min() > 1e-4


@pytest.mark.parametrize("name", ["SAC", "TQC", "CrossQ"])
def test_replay_buffers_hold_the_last_observation(sbx, name):
    from rigid_env import RigidVecEnv

    env = RigidVecEnv(batch("SameStep"))
    model = getattr(sbx, name)("MlpPolicy", env, learning_starts=64, buffer_size=400, batch_size=32, seed=SEED)
    model.learn(100)
    stored, count = model.replay_buffer, model.replay_buffer.pos
    done = replay(stored.actions[:count])
    np.testing.assert_array_equal(stored.observations[:count], done.obs)
    np.testing.assert_array_equal(stored.next_observations[:count], done.next_obs)
    np.testing.assert_array_equal(stored.rewards[:count], np.float32(done.rewards))
    np.testing.assert_array_equal(stored.timeouts[:count] > 0, time_outs(done))
    np.testing.assert_array_equal(stored.dones[:count] > 0, done.terminated | done.truncated)
