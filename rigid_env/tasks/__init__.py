"""Tasks of reinforcement learning: each is written once, as NumPy functions over a batch of worlds.

A task declares how episodes start, their goals, actions and observations, the rewards and what counts as success. The
single environment runs a task in a batch of one world. The vector environment and the Stable-Baselines3 adapter run it
in a batch of many. Subclass `Task` to write a task of your own.
"""

from rigid_env.tasks import compiled, observe
from rigid_env.tasks.actions import Drive, Force, Impulse, Wrench
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
    "Drive",
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
