"""BlockReach: bring the block's centre over a place on the floor and leave it at rest there."""

from __future__ import annotations

from typing import ClassVar

from rigid_env.tasks import block_entries as entries
from rigid_env.tasks import kernels
from rigid_env.tasks import layout as col
from rigid_env.tasks.block import BlockTask
from rigid_env.tasks.block_draws import OnFloor

MARK_RADIUS = 1.0
"""[m] Radius of the disc that marks the goal in pictures; the tolerance itself would be hidden under the block."""


class BlockReach(BlockTask):
    """Task of `rigid_env.envs.block_reach.BlockReachEnv`, whose docstring describes it, in a batch of worlds."""

    observation = (
        *entries.GOAL_OFFSET,
        *entries.MOTION,
        *entries.ROTATION,
        *entries.GAPS,
        *entries.HOLD,
    )
    measures = ("distance", "speed", "spin")
    explanations: ClassVar = {
        "goal": "x and z of the goal [m]",
        "distance": "horizontal distance of the block's centre from the goal [m]",
    }
    goal_draw = "goal"
    error_name = "distance"
    compiled = staticmethod(kernels.observe_reach)

    def goal(self):
        """Distribution of the goal: a place, uniform over the floor."""
        return OnFloor(self.area)

    def note_episodes(self, rows, values):
        self.record[rows, col.GOAL : col.GOAL + 2] = values["goal"]

    def goal_mark(self, world):
        x, z = self.record[world, col.GOAL : col.GOAL + 2]
        return {"pos": (x, 0.0, z), "radius": MARK_RADIUS, "reached": self.record[world, col.HOLD] > 0}
