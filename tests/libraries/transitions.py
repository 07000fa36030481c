"""Transitions of the bare batch, against which those that a library stores are held."""

from __future__ import annotations

from typing import ClassVar, NamedTuple

import gymnasium as gym
import numpy as np

import physics
from rigid_env import Task, Uniform, Wrench, observe, register_task

ENV = "tests/Fall-v0"
WORLDS = 4
LIMIT = 12  # control steps of an episode
SEED = 7


class Fall(Task):
    """A falling ball: the episode fails at the ground, after 3 to 20 control steps; some reach the limit before."""

    scene = physics.Scene(bodies=[physics.Sphere(0.1, 1.0)], walls=[], effects=[physics.Gravity()])
    actions = Wrench(0, force=0.5, torque=0.0, force_axes="xz")
    observation = (observe.height(), observe.linvel())
    draws: ClassVar = {"height": Uniform(0.03, 1.2)}

    def place(self, drawn):
        zero = np.zeros_like(drawn["height"])
        return {"pos": np.stack([zero, drawn["height"], zero], axis=1)}

    def failure(self, worlds):
        return worlds.pos[:, 0, 1] < 0.0

    def rewards(self, worlds):
        return {"height": worlds.pos[:, 0, 1], "effort": -0.01 * (worlds.action**2).sum(axis=1)}


register_task(ENV, Fall)


class Transitions(NamedTuple):
    """T steps of N worlds, (T, N, ...); `next_obs` is the last observation of an episode where it ends."""

    obs: np.ndarray
    rewards: np.ndarray
    next_obs: np.ndarray
    terminated: np.ndarray
    truncated: np.ndarray


def batch(mode: str, **arguments) -> gym.vector.VectorEnv:
    """The native batch, in a mode of starting anew."""
    native = {"vectorization_mode": "vector_entry_point", "max_episode_steps": LIMIT}
    return gym.make_vec(ENV, num_envs=WORLDS, autoreset_mode=mode, **{**native, **arguments})


def replay(actions: np.ndarray) -> Transitions:
    """Take actions (T, N, numbers) in the bare batch, and reset its worlds by hand after each end of an episode."""
    envs = batch("Disabled")
    obs, rows = envs.reset(seed=SEED)[0], []
    for action in np.clip(actions, -1.0, 1.0):
        next_obs, rewards, terminated, truncated, _ = envs.step(action)
        rows.append((obs, rewards, next_obs, terminated, truncated))
        ended = terminated | truncated
        obs = envs.reset(options={"reset_mask": ended})[0] if ended.any() else next_obs
    done = Transitions(*(np.stack(column) for column in zip(*rows)))
    assert (done.terminated & ~done.truncated).any(), "no episode of these actions ends by failure"
    assert (done.truncated & ~done.terminated).any(), "no episode of these actions ends by the limit alone"
    assert (done.truncated & done.terminated).any(), "no episode of these actions fails in its last step"
    return done


def time_outs(done: Transitions) -> np.ndarray:
    """Ends by the limit alone, after which the last observation has a value; (T, N) bool."""
    return done.truncated & ~done.terminated
