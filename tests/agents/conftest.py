"""Runs so small that they learn nothing, but take every path."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:  # it needs the extra `agents`
    from agents.config import RunConfig

NUM_ENVS, ROLLOUT = 8, 16

TINY_ALGORITHMS = {
    "ppo": {"n_steps": ROLLOUT, "batch_size": 64, "n_epochs": 2, "policy_kwargs": {"net_arch": [8]}},
    "sac": {
        "buffer_size": 2000,
        "learning_starts": 100,
        "batch_size": 32,
        "train_freq": 1,
        "gradient_steps": 1,
        "policy_kwargs": {"net_arch": [8]},
    },
}


HINDSIGHT = "sac with hindsight"
TINY_ALGORITHMS[HINDSIGHT] = {
    **TINY_ALGORITHMS["sac"], "learning_starts": NUM_ENVS * 8, "hindsight": {"n_sampled_goal": 4},
    "action_noise": {"sigma": 0.3, "theta": 0.15},
}  # fmt: skip


@pytest.fixture(params=TINY_ALGORITHMS)
def tiny(request) -> RunConfig:
    """Two rollouts of 8 worlds (PPO), or as many steps (SAC); with hindsight in episodes of five steps."""
    from agents.config import RunConfig

    is_goal = request.param == HINDSIGHT
    return RunConfig(
        env="rigid_env/BlockReachGoal-v0" if is_goal else "rigid_env/BlockReach-v0",
        algo="sac" if is_goal else request.param,
        seed=3,
        num_envs=NUM_ENVS,
        max_steps=2 * NUM_ENVS * ROLLOUT,
        target=1.0,
        threads=1,
        accuracy={"tolerance": 1e-3},
        algorithm=TINY_ALGORITHMS[request.param],
        env_kwargs={"max_episode_steps": 5} if is_goal else {},
    )
