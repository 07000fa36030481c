"""The tasks, each written once over a batch of worlds: starts, goals, actions, observations, success.

The single environment is a batch of one; the vector environment and the Stable-Baselines3 adapter are the
batch itself.
"""

from rigid_env.tasks.base import Task
from rigid_env.tasks.block_reach import BlockReach
from rigid_env.tasks.block_reorient import BlockReorient

__all__ = ["BlockReach", "BlockReorient", "Task"]
