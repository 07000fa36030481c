"""End of an episode in each of Gymnasium's autoreset modes; reset masks and options."""

from __future__ import annotations

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode

STILL = np.zeros((2, 6), dtype=np.float32)


def staggered(vector_class, mode):
    """Two worlds with a limit of 4 steps, of which world 1 is two steps younger."""
    envs = vector_class(2, autoreset_mode=mode, max_episode_steps=4)
    envs.reset(seed=0)
    envs.step(STILL)
    envs.step(STILL)
    envs.reset(options={"reset_mask": np.array([False, True])})
    return envs


def test_next_step_resets_one_step_later_without_reward(vector_class):
    envs = staggered(vector_class, "NextStep")
    assert envs.metadata["autoreset_mode"] is AutoresetMode.NEXT_STEP
    envs.step(STILL)
    last, rewards, terminated, truncated, infos = envs.step(STILL)
    assert truncated.tolist() == [True, False]
    assert "final_obs" not in infos
    first, rewards, terminated, truncated, infos = envs.step(STILL)
    assert not np.array_equal(first[0], last[0])
    assert rewards[0] == 0.0
    assert rewards[1] != 0.0
    assert not truncated.any()
    assert not terminated.any()
    assert envs.step(STILL)[3].tolist() == [False, True]


def test_same_step_returns_the_new_observation_and_keeps_the_final_one(vector_class):
    envs, twin = staggered(vector_class, "SameStep"), staggered(vector_class, "NextStep")
    envs.step(STILL)
    twin.step(STILL)
    first, rewards, _, truncated, infos = envs.step(STILL)
    last, twin_rewards, _, _, twin_infos = twin.step(STILL)
    new = twin.step(STILL)[0]
    assert truncated.tolist() == [True, False]
    np.testing.assert_array_equal(rewards, twin_rewards)
    np.testing.assert_array_equal(infos["final_obs"][0], last[0])
    assert infos["final_obs"][1] is None
    assert infos["_final_obs"].tolist() == [True, False]
    error = envs.task.error_name
    assert infos["final_info"][error][0] == twin_infos[error][0]
    assert infos["final_info"][f"_{error}"].tolist() == [True, False]
    np.testing.assert_array_equal(first[0], new[0])
    assert "final_obs" not in envs.step(STILL)[4]


def test_disabled_waits_for_a_reset_of_exactly_the_ended_worlds(vector_class):
    envs = staggered(vector_class, AutoresetMode.DISABLED)
    envs.step(STILL)
    obs, _, terminated, truncated, _ = envs.step(STILL)
    with pytest.raises(gym.error.ResetNeeded, match=r"\[0\]"):
        envs.step(STILL)
    new, infos = envs.reset(options={"reset_mask": terminated | truncated})
    assert not np.array_equal(new[0], obs[0])
    np.testing.assert_array_equal(new[1], obs[1])
    assert infos["_speed"].tolist() == [True, False]
    assert envs.step(STILL)[3].tolist() == [False, False]


def test_reset_mask_leaves_the_callers_options_alone(vector_class):
    envs = vector_class(2)
    envs.reset(seed=0)
    options = {"reset_mask": np.array([True, False])}
    envs.reset(options=options)
    assert options.keys() == {"reset_mask"}


def test_vector_episode_statistics_count_each_step_once(vector_class):
    for mode in ("NextStep", "SameStep"):
        envs = gym.wrappers.vector.RecordEpisodeStatistics(vector_class(2, autoreset_mode=mode, max_episode_steps=3))
        envs.reset(seed=0)
        lengths = []
        for _ in range(9):
            infos = envs.step(STILL)[4]
            lengths += infos["episode"]["l"][infos["_episode"]].tolist() if "episode" in infos else []
        assert set(lengths) == {3}


def test_step_before_reset(env_class, vector_class):
    with pytest.raises(gym.error.ResetNeeded):
        env_class().step(STILL[0])
    with pytest.raises(gym.error.ResetNeeded):
        vector_class(2).step(STILL)


@pytest.mark.parametrize(
    ("mask", "text"),
    [
        (np.array([False, False]), "at least one True"),
        ([True, False], "bool array"),
        (np.ones(3, bool), "bool array"),
    ],
)
def test_reset_mask_errors(vector_class, mask, text):
    envs = vector_class(2)
    envs.reset(seed=0)
    with pytest.raises(ValueError, match=f"reset_mask.*{text}"):
        envs.reset(options={"reset_mask": mask})
