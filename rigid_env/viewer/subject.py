"""Make a subject for the viewer from a name, a file or an object."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any
from zipfile import is_zipfile

import numpy as np

import physics
from physics import scenes, validation
from physics.accuracy import resolve
from physics.summary import shown
from rigid_env.viewer.copies import copied, declared
from rigid_env.viewer.interface import Subject
from rigid_env.viewer.replays import PlayedRecording, PlayedTrajectory
from rigid_env.viewer.worlds import LiveWorld

ACCURACY, DT = "balanced", 0.01

NAMES = (
    "a canonical scene, a scene file (.toml, .xml or .urdf), the id of an environment, 'module:Class' of a task, a "
    "recording and a trajectory (.npz)"
)
"""Kinds of text that name a subject in a shell, for errors."""

OBJECTS = "physics.Scene, World, Trajectory, Recording and environments of rigid_env"


def open_subject(
    what: Any,
    *,
    accuracy: Any = None,
    dt: float | None = None,
    seed: int = 0,
    policy: Any = None,
    controller: bool = False,
) -> Subject:
    """Make a subject, which the viewer can play, from a name, a file or an object.

    Parameters
    ----------
    what : object
        Name of a canonical scene, path of a scene file, of a recording or of a trajectory, id of an environment; or a
        `physics.Scene`, `World`, `Trajectory`, `Recording`, or an environment of `rigid_env`, wrapped or not. A world
        or an environment is copied; the copy continues from its present state.
    accuracy : str or physics.Accuracy, optional
        Accuracy of the simulation. None: a world or an environment keeps its own, a scene gets ``balanced``.
        Not for a recording or a trajectory.
    dt : float, optional
        Step of a scene or a world [s]. None: a world keeps its own, a scene gets 0.01. Not for an environment, a
        recording or a trajectory.
    seed : int
        Seed of the first episode and of random actions.
    policy : path, callable or model, optional
        Policy for an environment: a file (`rigid_env.envs.policy_files.load_policy`), a function from observations to
        actions, both with the worlds first, or a model of Stable-Baselines3. None: random actions.
    controller : bool
        True: the handwritten controller for this environment acts (`rigid_env.envs.controllers`).

    Returns
    -------
    Subject

    Raises
    ------
    ValueError
        Something that cannot be played, a file with a mistake, or an argument that this subject does not take.
    gymnasium.error.DependencyNotInstalled
        A policy of Stable-Baselines3 without the extra `agents`.
    """
    seed = validation.index(seed, 2**32, "seed")
    if accuracy is not None:
        resolve(accuracy)
    if dt is not None:
        dt = float(validation.positive(dt, (), "dt"))
    what, name = _loaded(what)
    if _is_environment(what):
        return _open_environment(what, name, accuracy, dt, seed, policy, controller)
    _refuse(name, "no environment", policy=policy, controller=controller or None)
    if isinstance(what, physics.Scene):
        return LiveWorld(physics.World(declared(what), dt=dt or DT, accuracy=accuracy or ACCURACY), name)
    if isinstance(what, physics.World):
        return LiveWorld(copied(what, accuracy, dt), name)
    _refuse(name, "no longer simulated at will", accuracy=accuracy, dt=dt)
    kind = PlayedRecording if isinstance(what, physics.Recording) else PlayedTrajectory
    return kind(what, name)


def _refuse(name: str, why: str, **given: Any) -> None:
    """Raise a ValueError if an argument is given (is not None) that the subject called `name` does not take.

    `why` completes the sentence "`name` is ...".
    """
    for field, value in given.items():
        if value is not None:
            value = str(value) if isinstance(value, os.PathLike) else value
            raise ValueError(f"{field} is {shown(value)}, but {name} is {why}; allowed is None")


def _loaded(what: Any) -> tuple[Any, str]:
    """Load the object of a name or path: (object or environment's id, title). Objects are returned unchanged."""
    if isinstance(what, (str, os.PathLike)):
        return _of_text(os.fspath(what))
    known = (physics.Scene, physics.World, physics.Trajectory, physics.Recording)
    if isinstance(what, known) or _is_environment(what):
        return what, type(getattr(what, "unwrapped", what)).__name__
    raise ValueError(f"what is {shown(what)}; allowed are {NAMES}, and {OBJECTS}")


def _of_text(text: str) -> tuple[Any, str]:
    from rigid_env.tasks.scene_source import SCENE_FILES, find_scene

    path = Path(text)
    if text in scenes.SCENES or path.suffix.lower() in SCENE_FILES:
        found = find_scene(text)
        return found.scene, found.name
    if path.is_file():
        return _of_archive(path), path.stem
    if _is_environment(text):
        return text, text.split("/")[-1]
    if path.suffix:
        raise ValueError(f"what is {text!r}, a file that does not exist; allowed are {NAMES}")
    from rigid_env.envs.named import near_names

    near = ", ".join(near_names(text, scenes.SCENES))
    raise ValueError(f"what is {text!r}; allowed are {NAMES}, such as {near}")


def _of_archive(path: Path) -> physics.Recording | physics.Trajectory:
    """Recording or trajectory in the archive at a path."""
    allowed = "allowed are what physics.Recorder and Trajectory.to_npz write"
    if not is_zipfile(path):
        raise ValueError(f"what is {str(path)!r}, which is no archive; {allowed}")
    with np.load(path, allow_pickle=False) as file:
        names = set(file.files)
    if {"t", "pos"} <= names:
        return physics.Trajectory.from_npz(path)
    if {"head", "states"} <= names:
        return physics.Recording.load(path)
    raise ValueError(f"what is {str(path)!r}, which is neither a recording nor a trajectory; {allowed}")


# --- environments ------------------------------------------------------------------------------------------------


def _is_environment(what: Any) -> bool:
    if isinstance(what, str):
        from rigid_env.envs.named import known_ids

        return what.split(":")[-1] in known_ids() or ":" in what
    if not hasattr(what, "unwrapped"):
        return False
    from rigid_env.envs.env import RigidEnv

    return isinstance(what.unwrapped, RigidEnv)


def _open_environment(what, name, accuracy, dt, seed, policy, controller) -> Subject:
    from rigid_env.envs.named import make_named
    from rigid_env.viewer.episodes import LiveEnv

    if dt is not None:
        raise ValueError(f"dt is {dt!r}, but {name} has control steps of its own; allowed is None")
    env = what
    if isinstance(what, str):
        if what.split(":")[-1].split("/")[-1] == "Scene-v0":
            raise ValueError(f"what is {what!r}, which needs a scene; allowed is the scene, or the environment itself")
        env = make_named(what, "what")
    return LiveEnv(env, name, seed, _policy(env, policy, controller), accuracy)


def _policy(env, policy, controller):
    """Function from observations to actions for an environment; None: random actions."""
    if controller:
        return _controller(env, policy)
    if isinstance(policy, (str, os.PathLike)):
        from rigid_env.envs.policy_files import load_policy
        from rigid_env.envs.pretrained import PRETRAINED

        return load_policy(_id_of(env) if os.fspath(policy) == PRETRAINED else policy)
    if hasattr(policy, "predict"):
        from rigid_env.envs.policy_files import greedy

        return greedy(policy)
    if policy is not None and not callable(policy):
        raise ValueError(f"policy is {shown(policy)}; allowed are a file, a function and a model")
    return policy


def _id_of(env) -> str:
    """Id of an environment; if it has none, the name of its task's class."""
    return env.spec.id if env.spec is not None else type(env.unwrapped.task).__name__


def _controller(env, policy):
    """Handwritten controller of an environment, as a policy."""
    from rigid_env.envs.controllers import CONTROLLERS, load_controller

    if policy is not None:
        raise ValueError(f"policy is {shown(policy)} with controller=True; allowed is one of the two")
    names = {id_.split("/")[-1].split("-")[0]: id_ for id_ in CONTROLLERS}
    task = type(env.unwrapped.task).__name__
    if task not in names:
        raise ValueError(f"controller is True with {task}; allowed is {', '.join(names)}")
    return load_controller(names[task])
