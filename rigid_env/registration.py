"""The ids under which Gymnasium finds the environments."""

from __future__ import annotations

from gymnasium.envs.registration import register, registry

NAMESPACE = "rigid_env"

MAX_EPISODE_STEPS = {"BlockReach": 300, "BlockReorient": 300}
"""Control steps after which an episode is truncated: 7.5 s at the default 25 ms."""


def register_envs() -> None:
    """Register every environment of the package with Gymnasium; what is registered already stays.

    Called on import, and by Gymnasium itself (entry point `gymnasium.envs`), so that `gymnasium.make` finds
    the ids without an import. Entry points are named by strings: nothing of the engine is imported before
    `make`.
    """
    for name, steps in MAX_EPISODE_STEPS.items():
        env_id = f"{NAMESPACE}/{name}-v0"
        if env_id in registry:
            continue
        register(
            id=env_id,
            entry_point=f"rigid_env.env:{name}Env",
            vector_entry_point=f"rigid_env.vector_env:{name}VectorEnv",
            max_episode_steps=steps,
        )
