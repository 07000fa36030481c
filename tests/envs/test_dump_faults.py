"""Recordings of steps that lead to a state that is not finite, written for environments that want them."""

from __future__ import annotations

import gymnasium as gym
import numpy as np

import physics


def test_an_environment_writes_what_led_to_a_fault(tmp_path):
    envs = gym.make_vec("rigid_env/BlockReach-v0", num_envs=3, dump_faults=tmp_path, size=((4, 2, 1), (5, 3, 2)))
    envs.reset(seed=0)
    actions = np.random.default_rng(0).uniform(-1, 1, (20, 3, 6))
    for action in actions:
        envs.step(action)
    assert not list(tmp_path.iterdir())
    # A spin whose energy overflows, in the world with index 2.
    envs.unwrapped.task.world.set_state(angvel=np.full((1, 1, 3), 1e200), worlds=[2])
    *_, infos = envs.step(actions[0])
    assert infos["physics_status"].tolist() == [0, 0, physics.Status.FAULT]
    (path,) = tmp_path.iterdir()
    recording = physics.Recording.load(path)
    assert "world 2" in recording.reason
    assert len(recording) == 21  # control steps
    replay = recording.replay()
    assert replay.is_identical
    assert replay.reports[-1].faults[0] > 0
