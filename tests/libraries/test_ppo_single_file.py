"""PPO of `examples/ppo_single_file.py`: its transitions, its formulas, and what it learns."""

from __future__ import annotations

import subprocess
import sys
from types import SimpleNamespace

import numpy as np
import pytest

from tests.libraries.conftest import EXAMPLES
from tests.libraries.transitions import ENV, LIMIT, SEED, WORLDS, replay, time_outs

torch = pytest.importorskip("torch")


@pytest.fixture
def ppo():
    import ppo_single_file

    torch.manual_seed(SEED)
    return ppo_single_file


@pytest.mark.exhaustive
def test_a_rollout_holds_the_transitions_of_the_batch(ppo):
    envs = ppo.make_envs(ENV, WORLDS, max_episode_steps=LIMIT)
    agent = ppo.Agent(envs.single_observation_space.shape[0], envs.single_action_space.shape[0])
    collector = ppo.Collector(envs, SEED)
    parts = [collector.collect(agent, horizon) for horizon in (20, 12)]
    rollout = ppo.Rollout(*(torch.cat([getattr(part, name) for part in parts]) for name in vars(parts[0])))
    done = replay(rollout.a.numpy())
    np.testing.assert_array_equal(rollout.s, done.obs)
    np.testing.assert_array_equal(rollout.r, np.float32(done.rewards))
    np.testing.assert_array_equal(rollout.s_next, done.next_obs)
    np.testing.assert_array_equal(rollout.terminated, done.terminated)
    np.testing.assert_array_equal(rollout.ended, done.terminated | done.truncated)
    assert len(collector.last_returns) == rollout.ended.sum()
    with torch.no_grad():
        np.testing.assert_allclose(rollout.log_prob, agent.policy(rollout.s).log_prob(rollout.a).sum(-1), atol=1e-5)
    _, returns = ppo.advantages(agent, rollout)
    with torch.no_grad():
        last = done.rewards + ppo.GAMMA * agent.value(rollout.s_next).numpy() * time_outs(done)
    np.testing.assert_allclose(returns[rollout.ended], last[rollout.ended], atol=1e-5)


def test_advantages_are_the_sum_of_the_formula(ppo):
    steps, worlds = 6, 2
    rng = np.random.default_rng(SEED)
    s, s_next, r = (torch.from_numpy(rng.normal(size=shape)) for shape in [(steps, worlds, 3)] * 2 + [(steps, worlds)])
    terminated, ended = np.zeros((2, steps, worlds), dtype=bool)
    terminated[2, 0] = ended[2, 0] = ended[4, 1] = True
    rollout = ppo.Rollout(s, None, None, r, s_next, torch.from_numpy(terminated), torch.from_numpy(ended))
    agent = SimpleNamespace(value=lambda given: given.sum(-1))
    found, returns = ppo.advantages(agent, rollout)
    for world in range(worlds):
        for t in range(steps):
            expected, weight = 0.0, 1.0
            for k in range(t, steps):
                bootstrap = 0.0 if terminated[k, world] else ppo.GAMMA * float(s_next[k, world].sum())
                expected += weight * (float(r[k, world]) + bootstrap - float(s[k, world].sum()))
                weight *= ppo.GAMMA * ppo.LAMBDA
                if ended[k, world]:
                    break
            assert float(found[t, world]) == pytest.approx(expected, abs=1e-5)
    torch.testing.assert_close(returns, found + s.sum(-1))


def test_updates_make_good_actions_likelier_and_the_critic_better_within_the_clip(ppo, monkeypatch):
    s = torch.randn(8, 64, 3)
    ends = torch.ones(8, 64, dtype=torch.bool)

    def learn(clip):
        """Ten updates on one rollout: the change of π(a|s), the mean action, the errors of the critic."""
        monkeypatch.setattr(ppo, "CLIP", clip)
        torch.manual_seed(SEED)
        agent = ppo.Agent(3, 2)
        with torch.no_grad():
            a = agent.policy(s).sample()
            log_prob = agent.policy(s).log_prob(a).sum(-1)
        rollout = ppo.Rollout(s, a, log_prob, a[..., 0] - a[..., 1], s, ends, ends)  # the difference is the reward
        optimizer = torch.optim.Adam(agent.parameters(), lr=1e-3)
        errors = [(agent.value(s) - rollout.r).square().mean().item()]
        for _ in range(10):
            ppo.update(agent, optimizer, rollout)
        errors.append((agent.value(s) - rollout.r).square().mean().item())
        with torch.no_grad():
            ratio = (agent.policy(s).log_prob(a).sum(-1) - log_prob).exp()
            return (ratio - 1.0).abs().mean().item(), agent.mean(s).mean((0, 1)), errors

    change, mean, errors = learn(0.2)
    assert mean[0] > 0.05
    assert mean[1] < -0.05
    assert errors[1] < errors[0]
    assert learn(0.02)[0] < 0.5 * change


@pytest.mark.exhaustive
@pytest.mark.parametrize(
    ("words", "said"), [(["--steps", "0"], "--steps is 0"), (["--env", "rigid_env/BlockReachGoal-v0"], "one vector")]
)
def test_wrong_words_are_told(words, said):
    done = subprocess.run(
        [sys.executable, str(EXAMPLES / "ppo_single_file.py"), *words], capture_output=True, text=True, timeout=600
    )
    assert done.returncode != 0
    assert said in done.stderr


@pytest.mark.exhaustive
@pytest.mark.train
def test_it_solves_block_reach(ppo):
    agent = ppo.train("rigid_env/BlockReach-v0", steps=1_500_000, seed=0)
    assert ppo.evaluate(agent, "rigid_env/BlockReach-v0", seed=0) >= 0.95
