"""Evaluation: every seed one episode, the same numbers every time, whatever the batch."""

from __future__ import annotations

import gymnasium as gym
import numpy as np
import pytest

pytest.importorskip("stable_baselines3")

from agents import evaluate as module
from agents.baselines import baseline_policy, random_policy, reach_controller
from agents.evaluate import evaluate, evaluation_seeds, run_episodes

REACH, REORIENT = "rigid_env/BlockReach-v0", "rigid_env/BlockReorient-v0"


def one_episode(env, seed):
    """Success, return and length of one episode in the single environment."""
    single = gym.make(env)
    observation, _ = single.reset(seed=seed)
    total, length, has_ended = 0.0, 0, False
    while not has_ended:
        observation, reward, terminated, truncated, info = single.step(reach_controller(observation[None])[0])
        total, length, has_ended = total + reward, length + 1, terminated or truncated
    return info["is_success"], total, length


def test_every_seed_has_its_own_episode():
    seeds = evaluation_seeds(4, 6)
    done = run_episodes(REACH, reach_controller, seeds)
    alone = [one_episode(REACH, seed) for seed in seeds]
    assert list(zip(done.success, done.returns, done.lengths)) == alone


def test_episodes_do_not_depend_on_the_batch(monkeypatch):
    whole = run_episodes(REACH, reach_controller, range(10))
    monkeypatch.setattr(module, "BATCH", 4)
    parts = run_episodes(REACH, reach_controller, range(10), threads=1)
    for name in ("success", "returns", "lengths"):
        np.testing.assert_array_equal(getattr(whole, name), getattr(parts, name))


def test_same_seed_gives_the_same_numbers():
    def numbers(seed):
        result = evaluate(REACH, random_policy(seed), 20, seed, accuracy="balanced")
        return {key: value for key, value in result.items() if key != "seconds"}

    assert numbers(1) == numbers(1)
    assert numbers(1)["return_mean"] != numbers(2)["return_mean"]


def test_failures_count_as_long_as_they_are():
    result = evaluate(REACH, random_policy(), 20, 0)
    assert result["length_max"] == 300
    assert result["episodes"] == 20


def test_seeds_of_two_evaluations_are_apart():
    assert evaluation_seeds(0, module.SEED_STRIDE)[-1] < evaluation_seeds(1, 1)[0]


@pytest.mark.parametrize("env", [REACH, REORIENT])
def test_controller_beats_random(env):
    controller = run_episodes(env, baseline_policy("controller", env), range(60)).success.mean()
    chance = run_episodes(env, baseline_policy("random", env), range(60)).success.mean()
    assert controller >= 0.9
    assert chance <= 0.1


def test_chance_has_an_action_for_each_world_of_a_task_with_goals():
    """Observations of such a task are a dict of arrays, whose length is not the number of worlds."""
    policy = baseline_policy("random", "rigid_env/BlockReachGoal-v0")
    assert policy({"observation": np.zeros((5, 20)), "achieved_goal": np.zeros((5, 4))}).shape == (5, 6)
    assert policy(np.zeros((7, 20))).shape == (7, 6)


def test_the_table_tells_the_accuracy_of_the_judge():
    table = module.make_table(evaluate(REACH, reach_controller, 2, 0, accuracy="fast"), "title")
    assert ["accuracy", "fast"] in [[str(cell) for cell in row] for row in table.rows]


def test_number_of_episodes_is_checked():
    with pytest.raises(ValueError, match="episodes is 0; allowed is 1"):
        evaluate(REACH, reach_controller, 0, 0)


def test_unknown_baselines_are_named():
    with pytest.raises(ValueError, match="baseline is 'clever'; allowed are 'random' and 'controller'"):
        baseline_policy("clever", REACH)
    with pytest.raises(ValueError, match="env is 'CartPole-v1'; allowed are rigid_env"):
        baseline_policy("controller", "CartPole-v1")
