"""Environments whose block may sleep: the same rewards, and a reset wakes it."""

from __future__ import annotations

import gymnasium as gym
import numpy as np

import physics
import rigid_env  # noqa: F401 (registers the environments)


def test_an_environment_with_sleep_is_the_same_and_its_reset_wakes():
    """Without a push the block lands, comes to rest and sleeps; at rest on its face sleep changes no bit."""
    plain, dozing = (
        gym.make_vec("rigid_env/BlockReach-v0", num_envs=4, effects=effects, accuracy="balanced")
        for effects in ((), (physics.Sleeping(),))
    )
    starts = [env.reset(seed=3)[0] for env in (plain, dozing)]
    assert np.array_equal(*starts)
    world = dozing.unwrapped.task.world
    slept = False
    for k in range(150):
        actions = np.zeros(plain.action_space.shape, plain.action_space.dtype)
        if k > 100:
            actions[1, 0] = 1.0
        steps = [env.step(actions) for env in (plain, dozing)]
        for one, other in zip(steps[0][:4], steps[1][:4]):
            assert np.array_equal(one, other)
        slept |= bool(world.asleep.all())
    assert slept
    dozing.reset(seed=4)
    assert not world.asleep.any()
