"""Pixel observations of environments: what they show, how they are stacked, and that they leave the rest alone."""

from __future__ import annotations

import pickle

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

from rigid_env import BlockReachEnv, BlockReachVectorEnv

SMALL = {"obs": "pixels", "obs_size": (24, 32)}


def test_checkers_pass():
    check_env(BlockReachEnv(**SMALL), skip_render_check=True)


def test_numbers_are_those_of_the_same_environment_without_pictures():
    plain, seen = BlockReachEnv(), BlockReachEnv(**SMALL)
    plain.reset(seed=1)
    picture, _ = seen.reset(seed=1)
    assert picture.shape == (24, 32, 3)
    assert picture.dtype == np.uint8
    for _ in range(10):
        action = plain.action_space.sample()
        ours, theirs = plain.step(action), seen.step(action)
        assert ours[1:4] == theirs[1:4]
        np.testing.assert_equal(ours[4], theirs[4])
        assert seen.observation_space.contains(theirs[0])


def test_a_moved_block_and_another_goal_are_seen():
    env = BlockReachEnv(**SMALL)
    first, _ = env.reset(seed=1, options={"place": (0.0, 0.0), "goal": (5.0, 5.0)})
    same, _ = env.reset(seed=1, options={"place": (0.0, 0.0), "goal": (5.0, 5.0)})
    moved, _ = env.reset(seed=1, options={"place": (4.0, 0.0), "goal": (5.0, 5.0)})
    other, _ = env.reset(seed=1, options={"place": (0.0, 0.0), "goal": (-5.0, 5.0)})
    np.testing.assert_array_equal(first, same)
    assert (first != moved).any()
    assert (first != other).any()


def test_a_stack_holds_the_last_steps_the_newest_last():
    env, alone = BlockReachEnv(**SMALL, obs_stack=3), BlockReachEnv(**SMALL)
    stack, _ = env.reset(seed=2)
    pictures = [alone.reset(seed=2)[0]]
    np.testing.assert_array_equal(stack, np.concatenate(3 * pictures, axis=-1))
    push = np.array([1.0, 0, 1.0, 0, 0, 0])
    for _ in range(4):
        stack = env.step(push)[0]
        pictures.append(alone.step(push)[0])
    np.testing.assert_array_equal(stack, np.concatenate(pictures[-3:], axis=-1))


@pytest.mark.parametrize("mode", ["NextStep", "SameStep"])
def test_batches_show_what_single_environments_show(mode):
    envs = BlockReachVectorEnv(2, **SMALL, obs_stack=2, autoreset_mode=mode, max_episode_steps=3)
    singles = [BlockReachEnv(**SMALL, obs_stack=2) for _ in range(2)]
    obs, _ = envs.reset(seed=5)
    push = np.array([1.0, 0, 1.0, 0, 0, 0])
    firsts = [env.reset(seed=5 + i)[0] for i, env in enumerate(singles)]
    np.testing.assert_array_equal(obs, firsts)
    for step in range(3):
        obs, *_, infos = envs.step(np.tile(push, (2, 1)))
        alone = [env.step(push)[0] for env in singles]
        seen = infos["final_obs"] if step == 2 and mode == "SameStep" else obs
        np.testing.assert_array_equal(np.stack(list(seen)), alone)
    if mode == "NextStep":
        obs = envs.step(np.tile(push, (2, 1)))[0]
    np.testing.assert_array_equal(obs, [env.reset()[0] for env in singles])


def test_pickled_copies_go_on_with_the_same_pictures():
    env = BlockReachEnv(**SMALL, obs_stack=2)
    env.reset(seed=3)
    twin = pickle.loads(pickle.dumps(env))
    action = env.action_space.sample()
    np.testing.assert_array_equal(env.step(action)[0], twin.step(action)[0])


def test_make_takes_them_and_batches_have_them():
    envs = gym.make_vec("rigid_env/BlockReach-v0", num_envs=2, **SMALL)
    assert envs.observation_space.shape == (2, 24, 32, 3)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"obs": "picture"}, ("obs", "'picture'", "state, pixels")),
        ({"obs": "pixels", "obs_size": 84}, ("obs_size", "84", "height and width")),
        ({"obs": "pixels", "obs_size": (84, 0)}, ("width of obs_size", "0")),
        ({"obs": "pixels", "obs_stack": 0}, ("obs_stack", "0")),
    ],
)
def test_refusals_name_the_argument(arguments, words):
    with pytest.raises(ValueError, match="allowed") as error:
        BlockReachEnv(**arguments)
    assert all(word in str(error.value) for word in words), str(error.value)
