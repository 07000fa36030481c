"""Tasks, each written once over a batch of worlds: starts, goals, actions, observations, rewards, success.

The single environment is a batch of one; the vector environment and the Stable-Baselines3 adapter are the
batch itself. Subclass `Task` to set one of your own.
"""

from rigid_env.tasks import compiled, observe
from rigid_env.tasks.actions import Force, Impulse, Wrench
from rigid_env.tasks.block_reach import BlockReach
from rigid_env.tasks.block_reorient import BlockReorient
from rigid_env.tasks.distribution import Distribution
from rigid_env.tasks.distributions import Choice, LogUniform, Normal, Uniform
from rigid_env.tasks.disturbances import Gust, Push
from rigid_env.tasks.entries import Entry
from rigid_env.tasks.task import Task
from rigid_env.tasks.worlds import Worlds

__all__ = [
    "BlockReach",
    "BlockReorient",
    "Choice",
    "Distribution",
    "Entry",
    "Force",
    "Gust",
    "Impulse",
    "LogUniform",
    "Normal",
    "Push",
    "Task",
    "Uniform",
    "Worlds",
    "Wrench",
    "compiled",
    "observe",
]
