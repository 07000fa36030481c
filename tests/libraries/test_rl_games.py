"""Transitions that `examples/rl_games_reach.py` stores are those of the bare batch, with a value after a limit only."""

from __future__ import annotations

import numpy as np
import pytest

from tests.libraries.transitions import ENV, LIMIT, SEED, WORLDS, replay, time_outs

pytestmark = pytest.mark.exhaustive


@pytest.fixture
def example():
    pytest.importorskip("rl_games")
    pytest.importorskip("tensorboardX")
    import rl_games_reach

    return rl_games_reach


def test_stored_transitions_are_those_of_the_batch(example, tmp_path):
    agent = example.make_agent(WORLDS, seed=SEED, folder=str(tmp_path), env=ENV, max_episode_steps=LIMIT)
    agent.init_tensors()
    agent.obs = agent.env_reset()
    agent.set_eval()
    outs = []
    step = agent.vec_env.step

    def noted(actions):
        result = step(actions)
        outs.append(result[-1]["time_outs"])
        return result

    agent.vec_env.step = noted
    import torch

    with torch.no_grad():
        agent.play_steps()
    stored = {name: values.cpu().numpy() for name, values in agent.experience_buffer.tensor_dict.items()}
    done = replay(stored["actions"])
    np.testing.assert_array_equal(stored["obses"], done.obs)
    np.testing.assert_array_equal(stored["dones"][1:] > 0, (done.terminated | done.truncated)[:-1])
    np.testing.assert_array_equal(outs, time_outs(done))
    # The library's own approximation: the value of the observation before the last step, not after it.
    bootstrap = agent.gamma * stored["values"][..., 0] * time_outs(done)
    np.testing.assert_allclose(stored["rewards"][..., 0], done.rewards + bootstrap, rtol=0, atol=1e-6)
    assert np.abs(bootstrap[time_outs(done)]).min() > 1e-6


def test_it_trains_and_says_the_return(example, tmp_path):
    value = example.train(worlds=8, steps=1024, folder=str(tmp_path), max_episode_steps=10)
    assert -2.0 < value < 0.0  # ten steps cost 0.1 and their effort, and move a block little
    assert any(tmp_path.iterdir())
