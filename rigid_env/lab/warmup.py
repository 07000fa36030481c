"""Command `rigid-env warmup`: takes one step of environments and scenes, which compiles their kernels."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import gymnasium
import numpy as np

import physics
from physics import scenes
from physics.compiler.decorators import backend
from rigid_env.envs.named import make_named
from rigid_env.envs.registration import SCENE_ID
from rigid_env.lab.measure.environments import environment_ids
from rigid_env.tasks.scene_source import SCENE_FILES, find_scene

ACCURACIES = ("balanced", "fast")
FIRST_SCENE = "drop"  # the three-wall box, compiled at all of `ACCURACIES`; other scenes only at the first of them


@dataclass(frozen=True)
class Job:
    """One step of an environment or a scene, as a function with a name."""

    name: str
    accuracy: str
    run: Callable[[], None]


@dataclass(frozen=True)
class Warmed:
    """Result of a job.

    Attributes
    ----------
    name, accuracy : str
        Name and accuracy of the job.
    seconds : float
        Time that it took [s].
    compiled : int
        Number of kernels that it compiled; 0 if all came from the cache.
    """

    name: str
    accuracy: str
    seconds: float
    compiled: int


def jobs() -> list[Job]:
    """Default jobs: environments, the three-wall box, then the canonical scenes that need other kernels."""
    found = [job for accuracy in ACCURACIES for job in _environment_jobs(accuracy)]
    seen: set[tuple] = set()
    names = [FIRST_SCENE, *(name for name in scenes.SCENES if name != FIRST_SCENE)]
    for name in names:
        for accuracy in ACCURACIES if name == FIRST_SCENE else ACCURACIES[:1]:
            scene = scenes.by_name(name)
            key = (physics.make_plan(scene, physics.PRESETS[accuracy]).key, len(scene.walls) > 0)
            if key not in seen:
                seen.add(key)
                found.append(_scene_job(name, accuracy))
    return found


def jobs_of(names: Sequence[str], accuracies: Sequence[str]) -> list[Job]:
    """Jobs for the environments, scenes and scene files of these names, at each of the accuracies.

    Raises
    ------
    ValueError
        There is no such environment or scene.
    """
    found = []
    for name in names:
        if name in scenes.SCENES or Path(name).suffix.lower() in SCENE_FILES:
            scene = find_scene(name).scene
            found += [_scene_job(name, accuracy, scene) for accuracy in accuracies]
        else:
            env = make_named(name, "what", scenes.SCENES)
            if env.unwrapped.spec is None:
                raise ValueError(f"what is {name!r}, a class; allowed are registered environments, scenes and files")
            found += [Job(f"environment {name}", each, _stepper(env.unwrapped.spec.id, each)) for each in accuracies]
    return found


def warm(todo: list[Job]) -> Iterator[Warmed]:
    """Run jobs one after the other, and yield the result of each."""
    for job in todo:
        with backend.count_compilations() as count:
            start = time.perf_counter()
            job.run()
            seconds = time.perf_counter() - start
        yield Warmed(job.name, job.accuracy, seconds, count())


def _scene_job(name: str, accuracy: str, scene: physics.Scene | None = None) -> Job:
    def step() -> None:
        world = physics.World(scene or scenes.by_name(name), accuracy=accuracy)
        world.step()
        physics.diagnose(world)
        world.contacts()

    return Job(f"scene {name}", accuracy, step)


def _environment_jobs(accuracy: str) -> list[Job]:
    return [Job(f"environment {name}", accuracy, _stepper(name, accuracy)) for name in environment_ids()]


def _stepper(env_id: str, accuracy: str) -> Callable[[], None]:
    settings = {"scene": FIRST_SCENE} if env_id == SCENE_ID else {}

    def step() -> None:
        env = gymnasium.make(env_id, accuracy=accuracy, **settings)
        env.reset(seed=0)
        env.step(np.zeros(env.action_space.shape, env.action_space.dtype))
        env.close()
        envs = gymnasium.make_vec(env_id, num_envs=2, accuracy=accuracy, **settings)
        envs.reset(seed=0)
        envs.step(np.zeros(envs.action_space.shape, envs.action_space.dtype))
        envs.close()

    return step
