"""Play episodes of a trained policy, and write them as an animated GIF."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import gymnasium as gym

from rigid_env.envs.policy_files import act, load_policy
from rigid_env.rendering.picture import GIF_COLOURS, write_gif

SIZE = (480, 300)  # width and height of the pictures [px]
FRAME_TIME = 0.05  # time between pictures, an exact number of hundredths of a second, the unit of time in a GIF [s]
STILL = 10  # repetitions of an episode's last picture


def write_video(
    env_id: str, path: Path, seeds: Iterable[int], accuracy: str = "balanced", size=SIZE, colours: int = GIF_COLOURS
) -> list[str]:
    """Write an animated GIF of one episode for each seed.

    Parameters
    ----------
    env_id : str
        Id of an environment with a trained policy.
    path : Path
    seeds : iterable of int
    accuracy : str
    size : tuple of int
        Width and height of the pictures [px].
    colours : int
        Number of colours of the pictures; fewer make a smaller file.

    Returns
    -------
    list of str
        Outcome of each episode, such as "success after 3.20 s".

    Raises
    ------
    ValueError
        If the environment has no trained policy.
    """
    policy = load_policy(env_id)
    width, height = size
    env = gym.make(env_id, render_mode="rgb_array", width=width, height=height, accuracy=accuracy)
    pictures, outcomes = [], []
    for seed in seeds:
        found, outcome = _episode(env, policy, seed)
        pictures += found + found[-1:] * STILL
        outcomes.append(outcome)
    env.close()
    write_gif(path, pictures, 1.0 / FRAME_TIME, colours)
    return outcomes


def _episode(env: gym.Env, policy, seed: int) -> tuple[list, str]:
    """Play one episode; return its pictures, `FRAME_TIME` apart, and a text about its outcome."""
    control_dt = env.unwrapped.task.control_dt
    observation, _ = env.reset(seed=seed)
    pictures, shown, steps, is_over = [env.render()], FRAME_TIME, 0, False
    while not is_over:
        observation, _, terminated, truncated, info = env.step(act(policy, observation))
        steps += 1
        is_over = terminated or truncated
        if is_over or steps * control_dt >= shown - 1e-9:
            pictures.append(env.render())
            shown += FRAME_TIME
    return pictures, f"{'success' if info['is_success'] else 'no success'} after {steps * control_dt:.2f} s"
