"""Transitions that `examples/tianshou_reach.py` stores are those of the bare batch, with a value after a limit only."""

from __future__ import annotations

import numpy as np
import pytest

from tests.libraries.transitions import SEED, WORLDS, batch, replay, time_outs

pytestmark = pytest.mark.exhaustive

STEPS = 32


@pytest.fixture
def example():
    pytest.importorskip("tianshou")
    import tianshou_reach

    return tianshou_reach


def test_stored_transitions_are_those_of_the_batch(example):
    import torch
    from tianshou.data import Collector, VectorReplayBuffer

    torch.manual_seed(SEED)
    envs = example.TianshouEnvs(batch("Disabled"))
    algorithm = example.make_ppo(envs)
    collector = Collector(algorithm, envs, VectorReplayBuffer(STEPS * WORLDS, WORLDS))
    collector.reset(gym_reset_kwargs={"seed": SEED})
    collector.collect(n_step=STEPS * WORLDS)
    steps, indices = collector.buffer.sample(0)  # world by world

    def rows(values):
        return np.asarray(values).reshape(WORLDS, STEPS, *np.shape(values)[1:]).swapaxes(0, 1)

    done = replay(algorithm.policy.map_action(rows(steps.act)))  # it rounds, too
    np.testing.assert_array_equal(rows(steps.obs), done.obs)
    np.testing.assert_array_equal(rows(steps.rew), done.rewards)
    np.testing.assert_array_equal(rows(steps.obs_next), done.next_obs)
    np.testing.assert_array_equal(rows(steps.terminated), done.terminated)
    np.testing.assert_array_equal(rows(steps.truncated), done.truncated)
    with torch.no_grad():
        value = algorithm.critic(done.next_obs.reshape(STEPS * WORLDS, -1)).numpy().reshape(STEPS, WORLDS)
    returns = rows(algorithm._preprocess_batch(steps, collector.buffer, indices).returns)
    expected = done.rewards + algorithm.gamma * value * time_outs(done)  # of the last step of an episode
    ended = done.terminated | done.truncated
    np.testing.assert_allclose(returns[ended], expected[ended], rtol=0, atol=1e-6)
    assert np.abs(value[ended]).min() > 1e-6


def test_worlds_that_are_not_stepped_keep_their_state(example):
    rng = np.random.default_rng(SEED)
    actions = rng.uniform(-1.0, 1.0, (3, WORLDS, 2))
    bare, envs = batch("Disabled"), example.TianshouEnvs(batch("Disabled"))
    bare.reset(seed=SEED)
    envs.reset(seed=SEED)
    for one in actions[:2]:
        bare_obs, bare_rewards, *_ = bare.step(one)
        observations, rewards, _, _, infos = envs.step(one[[3, 1]], [3, 1])
        np.testing.assert_array_equal(observations, bare_obs[[3, 1]])
        np.testing.assert_array_equal(rewards, bare_rewards[[3, 1]])
        assert [info["env_id"] for info in infos] == [3, 1]
    fresh = batch("Disabled")
    fresh.reset(seed=SEED)
    expected = np.where([True, False, True, False], fresh.step(actions[2])[1], bare.step(actions[2])[1])
    np.testing.assert_array_equal(envs.step(actions[2])[1], expected)


def test_some_worlds_start_anew(example):
    envs = example.TianshouEnvs(batch("Disabled"))
    first, _ = envs.reset(seed=SEED)
    observations, infos = envs.reset([2])
    assert observations.shape == (1, *first.shape[1:])
    assert [info["env_id"] for info in infos] == [2]
    assert (observations[0] != first[2]).any()
    assert envs.seed(SEED) == [[SEED + i] for i in range(WORLDS)]


def test_it_trains_and_says_the_return(example):
    value = example.train(worlds=8, steps=1024, max_episode_steps=10)
    assert -2.0 < value < 0.0  # ten steps cost 0.1 and their effort, and move a block little
