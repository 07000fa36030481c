"""Play episodes of a trained policy, and write them as an animated GIF in real time."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace
from pathlib import Path

import gymnasium as gym
import numpy as np

import physics
from physics.io.recording import Recording
from rigid_env.envs.policy_files import act, load_policy
from rigid_env.rendering import Frame
from rigid_env.rendering.picture import GIF_COLOURS, world_frame, write_gif
from rigid_env.rendering.view import RenderArguments, View, frame_of
from rigid_env.tasks import Task

SIZE = (480, 300)  # width and height of the pictures [px]
FRAME_TIME = 0.05  # longest time between pictures, if the physics step allows it [s]
TICK = 0.01  # unit of time in a GIF [s]
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
    env = gym.make(env_id, accuracy=accuracy)
    film = Film(env.unwrapped.task, size)
    pictures, outcomes = [], []
    for seed in seeds:
        found, outcome = _episode(env, policy, seed, film)
        pictures += found + found[-1:] * STILL
        outcomes.append(outcome)
    env.close()
    write_gif(path, pictures, 1.0 / film.interval, colours)
    return outcomes


def picture_steps(frame_skip: int, dt: float) -> int:
    """Physics steps between two pictures: at most `FRAME_TIME`, a part or a multiple of a control step.

    A part is a whole number of `TICK`, so that a GIF is played in real time. If there is none, a control step has one
    picture.

    Parameters
    ----------
    frame_skip : int
        Physics steps of a control step.
    dt : float
        Physics step [s].
    """
    control_dt, slack = frame_skip * dt, 1e-9
    if control_dt <= FRAME_TIME + slack:
        return frame_skip * int(FRAME_TIME / control_dt + slack)
    ticks = {n: n * dt / TICK for n in range(1, frame_skip) if frame_skip % n == 0 and n * dt <= FRAME_TIME + slack}
    return max((n for n, time in ticks.items() if abs(time - round(time)) < 1e-6), default=frame_skip)


class Film:
    """Pictures of a task with one world, at equal intervals of time, also within its control steps.

    Parameters
    ----------
    task : Task
    size : (2,) int
        Width and height of the pictures [px].

    Attributes
    ----------
    steps : int
        Physics steps between two pictures.
    interval : float
        Time between two pictures [s].
    """

    def __init__(self, task: Task, size: tuple[int, int]):
        self._task, dt = task, task.control_dt / task.frame_skip
        self.steps = picture_steps(task.frame_skip, dt)
        self.interval = self.steps * dt
        self._view = View(RenderArguments("rgb_array", *size), 1.0 / self.interval, type(task).__name__)

    @property
    def has_parts(self) -> bool:
        """True if there are pictures within a control step."""
        return self.steps < self._task.frame_skip

    def picture(self, frame: Frame | None = None) -> np.ndarray:
        """Picture (height, width, 3) uint8 of a frame, by default of the world as it is."""
        return self._view.draw_frame(self._task, frame_of(self._task) if frame is None else frame)

    def parts(self, before: Frame, recording: Recording) -> list[np.ndarray]:
        """Pictures within the last control step, without its end; text and goal are those of the frame `before` it.

        The physics steps of the recorded control step are taken again, one by one, in a world of their own.
        """
        after, pictures = frame_of(self._task), []
        for taken, world in enumerate(_retaken(recording), start=1):
            if taken % self.steps == 0 and taken < self._task.frame_skip:
                now = world_frame(world)
                points, forces = now.contact_points, now.contact_forces
                frame = replace(after, text=before.text, goal=before.goal, bodies=now.bodies)
                pictures.append(self.picture(replace(frame, contact_points=points, contact_forces=forces)))
        return pictures


def _retaken(recording: Recording) -> Iterator[physics.World]:
    """Yield the world of a recording after each physics step; always the same object."""
    world = recording.world()
    for k, (wrench, steps, dt) in enumerate(zip(recording.wrenches, recording.steps, recording.dt)):
        stepper = physics.Stepper(world, 1, float(dt))
        stepper.wrench[0] = wrench
        for _ in range(steps):
            with recording.past_actuator(world, k):
                stepper()
            yield world


def _episode(env: gym.Env, policy, seed: int, film: Film) -> tuple[list, str]:
    """Play one episode; return its pictures and a text about its outcome."""
    task = env.unwrapped.task
    every = max(1, film.steps // task.frame_skip)  # control steps from picture to picture
    observation, _ = env.reset(seed=seed)
    pictures, steps, is_over = [film.picture()], 0, False
    while not is_over:
        before = frame_of(task)
        recorder = physics.Recorder(task.world) if film.has_parts else None
        observation, _, terminated, truncated, info = env.step(act(policy, observation))
        steps += 1
        is_over = terminated or truncated
        if recorder is not None:
            recorder.stop()
            pictures += film.parts(before, recorder.recording())
        if is_over or steps % every == 0:
            pictures.append(film.picture())
    return pictures, f"{'success' if info['is_success'] else 'no success'} after {steps * task.control_dt:.2f} s"
