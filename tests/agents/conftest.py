"""Runs so small that they learn nothing, but take every path."""

from __future__ import annotations

import pytest

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


@pytest.fixture(params=TINY_ALGORITHMS)
def tiny(request) -> RunConfig:
    """Two rollouts of 8 worlds (PPO), or as many steps (SAC)."""
    return RunConfig(
        env="rigid_env/BlockReach-v0",
        algo=request.param,
        seed=3,
        num_envs=NUM_ENVS,
        max_steps=2 * NUM_ENVS * ROLLOUT,
        target=1.0,
        threads=1,
        accuracy={"tolerance": 1e-3},
        algorithm=TINY_ALGORITHMS[request.param],
    )
