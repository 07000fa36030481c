"""Gymnasium environments on the engine `physics`: a block is pushed, tipped and turned among three walls.

Importing the package registers `rigid_env/BlockReach-v0`, `rigid_env/BlockReorient-v0` and `rigid_env/Scene-v0`, the
environment of a scene file. The engine is imported when the first environment is made.
"""

from importlib import import_module
from typing import TYPE_CHECKING

from rigid_env.envs.registration import register_envs, register_task
from rigid_env.shadowing import check_engine_is_found

if TYPE_CHECKING:
    from rigid_env.envs.block_reach import BlockReachEnv, BlockReachVectorEnv
    from rigid_env.envs.block_reorient import BlockReorientEnv, BlockReorientVectorEnv
    from rigid_env.envs.checks import check_task
    from rigid_env.envs.policy_files import load_policy
    from rigid_env.envs.sb3 import RigidVecEnv as RigidVecEnv
    from rigid_env.envs.scene import SceneEnv, SceneVectorEnv
    from rigid_env.envs.task import TaskEnv, TaskVectorEnv
    from rigid_env.tasks import (
        Choice,
        Distribution,
        Drive,
        Entry,
        Force,
        Gust,
        Impulse,
        LogUniform,
        Normal,
        Push,
        Task,
        Uniform,
        Wrench,
        compiled,
        observe,
    )
    from rigid_env.tasks.block_goals import BlockReachGoal, BlockReorientGoal
    from rigid_env.tasks.block_reach import BlockReach
    from rigid_env.tasks.block_reorient import BlockReorient
    from rigid_env.tasks.goal import GoalTask
    from rigid_env.tasks.rollout import TaskRollout, rollout
    from rigid_env.tasks.state import TaskState
    from rigid_env.viewer.show import show, to_html

    __version__: str

check_engine_is_found()
register_envs()

_OF_TASKS = (
    "Choice", "Distribution", "Drive", "Entry", "Force", "Gust", "Impulse", "LogUniform", "Normal", "Push", "Task",
    "Uniform", "Wrench", "compiled", "observe",
)  # fmt: skip

_LAZY = {
    "BlockReachEnv": "rigid_env.envs.block_reach",
    "BlockReachVectorEnv": "rigid_env.envs.block_reach",
    "BlockReorientEnv": "rigid_env.envs.block_reorient",
    "BlockReorientVectorEnv": "rigid_env.envs.block_reorient",
    **dict.fromkeys(_OF_TASKS, "rigid_env.tasks"),
    "SceneEnv": "rigid_env.envs.scene",
    "SceneVectorEnv": "rigid_env.envs.scene",
    "BlockReach": "rigid_env.tasks.block_reach",
    "BlockReachGoal": "rigid_env.tasks.block_goals",
    "BlockReorient": "rigid_env.tasks.block_reorient",
    "BlockReorientGoal": "rigid_env.tasks.block_goals",
    "GoalTask": "rigid_env.tasks.goal",
    "TaskEnv": "rigid_env.envs.task",
    "TaskRollout": "rigid_env.tasks.rollout",
    "TaskState": "rigid_env.tasks.state",
    "check_task": "rigid_env.envs.checks",
    "load_policy": "rigid_env.envs.policy_files",
    "rollout": "rigid_env.tasks.rollout",
    "show": "rigid_env.viewer.show",
    "to_html": "rigid_env.viewer.show",
    "TaskVectorEnv": "rigid_env.envs.task",
    "RigidVecEnv": "rigid_env.envs.sb3",  # needs the extra `agents`, so it is not in `__all__`
}

__all__ = [
    "BlockReach",
    "BlockReachEnv",
    "BlockReachGoal",
    "BlockReachVectorEnv",
    "BlockReorient",
    "BlockReorientEnv",
    "BlockReorientGoal",
    "BlockReorientVectorEnv",
    "Choice",
    "Distribution",
    "Drive",
    "Entry",
    "Force",
    "GoalTask",
    "Gust",
    "Impulse",
    "LogUniform",
    "Normal",
    "Push",
    "SceneEnv",
    "SceneVectorEnv",
    "Task",
    "TaskEnv",
    "TaskRollout",
    "TaskState",
    "TaskVectorEnv",
    "Uniform",
    "Wrench",
    "__version__",
    "check_task",
    "compiled",
    "load_policy",
    "observe",
    "register_envs",
    "register_task",
    "rollout",
    "show",
    "to_html",
]


def __getattr__(name: str) -> object:
    if name in _LAZY:
        value = getattr(import_module(_LAZY[name]), name)
    elif name == "__version__":
        value = _version()
    else:
        from physics.keywords import no_attribute

        raise no_attribute(__name__, name, __all__)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})


def _version() -> str:
    """Version of the installed distribution, or ``0+unknown`` if only the sources are there."""
    from importlib.metadata import PackageNotFoundError, version

    try:
        return version("rigid-env")
    except PackageNotFoundError:
        return "0+unknown"
