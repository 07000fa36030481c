"""Hyperparameters against the signatures they go to, and what configurations refuse."""

from __future__ import annotations

import inspect

import gymnasium as gym
import numpy as np
import pytest

pytest.importorskip("stable_baselines3")

import torch
import yaml
from stable_baselines3 import HerReplayBuffer
from stable_baselines3.common.policies import ActorCriticPolicy
from stable_baselines3.sac.policies import SACPolicy

import physics
from agents.algorithms import CLASSES, algorithm_arguments
from agents.config import (
    ALGORITHMS,
    HYPERPARAMETERS,
    RunFolder,
    change,
    default_algorithm,
    make_config,
    short_name,
)
from agents.features import FINE, GoalDifference
from rigid_env.envs.registration import SUITE

TABLE = yaml.safe_load(HYPERPARAMETERS.read_text(encoding="utf-8"))
ENTRIES = [(env, algo) for env, entry in TABLE.items() for algo in entry]
POLICIES = {"ppo": ActorCriticPolicy, "sac": SACPolicy}
OURS = {"policy", "env", "seed", "device"}  # set by make_model


def test_every_environment_has_every_algorithm():
    with_rewards = {(f"rigid_env/{name}-v0", algo) for name in ("BlockReach", "BlockReorient") for algo in ALGORITHMS}
    of_suite = {(f"rigid_env/{name}-v0", "ppo") for name in SUITE}
    # hindsight needs a replay buffer
    with_goals = {("rigid_env/BlockReachGoal-v0", "sac"), ("rigid_env/BlockReorientGoal-v0", "ppo")}
    assert set(ENTRIES) == with_rewards | of_suite | with_goals


@pytest.mark.parametrize(("env", "algo"), ENTRIES)
def test_every_key_is_accepted(env, algo):
    config = make_config(env, algo, seed=0)
    assert env in gym.registry
    physics.Accuracy(**config.accuracy)
    arguments = algorithm_arguments(config)
    allowed = set(inspect.signature(CLASSES[algo].__init__).parameters) - {"self"} - OURS
    assert set(arguments) <= allowed
    of_replay = set(inspect.signature(HerReplayBuffer.__init__).parameters)
    assert set(arguments.get("replay_buffer_kwargs", {})) <= of_replay
    policy_arguments = arguments["policy_kwargs"]
    assert set(policy_arguments) <= set(inspect.signature(POLICIES[algo].__init__).parameters)
    assert inspect.isclass(policy_arguments["activation_fn"])


def test_minibatches_divide_the_rollout():
    for env, entry in TABLE.items():
        if "ppo" not in entry:
            continue
        config = make_config(env, "ppo", seed=0)
        assert config.num_envs * entry["ppo"]["algorithm"]["n_steps"] % config.algorithm["batch_size"] == 0


def test_file_brings_back_what_was_written(tmp_path):
    config = make_config("rigid_env/BlockReach-v0", "ppo", seed=7, target=0.5, num_envs=None)
    config.write(tmp_path / "config.yaml")
    assert RunFolder(tmp_path).read_config() == config
    assert (config.seed, config.target, config.num_envs) == (7, 0.5, TABLE[config.env]["ppo"]["num_envs"])


def test_module_before_the_id_is_left_out():
    assert make_config("rigid_env:rigid_env/BlockReach-v0", "ppo", 0).env == "rigid_env/BlockReach-v0"


def test_a_module_that_must_be_imported_is_kept(tmp_path):
    path = tmp_path / "mine.yml"
    path.write_text("mine/Shove-v0:\n  ppo: {num_envs: 8, max_steps: 100, target: 0.9}\n", encoding="utf-8")
    config = make_config("shove:mine/Shove-v0", default_algorithm("shove:mine/Shove-v0", path), 0, path)
    assert config.env == "shove:mine/Shove-v0"
    assert short_name(config.env) == "Shove-v0"


def test_wrong_values_of_a_file_name_file_and_environment(tmp_path):
    path = tmp_path / "mine.yml"
    path.write_text("mine/Shove-v0:\n  ppo: {num_envs: 8, max_steps: 100, target: 1.1}\n", encoding="utf-8")
    with pytest.raises(ValueError, match=r"^mine.yml, mine/Shove-v0, ppo: target is 1.1; allowed are success rates"):
        make_config("mine/Shove-v0", "ppo", 0, path)


@pytest.mark.parametrize(
    "changes",
    [{"algo": "dqn"}, {"num_envs": 0}, {"max_steps": 1.5}, {"threads": True}, {"seed": -1}, {"target": 0.0}],
    ids=lambda changes: next(iter(changes)),
)
def test_wrong_values_are_named(changes):
    (name, value), *_ = changes.items()
    config = make_config("rigid_env/BlockReach-v0", "ppo", seed=0)
    with pytest.raises(ValueError, match=f"{name} is {value!r}; allowed"):
        change(config, **changes)


def test_unknown_entries_are_named(tmp_path):
    with pytest.raises(ValueError, match=r"env is 'CartPole-v1'; allowed are .*BlockReach"):
        make_config("CartPole-v1", "ppo", 0)
    path = tmp_path / "mine.yml"
    path.write_text("E:\n  ppo: {num_env: 3}\n", encoding="utf-8")
    with pytest.raises(ValueError, match="unknown keys num_env"):
        make_config("E", "ppo", 0, path)
    with pytest.raises(ValueError, match="algo is 'sac'; allowed with E are ppo"):
        make_config("E", "sac", 0, path)


def test_unknown_activation_is_named():
    config = make_config("rigid_env/BlockReach-v0", "ppo", seed=0)
    config = change(config, algorithm={"policy_kwargs": {"activation_fn": "Rellu"}})
    with pytest.raises(ValueError, match="activation_fn is 'Rellu'"):
        algorithm_arguments(config)


def test_noise_of_other_keys_is_named():
    config = make_config("rigid_env/BlockReachGoal-v0", "sac", seed=0)
    config = change(config, algorithm={"action_noise": {"sigma": 0.3}})
    with pytest.raises(ValueError, match="action_noise has the keys sigma; allowed are sigma, theta"):
        algorithm_arguments(config)


def test_a_learning_rate_may_fall():
    config = make_config("rigid_env/BlockReachGoal-v0", "sac", seed=0)
    rate = algorithm_arguments(config)["learning_rate"]
    assert [rate(1.0), rate(0.5), rate(0.0)] == pytest.approx([1e-3, 5.5e-4, 1e-4])
    config = change(config, algorithm={"learning_rate": {"start": 1e-3}})
    with pytest.raises(ValueError, match="learning_rate has the keys start; allowed are a number, or start, end"):
        algorithm_arguments(config)


def test_features_hold_the_way_to_the_goal_coarsely_and_finely():
    sizes = {"observation": 2, "achieved_goal": 2, "desired_goal": 2}
    space = gym.spaces.Dict({key: gym.spaces.Box(-9, 9, (size,)) for key, size in sizes.items()})
    features = GoalDifference(space)
    parts = {"observation": [1.0, 2.0], "achieved_goal": [0.5, -1.0], "desired_goal": [0.6, 3.0]}
    found = features({key: torch.tensor([values], dtype=torch.float64) for key, values in parts.items()})[0]
    way = np.array([0.1, 4.0])
    expected = np.concatenate(([1.0, 2.0, 0.5, -1.0], way, np.tanh(FINE * way)))
    assert features.features_dim == len(expected)
    np.testing.assert_allclose(found.numpy(), expected, rtol=1e-14)  # a few roundings of float64
