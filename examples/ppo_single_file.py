"""Proximal policy optimisation (PPO) in one file, for reading: ``python examples/ppo_single_file.py``.

Needs torch. Every formula stands beside its code, with the number of its equation in the papers:

- [PPO] Schulman, Wolski, Dhariwal, Radford, Klimov: Proximal policy optimization algorithms. arXiv:1707.06347, 2017.
- [GAE] Schulman, Moritz, Levine, Jordan, Abbeel: High-dimensional continuous control using generalized advantage
  estimation. arXiv:1506.02438, 2015.

T steps of N worlds are a rollout, in arrays (T, N, ...). s is an observation, a an action, r a reward, s' the
observation after the step: at the end of an episode its last one, not the first one of the next episode.
"""

from __future__ import annotations

import argparse
import math
import time
from collections import deque
from dataclasses import dataclass

import gymnasium as gym
import numpy as np
import torch
from torch import Tensor, nn

import physics
import rigid_env  # noqa: F401 (registers the environments)

WORLDS = 512  # N
HORIZON = 32  # T
EPOCHS = 5  # passes over a rollout
MINIBATCH = 2048
LEARNING_RATE = 1e-3  # of the first update; it falls in a line to 0
GAMMA = 0.99  # γ, discount of a step
LAMBDA = 0.95  # λ of GAE: 0 trusts the critic, 1 the rewards seen
CLIP = 0.2  # ε
VALUE_WEIGHT = 0.5  # c₁
ENTROPY_WEIGHT = 0.0  # c₂
GRADIENT_NORM = 0.5  # the gradient is shortened to this length
EVALUATION_SEED = 1_000_000_000  # far from the seeds of training


class Agent(nn.Module):
    """A policy π(a|s) = Normal(μ(s), σ) and a critic V(s), two networks that share nothing."""

    def __init__(self, observations: int, actions: int):
        super().__init__()
        self.mean = network(observations, actions, last_gain=0.01)  # μ starts near 0
        self.log_std = nn.Parameter(torch.zeros(actions))  # log σ
        self.critic = network(observations, 1, last_gain=1.0)

    def policy(self, s: Tensor) -> torch.distributions.Normal:
        """π(·|s), a distribution for each number of the action; the environment clips the samples."""
        return torch.distributions.Normal(self.mean(s), self.log_std.exp())

    def value(self, s: Tensor) -> Tensor:
        """V(s), the expected discounted return from s."""
        return self.critic(s).squeeze(-1)


def network(inputs: int, outputs: int, last_gain: float) -> nn.Sequential:
    """Two hidden layers of 64, with orthogonal weights."""
    layers = [nn.Linear(inputs, 64), nn.Tanh(), nn.Linear(64, 64), nn.Tanh(), nn.Linear(64, outputs)]
    for layer, gain in zip(layers[::2], (math.sqrt(2.0), math.sqrt(2.0), last_gain)):
        nn.init.orthogonal_(layer.weight, gain)
        nn.init.zeros_(layer.bias)
    return nn.Sequential(*layers)


@dataclass
class Rollout:
    """T steps of N worlds, (T, N, ...)."""

    s: Tensor
    a: Tensor
    log_prob: Tensor  # log π(a|s) of the policy that acted
    r: Tensor
    s_next: Tensor
    terminated: Tensor  # success or failure: nothing comes after s'
    ended: Tensor  # terminated, or truncated by the time limit: s' has a value, but the next row is another episode


class Collector:
    """Steps a native batch in mode ``SameStep``, and notes the last episodes."""

    def __init__(self, envs: gym.vector.VectorEnv, seed: int):
        self.envs = envs
        self.s = torch.from_numpy(envs.reset(seed=seed)[0])
        self.returns = np.zeros(envs.num_envs)  # of the episodes under way, not discounted
        self.last_returns: deque[float] = deque(maxlen=500)
        self.last_successes: deque[bool] = deque(maxlen=500)

    @torch.no_grad()
    def collect(self, agent: Agent, horizon: int = HORIZON) -> Rollout:
        """Act for `horizon` steps of each world."""
        rows = []
        for _ in range(horizon):
            policy = agent.policy(self.s)
            a = policy.sample()
            s_now, r, terminated, truncated, infos = self.envs.step(a.numpy())
            ended, s_next = terminated | truncated, s_now.copy()
            self.returns += r
            if ended.any():  # s_now is the start of the next episode there
                s_next[ended] = np.stack(infos["final_obs"][ended])
                self.last_returns.extend(self.returns[ended])
                self.last_successes.extend(infos["final_info"]["is_success"][ended])
                self.returns[ended] = 0.0
            log_prob = policy.log_prob(a).sum(-1)  # the numbers of an action are independent
            row = (self.s, a, log_prob, np.float32(r), s_next, terminated, ended)
            rows.append([torch.as_tensor(each) for each in row])
            self.s = torch.from_numpy(s_now)
        return Rollout(*(torch.stack(column) for column in zip(*rows)))


@torch.no_grad()
def advantages(agent: Agent, rollout: Rollout) -> tuple[Tensor, Tensor]:
    """Generalised advantage estimates A, and the returns A + V that the critic learns, both (T, N).

    δₜ = rₜ + γ V(s'ₜ) - V(sₜ), with V(s') = 0 after a termination      [PPO] (12)
    Aₜ = δₜ + γ λ Aₜ₊₁, with Aₜ₊₁ = 0 where an episode ended             [PPO] (11), [GAE] (16)
    """
    v, v_next = agent.value(rollout.s), agent.value(rollout.s_next)
    delta = rollout.r + GAMMA * v_next * ~rollout.terminated - v
    a = torch.zeros_like(delta)
    later = torch.zeros_like(delta[0])
    for t in reversed(range(len(delta))):
        later = a[t] = delta[t] + GAMMA * LAMBDA * ~rollout.ended[t] * later
    return a, a + v


def update(agent: Agent, optimizer: torch.optim.Optimizer, rollout: Rollout) -> None:
    """Maximise E[L_clip - c₁ L_value + c₂ S], [PPO] (9), by some epochs of random minibatches, Algorithm 1."""
    columns = (rollout.s, rollout.a, rollout.log_prob, *advantages(agent, rollout))
    data = [column.flatten(0, 1) for column in columns]
    for rows in (rows for _ in range(EPOCHS) for rows in torch.randperm(len(data[0])).split(MINIBATCH)):
        s, a, log_prob_old, advantage, returns = (each[rows] for each in data)
        policy = agent.policy(s)
        ratio = torch.exp(policy.log_prob(a).sum(-1) - log_prob_old)  # ρ = π(a|s) / π_old(a|s)
        advantage = (advantage - advantage.mean()) / (advantage.std() + 1e-8)  # A
        clipped = torch.clamp(ratio, 1.0 - CLIP, 1.0 + CLIP)
        l_clip = torch.min(ratio * advantage, clipped * advantage).mean()  # E[min(ρ A, clip(ρ, 1 - ε, 1 + ε) A)], (7)
        l_value = (agent.value(s) - returns).square().mean()  # E[(V(s) - return)²]
        entropy = policy.entropy().sum(-1).mean()  # S, of the policy
        optimizer.zero_grad()
        (-l_clip + VALUE_WEIGHT * l_value - ENTROPY_WEIGHT * entropy).backward()
        nn.utils.clip_grad_norm_(agent.parameters(), GRADIENT_NORM)
        optimizer.step()


def make_envs(env: str, worlds: int, **arguments: object) -> gym.vector.VectorEnv:
    """The native batch of an environment, whose worlds start anew in the step that ends their episode."""
    native = {"vectorization_mode": "vector_entry_point", "autoreset_mode": "SameStep", "threads": 2}
    envs = gym.make_vec(env, num_envs=worlds, **native, **arguments)
    if len(envs.single_observation_space.shape or ()) != 1:
        raise ValueError(f"{env} observes {envs.single_observation_space}; allowed is one vector of numbers")
    return envs


def train(env: str, steps: int, seed: int) -> Agent:
    """Train an agent for `steps` steps of all worlds together, and print how far it is."""
    torch.manual_seed(seed)
    torch.set_num_threads(1)  # small networks; the engine has two threads
    envs = make_envs(env, WORLDS, accuracy=physics.Accuracy(tolerance=1e-3))
    agent = Agent(envs.single_observation_space.shape[0], envs.single_action_space.shape[0])
    optimizer = torch.optim.Adam(agent.parameters(), eps=1e-5)
    collector, start = Collector(envs, seed), time.perf_counter()
    updates = math.ceil(steps / (HORIZON * WORLDS))
    for k in range(1, updates + 1):
        optimizer.param_groups[0]["lr"] = LEARNING_RATE * (1.0 - (k - 1) / updates)
        update(agent, optimizer, collector.collect(agent))
        if (k % 10 == 0 or k == updates) and collector.last_returns:
            done, seconds = k * HORIZON * WORLDS, time.perf_counter() - start
            success, mean = np.mean(collector.last_successes), np.mean(collector.last_returns)
            print(f"{done:>9,} steps  {done / seconds:>7,.0f} steps/s  success {success:6.1%}  return {mean:7.3f}")
    envs.close()
    return agent


@torch.no_grad()
def evaluate(agent: Agent, env: str, seed: int, episodes: int = 500) -> float:
    """Success rate of the mean action μ(s) on fresh episodes, one of each seed, at the default accuracy."""
    envs = make_envs(env, episodes)
    s, _ = envs.reset(seed=EVALUATION_SEED + seed * episodes)
    success, running = np.zeros(episodes, dtype=bool), np.ones(episodes, dtype=bool)
    while running.any():
        s, _, terminated, truncated, infos = envs.step(agent.mean(torch.from_numpy(s)).numpy())
        first = running & (terminated | truncated)
        if first.any():
            success[first] = infos["final_info"]["is_success"][first]
        running &= ~first
    envs.close()
    return float(success.mean())


def main() -> None:
    """Train and evaluate."""
    parser = argparse.ArgumentParser(description="Train an agent by PPO, and evaluate it on 500 fresh episodes.")
    parser.add_argument("--env", default="rigid_env/BlockReach-v0", help="Gymnasium id, or module:id")
    parser.add_argument("--steps", type=int, default=1_500_000, help="of all worlds together")
    parser.add_argument("--seed", type=int, default=0, help="of weights, actions and episodes")
    given = parser.parse_args()
    if given.steps < 1:
        parser.error(f"--steps is {given.steps}; allowed are integers of at least 1")
    start = time.perf_counter()
    success = evaluate(train(given.env, given.steps, given.seed), given.env, given.seed)
    print(f"success of 500 fresh episodes {success:.1%}, all in {time.perf_counter() - start:.1f} s")


if __name__ == "__main__":
    main()
