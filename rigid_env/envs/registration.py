"""The ids under which Gymnasium finds the environments."""

from __future__ import annotations

import re

from gymnasium.envs.registration import register, registry

NAMESPACE = "rigid_env"

MAX_EPISODE_STEPS = {"BlockReach": 300, "BlockReorient": 300}
"""Control steps after which an episode is truncated: 7.5 s at the default 25 ms."""


def register_envs() -> None:
    """Register every environment of the package with Gymnasium; what is registered already stays.

    ``import rigid_env`` calls it. Gymnasium imports no package on its own account in any version that this one runs
    with (1.1 to 1.4): ``gymnasium.make("rigid_env/BlockReach-v0")`` needs that import first, in every process, and the
    id ``"rigid_env:rigid_env/BlockReach-v0"`` brings it along, into workers, too. Versions that load plugins (the last
    was 0.29) call this function through the entry point ``gymnasium.envs``.

    Environments are named by strings: nothing of the engine is imported before `gymnasium.make`.
    """
    for name, steps in MAX_EPISODE_STEPS.items():
        env_id = f"{NAMESPACE}/{name}-v0"
        if env_id in registry:
            continue
        module = re.sub("(?<=[a-z])(?=[A-Z])", "_", name).lower()  # BlockReach is in block_reach
        register(
            id=env_id,
            entry_point=f"rigid_env.envs.{module}:{name}Env",
            vector_entry_point=f"rigid_env.envs.vector_env:{name}VectorEnv",
            max_episode_steps=steps,
        )
