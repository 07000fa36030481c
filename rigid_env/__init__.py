"""Gymnasium environments on the `physics` engine: a block to be pushed, tipped and turned among three walls.

Importing the package registers `rigid_env/BlockReach-v0` and `rigid_env/BlockReorient-v0`.
"""

from rigid_env.registration import register_envs

register_envs()

__all__ = ["register_envs"]
