"""Ids of the environments, and their registration with Gymnasium."""

from __future__ import annotations

import re
from typing import Any

from gymnasium.envs.registration import register, registry

NAMESPACE = "rigid_env"

MAX_EPISODE_STEPS = {"BlockReach": 300, "BlockReorient": 300}
"""Control steps after which an episode is truncated, by task: 7.5 s at the default 25 ms."""

GOALS = {"BlockReachGoal": 75, "BlockReorientGoal": 75}
"""Control steps after which an episode is truncated, by task with goals: 7.5 s at the default 100 ms."""

SUITE = {
    "BlockCurl": 200,
    "TwoPushers": 300,
    "BlockLand": 120,
    "BlockPose": 300,
    "BallKick": 6,
    "BallJuggle": 300,
    "BlockStack": 240,
    "BlockPush": 300,
    "BlockBalance": 240,
}
"""Tasks of `rigid_env.suite`, and control steps of their episodes."""

SCENE_ID = f"{NAMESPACE}/Scene-v0"
"""Id of the environment for any scene; its argument `scene` is required, and the scene's file may limit episodes."""


def register_envs() -> None:
    """Register all environments of this package with Gymnasium; ids that are registered already stay.

    ``import rigid_env`` calls it. Gymnasium 1.1 to 1.4, with which this package runs, does not import packages on its
    own. So ``gymnasium.make("rigid_env/BlockReach-v0")`` needs this import first, in every process. The id
    ``"rigid_env:rigid_env/BlockReach-v0"`` makes Gymnasium import the package, in workers, too. Versions of Gymnasium
    that load plugins (up to 0.29) call this function through the entry point ``gymnasium.envs``.

    Environments are named by strings, so the engine is imported only by `gymnasium.make`.
    """
    for name, steps in MAX_EPISODE_STEPS.items():
        env_id = f"{NAMESPACE}/{name}-v0"
        if env_id in registry:
            continue
        register(
            id=env_id,
            entry_point=f"rigid_env.envs.{_file_of(name)}:{name}Env",
            vector_entry_point=f"rigid_env.envs.{_file_of(name)}:{name}VectorEnv",
            max_episode_steps=steps,
        )
    goals = {name: f"rigid_env.tasks.block_goals:{name}" for name in GOALS}
    suite = {name: f"rigid_env.suite.{_file_of(name)}:{name}" for name in SUITE}
    for name, task in {**goals, **suite}.items():
        env_id = f"{NAMESPACE}/{name}-v0"
        if env_id not in registry:
            register(
                id=env_id,
                entry_point="rigid_env.envs.task:TaskEnv",
                vector_entry_point="rigid_env.envs.task:TaskVectorEnv",
                max_episode_steps={**GOALS, **SUITE}[name],
                kwargs={"task": task},
            )
    if SCENE_ID not in registry:
        module = "rigid_env.envs.scene"
        register(SCENE_ID, entry_point=f"{module}:SceneEnv", vector_entry_point=f"{module}:SceneVectorEnv")


def _file_of(name: str) -> str:
    """Name of the module of a task, such as block_reach for BlockReach."""
    return re.sub("(?<=[a-z])(?=[A-Z])", "_", name).lower()


def register_task(id: str, task: type | str, **settings: Any) -> None:
    """Register a task with Gymnasium, so that `gymnasium.make` and `make_vec` find it under its id.

    Parameters
    ----------
    id : str
        Id such as ``mine/EdgeBalance-v0``.
    task : class of Task, or str
        Class, or its import path ``module:Class``, from which new worker processes import it. The spec keeps the path
        of a class that can be imported. A class of ``__main__`` or of a function is kept as an object, and its spec
        cannot become JSON.
    settings
        Arguments of the task, such as ``accuracy``, and of its environment, in place of their defaults. The spec keeps
        them as plain data.

    Raises
    ------
    TypeError
        An unknown setting, with the known ones, the nearest first.
    ValueError
        `task` is no task.
    """
    from rigid_env.envs.making import check_settings, task_class
    from rigid_env.envs.plain import plain_settings
    from rigid_env.tasks.declaration_checks import checked_limit

    kind = task_class(task)
    check_settings(kind, settings, of_environment=True)
    checked_limit(kind.max_episode_steps, f"max_episode_steps of {kind.__name__}")
    register(
        id=id,
        entry_point="rigid_env.envs.task:TaskEnv",
        vector_entry_point="rigid_env.envs.task:TaskVectorEnv",
        max_episode_steps=kind.max_episode_steps,
        kwargs=plain_settings({"task": task, **settings}),
    )
