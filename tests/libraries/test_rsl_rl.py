"""Transitions that `examples/rsl_rl_reach.py` stores are those of the bare batch, with a value after a limit only."""

from __future__ import annotations

from copy import deepcopy

import numpy as np
import pytest

from tests.libraries.transitions import LIMIT, SEED, WORLDS, batch, replay, time_outs

pytestmark = pytest.mark.exhaustive


@pytest.fixture
def example():
    pytest.importorskip("rsl_rl")
    pytest.importorskip("tensordict")
    import rsl_rl_reach

    return rsl_rl_reach


@pytest.fixture
def runner(example):
    """A runner on the batch of `transitions`."""
    import torch
    from rsl_rl.runners import OnPolicyRunner

    torch.manual_seed(SEED)
    return OnPolicyRunner(example.RslRlEnv(batch("SameStep"), SEED), deepcopy(example.SETTINGS))


def test_stored_transitions_are_those_of_the_batch(runner):
    import torch

    obs, outs = runner.env.get_observations(), []
    with torch.inference_mode():
        for _ in range(runner.cfg["num_steps_per_env"]):
            obs, rewards, dones, extras = runner.env.step(runner.alg.act(obs))
            runner.alg.process_env_step(obs, rewards, dones, extras)
            outs.append(extras["time_outs"].numpy())
    stored = runner.alg.storage
    done = replay(stored.actions.numpy())
    np.testing.assert_array_equal(stored.observations["policy"].numpy(), done.obs)
    np.testing.assert_array_equal(stored.dones.numpy()[..., 0] > 0, done.terminated | done.truncated)
    np.testing.assert_array_equal(outs, time_outs(done))
    # The library's own approximation: the value of the observation before the last step, not after it.
    bootstrap = runner.alg.gamma * stored.values.numpy()[..., 0] * time_outs(done)
    np.testing.assert_allclose(stored.rewards.numpy()[..., 0], done.rewards + bootstrap, rtol=0, atol=1e-6)
    assert np.abs(bootstrap[time_outs(done)]).min() > 1e-6


def test_lengths_of_episodes_can_be_set(runner):
    import torch

    env, still = runner.env, torch.zeros(WORLDS, runner.env.num_actions)
    env.episode_length_buf = torch.tensor([0, 3, LIMIT - 1, 1])
    assert env.episode_length_buf.tolist() == [0, 3, LIMIT - 1, 1]
    _, _, dones, extras = env.step(still)
    assert dones.tolist() == extras["time_outs"].tolist() == [False, False, True, False]
    assert env.episode_length_buf.tolist() == [1, 4, 0, 2]


def test_it_trains_and_says_the_return(example, tmp_path):
    value = example.train(worlds=8, steps=1024, folder=str(tmp_path), max_episode_steps=10)
    assert -2.0 < value < 0.0  # ten steps cost 0.1 and their effort, and move a block little
    assert any(tmp_path.iterdir())
