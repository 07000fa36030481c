"""RLlib's new API stack on the native batch: it trains, and its transitions are those of single environments.

A test is skipped where Ray is not installed with the dependencies of RLlib.
"""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import gymnasium as gym
import numpy as np
import pytest

import rigid_env  # noqa: F401 (registers)

pytest.importorskip("ray")
pytest.importorskip("tree")  # dm-tree, of ray[rllib]

EXAMPLE = Path(__file__).parents[2] / "examples" / "rllib_reach.py"
REACH = "rigid_env:rigid_env/BlockReach-v0"
WORLDS, LENGTH, SEED = 3, 5, 7

pytestmark = pytest.mark.exhaustive


@pytest.fixture(scope="module", autouse=True)
def cluster():
    """A node of this machine, away from clusters that run already."""
    import ray

    ray.init(address="local", num_cpus=1, include_dashboard=False, log_to_driver=False)
    yield
    ray.shutdown()


def build(mode: str):
    """PPO whose worlds are in this process."""
    from ray.rllib.algorithms.ppo import PPOConfig

    config = PPOConfig().environment(REACH, env_config={"autoreset_mode": mode, "max_episode_steps": LENGTH})
    config.env_runners(
        num_env_runners=0,
        num_envs_per_env_runner=WORLDS,
        gym_env_vectorize_mode=gym.VectorizeMode.VECTOR_ENTRY_POINT,
    )
    config.training(train_batch_size=60, minibatch_size=30, num_epochs=1).debugging(seed=SEED)
    return config.build_algo()


def test_it_trains_on_the_native_batch():
    algorithm = build("NextStep")
    result = algorithm.train()
    algorithm.stop()
    assert result["env_runners"]["num_env_steps_sampled"] == pytest.approx(60, abs=WORLDS)
    assert result["env_runners"]["episode_len_mean"] == LENGTH
    assert np.isfinite(result["learners"]["default_policy"]["total_loss"])


def wrong_transitions(mode: str) -> tuple[int, int]:
    """Transitions that a single environment does not make with the same seed and actions, and all of them."""
    algorithm = build(mode)
    episodes = algorithm.env_runner.sample(num_episodes=4 * WORLDS, random_actions=True)
    algorithm.stop()
    first_of = {}  # first observation of an episode, to its world and its number
    for world in range(WORLDS):
        env = gym.make(REACH, max_episode_steps=LENGTH)
        for number in range(4 * WORLDS):
            observation, _ = env.reset(seed=SEED + world if number == 0 else None)
            first_of[observation.tobytes()] = world, number
    wrong = count = 0
    for episode in episodes:
        world, number = first_of.get(episode.get_observations(0).tobytes(), (0, 0))
        env = gym.make(REACH, max_episode_steps=LENGTH)
        for each in range(number + 1):
            observation, _ = env.reset(seed=SEED + world if each == 0 else None)
        is_over = is_same = False
        for t, action in enumerate(episode.get_actions()):
            is_same = not is_over and np.array_equal(observation, episode.get_observations(t))
            if not is_over:
                observation, reward, terminated, truncated, _ = env.step(action)
                is_over = terminated or truncated
                is_same &= reward == episode.get_rewards(t)
            is_same &= np.array_equal(observation, episode.get_observations(t + 1))
            wrong += not is_same
            count += 1
        wrong += is_over != episode.is_done
    return wrong, count


def test_its_transitions_are_those_of_single_environments():
    """Across the ends of episodes, too: the step that starts the next one is no transition."""
    wrong, count = wrong_transitions("NextStep")
    assert count >= 4 * WORLDS * LENGTH
    assert wrong == 0


def test_same_step_gives_it_wrong_transitions():
    """Nobody says so: docs/libraries.md does."""
    wrong, _ = wrong_transitions("SameStep")
    assert wrong >= 4 * WORLDS


def test_the_example_trains_on_two_nodes():
    """Up to the first success; docs/libraries.md has the run to 95 %."""
    assert len(EXAMPLE.read_text(encoding="utf-8").splitlines()) <= 60
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(EXAMPLE.parents[1]), *sys.path])}
    command = [sys.executable, str(EXAMPLE), "--target", "0.005"]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=900)
    assert done.returncode == 0, done.stderr
    *rows, last = [line for line in done.stdout.splitlines() if "success" in line]
    assert all("steps" in row for row in rows)
    assert "of 500 fresh episodes" in last
