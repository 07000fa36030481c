"""The checkers of Gymnasium and Stable-Baselines3, and the ways to make and record an environment."""

from __future__ import annotations

import subprocess
import sys
import warnings

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from gymnasium.vector import AutoresetMode

from rigid_env.envs.registration import MAX_EPISODE_STEPS, register_envs
from rigid_env.envs.vector_env import RigidVectorEnv
from tests.envs.conftest import IDS
from tests.tiers.sweep import sweep


def test_gymnasium_check_env_without_a_warning(env_id):
    env = gym.make(env_id)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(env.unwrapped)
    env.close()


def test_sb3_check_env_without_a_warning(env_id):
    from stable_baselines3.common.env_checker import check_env as sb3_check_env

    env = gym.make(env_id)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        sb3_check_env(env.unwrapped, warn=True, skip_render_check=False)
    env.close()


@pytest.mark.parametrize("env_id", sweep(IDS, IDS[:1]))
def test_make_with_module_prefix_in_a_fresh_process(env_id):
    code = f"import gymnasium as gym\nenv = gym.make('rigid_env:{env_id}')\nprint(env.reset(seed=0)[0].shape)\n"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("(2")


def test_registration_twice_changes_nothing(env_id):
    before = gym.registry[env_id]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        register_envs()
    assert gym.registry[env_id] is before


def test_make_truncates_at_the_registered_step(env_id):
    env = gym.make(env_id, frame_skip=1)
    limit = MAX_EPISODE_STEPS[env_id.split("/")[1].removesuffix("-v0")]
    env.reset(seed=1, options={"face": 2})
    still = np.zeros(6, dtype=np.float32)
    ends = [env.step(still)[2:4] for _ in range(limit)]
    assert ends[:-1] == [(False, False)] * (limit - 1)
    assert ends[-1] == (False, True)


def test_make_vec_gives_the_native_batch_and_its_limit(env_id):
    envs = gym.make_vec(env_id, num_envs=3, accuracy="fast")
    assert envs.metadata["autoreset_mode"] is AutoresetMode.NEXT_STEP
    assert isinstance(envs, RigidVectorEnv)
    assert envs.max_episode_steps == gym.spec(env_id).max_episode_steps
    assert gym.make_vec(env_id, num_envs=1, max_episode_steps=7).max_episode_steps == 7


@pytest.mark.parametrize("env_id", sweep(IDS, IDS[:1]))
def test_record_video_of_a_single_environment(env_id, tmp_path):
    env = gym.make(env_id, render_mode="rgb_array", width=64, height=48)
    env = gym.wrappers.RecordVideo(env, str(tmp_path / "video"), episode_trigger=lambda k: True, video_length=3)
    env.reset(seed=0)
    for _ in range(4):
        env.step(env.action_space.sample())
    env.close()
    (video,) = tmp_path.glob("video/*.mp4")
    assert video.stat().st_size > 500


@pytest.mark.parametrize("env_id", sweep(IDS, IDS[1:]))
def test_record_video_of_a_vector_environment(env_id, tmp_path):
    envs = gym.make_vec(env_id, num_envs=2, render_mode="rgb_array", width=64, height=48)
    frames = (envs.reset(seed=0), envs.render())[1]
    assert isinstance(frames, tuple)
    assert len(frames) == 2
    assert not np.array_equal(*frames)  # two worlds, two pictures
    envs = gym.wrappers.vector.RecordVideo(
        envs, str(tmp_path / "video"), episode_trigger=lambda k: True, video_length=3
    )
    envs.reset(seed=0)
    for _ in range(4):
        envs.step(envs.action_space.sample())
    envs.close()
    (video,) = tmp_path.glob("video/*.mp4")
    assert video.stat().st_size > 500


def test_human_mode_opens_a_window_and_close_shuts_it(env_class):
    import pygame

    env = env_class(render_mode="human", width=64, height=48)
    env.reset(seed=0)
    assert pygame.display.get_surface().get_size() == (64, 48)
    assert env.render() is None
    env.close()
    assert pygame.display.get_surface() is None
    env.close()


def test_the_applied_force_is_in_the_picture(env_class):
    env = env_class(render_mode="rgb_array", width=160, height=120)
    env.reset(seed=0)
    still = env.render()
    env.step(np.array([0.0, 1.0, 0.0, 0.0, 0.0, 0.0], dtype=np.float32))
    assert still.shape == (120, 160, 3)
    assert (still != env.render()).any()


def test_render_fps_follows_the_control_period(env_class):
    assert env_class().metadata["render_fps"] == 40
    assert env_class(dt=0.01, frame_skip=2).metadata["render_fps"] == 50
    assert env_class.metadata["render_fps"] == 40
